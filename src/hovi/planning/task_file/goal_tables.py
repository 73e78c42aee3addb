"""[start], [goal] and [[via]]: states and task-space goals, checked against the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from hovi.checks.units import seconds
from hovi.discrete.grid import outside_motion
from hovi.discrete.state import State
from hovi.errors import HoviError, InputError, SceneError
from hovi.planning.problem.frame_goal import FrameGoal, all_of
from hovi.planning.problem.goals import FREE, Via
from hovi.planning.problem.notation.ends import END_KEYS, EndError, end_of
from hovi.planning.problem.notation.via_points import require_no_rates
from hovi.planning.search.group import with_others
from hovi.planning.task_file.messages import Keys, TomlText, spelled
from hovi.planning.task_file.schema import EndTable, ViaTable
from hovi.robot.robot import Robot
from hovi.robot.space.joint_table import JointError, configuration_of, with_angles
from hovi.robot.space.turns import turns_of

_FREE = ("free", "free_velocity", "free_acceleration")


class Begin(NamedTuple):
    """The group that moves, and the start, where the other joints stay."""

    group: str | None = None
    start: State | FrameGoal | None = None


NO_GROUP = Begin()


def read_goal(
    goal: EndTable | Sequence[EndTable],
    keys: Keys,
    robot: Robot,
    toml: TomlText,
    begin: Begin = NO_GROUP,
) -> State | FrameGoal:
    """As `read_end`, or from the tables of several frames."""
    if isinstance(goal, EndTable):
        return read_end(goal, keys, robot, toml, begin)
    found = list[FrameGoal]()
    for number, table in enumerate(goal):
        each = read_end(table, (*keys, number), robot, toml, begin)
        if not isinstance(each, FrameGoal):
            name = spelled((*keys, number))
            raise toml.error(
                (*keys, number), f"`{name}` needs a `frame`: several goals are of frames"
            )
        found.append(each)
    try:
        whole = all_of(found)
        whole.check(robot)
    except InputError as wrong:
        raise toml.error(keys, str(wrong)) from None
    return whole


def read_end(
    end: EndTable, keys: Keys, robot: Robot, toml: TomlText, begin: Begin = NO_GROUP
) -> State | FrameGoal:
    """The start, a goal or that of a via point: a state, or the target of a frame.

    begin: of a goal, the group and the start.
    """
    name = spelled(keys)
    try:
        table = with_others(_given(end), begin.group, robot, begin.start)
        assert isinstance(table, Mapping)
        chosen = end_of(table, name)
        if isinstance(chosen, FrameGoal):
            chosen.check(robot)
            return chosen
        state = chosen.resolved(robot, name)
        if isinstance(state.q, Mapping) and not turns_of(state.angles_on(robot)).any():
            state = replace(state, q=state.on(robot, name)[0])  # which says all
    except EndError as wrong:
        raise toml.error((*keys, *_key(wrong.key)), str(wrong)) from None
    except JointError as wrong:
        key = next(key for key in ("q", "v", "a") if f"{name}.{key}" in str(wrong))
        raise toml.error((*keys, key, *_key(wrong.joint)), str(wrong)) from None
    except HoviError as wrong:
        raise toml.error((*keys, "q" if end.frame is None else "frame"), str(wrong)) from None
    _check_state(state, keys, robot, toml)
    return state


def _given(end: EndTable) -> dict[str, Any]:
    """What a table has, in the notation of `end_of`."""
    table = {key: getattr(end, key) for key in END_KEYS if key in end.model_fields_set}
    if end.axis is not None:
        table["axis"] = end.axis.model_dump()
    return table


def _key(name: str | None) -> Keys:
    return () if name is None else (name,)


def _check_state(state: State, keys: Keys, robot: Robot, toml: TomlText) -> None:
    """Raise SceneError, with the line, for a state that does not fit the robot."""
    name = spelled(keys)
    q = configuration_of(state.q, robot, f"{name}.q")
    given: dict[str, Any] = {key: getattr(state, key) for key in ("v", "a")}
    rates = {key: np.zeros(robot.nv) if given[key] is None else given[key] for key in ("v", "a")}
    for key, check in (
        ("q", lambda: robot.check_configuration(q, f"{name}.q")),
        ("v", lambda: robot.check_velocity(rates["v"], f"{name}.v")),
        ("a", lambda: robot.check_velocity(rates["a"], f"{name}.a")),
        ("free", lambda: state.free_on(robot, name, 3)),
        ("turns", lambda: state.turns_on(robot, name)),
    ):
        try:
            check()
        except InputError as wrong:
            raise toml.error((*keys, key), str(wrong)) from None


def read_via(
    tables: list[ViaTable], duration: float | tuple[float, float], robot: Robot, toml: TomlText
) -> tuple[Via, ...]:
    """The via points. duration: of the motion, in [s], or its bounds."""
    points = []
    for i, table in enumerate(tables):
        longest, time = float(np.max(duration)), _time(table.time, ("via", i, "time"), toml)
        if np.isfinite(time) and time >= longest:
            sentence = outside_motion(time, longest)
            raise toml.error(("via", i, "time"), sentence)
        try:
            require_no_rates(_given(table))
        except EndError as wrong:
            raise toml.error(("via", i, *_key(wrong.key)), str(wrong)) from None
        goal = read_end(table, ("via", i), robot, toml)
        try:
            points.append(Via(time, goal))
        except InputError as wrong:
            raise toml.error(("via", i), str(wrong)) from None
    return tuple(points)


def _time(given: float | str, keys: Keys, toml: TomlText) -> float:
    if given == FREE:
        return np.inf
    try:
        return seconds(given, "the time of a via point")
    except InputError as wrong:
        raise toml.error(keys, str(wrong)) from None


def goal_value(goal: State | FrameGoal, robot: Robot) -> dict[str, Any] | list[dict[str, Any]]:
    """The table of a goal, or those of several frames."""
    return state_table(goal, robot, "goal") if isinstance(goal, State) else goal.to_tables()


def end_table(goal: State | FrameGoal, robot: Robot, name: str) -> dict[str, Any]:
    """The table from which `read_end` reads a start or a goal. name: of it in messages."""
    if isinstance(goal, State):
        return state_table(goal, robot, name)
    if goal.also:
        raise SceneError(
            f"scene files have one frame for each {name}: give goals of several frames to segments."
        )
    return goal.to_table()


def via_table(via: Via, robot: Robot) -> dict[str, Any]:
    """The table [[via]] of a via point."""
    table = end_table(via.goal, robot, "via")
    if isinstance(via.goal, State) and via.goal.v is not None:
        table["v"] = _floats(via.goal.on(robot, "via")[1])
    return {"time": float(via.time) if via.timed else FREE, **table}


def state_table(state: State, robot: Robot, name: str) -> dict[str, Any]:
    """The table of a state; a velocity and an acceleration of zero are left out."""
    state = state.resolved(robot, name)
    q, v = state.on(robot, name)
    turned = with_angles(q, state.angles_on(robot), robot)
    table: dict[str, Any] = {"q": turned if isinstance(turned, dict) else _floats(q)}
    if np.any(v):
        table["v"] = _floats(v)
    if state.a is not None and np.any(np.asarray(state.a)):
        table["a"] = _floats(state.a)
    for key in _FREE:
        if getattr(state, key):
            table[key] = list(getattr(state, key))
    if state.turns:
        turns = {joint: np.asarray(x, dtype=float).tolist() for joint, x in state.turns.items()}
        table["turns"] = turns
    return table


def _floats(values: Any) -> list[float]:
    return [float(each) for each in np.asarray(values)]
