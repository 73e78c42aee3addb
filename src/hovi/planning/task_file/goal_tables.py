"""[start], [goal] and [[via]]: states and task-space goals, checked against the robot."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from hovi.discrete.state import State
from hovi.errors import HoviError, InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.units import seconds
from hovi.planning.task_file.joint_tables import read_configuration, read_rates
from hovi.planning.task_file.messages import Keys, TomlText, spelled
from hovi.planning.task_file.schema import EndTable, GoalTable, ViaTable
from hovi.robot.robot import Robot

_OF_FRAMES = ("position", "rpy", "axis")
_FREE = ("free", "free_velocity", "free_acceleration")


def read_goal(goal: GoalTable, keys: Keys, robot: Robot, toml: TomlText) -> State | FrameGoal:
    """A state, or a task-space goal."""
    if goal.frame is None:
        for key in _OF_FRAMES:
            if getattr(goal, key) is not None:
                raise toml.error((*keys, key), f"`{key}` needs a `frame`")
        return read_state(goal, keys, robot, toml)
    for key in ("q", "v", "a", "free", "free_acceleration", "turns"):
        if getattr(goal, key):
            raise toml.error((*keys, key), f"a goal of a `frame` takes no `{key}`: leave it out")
    rotation = None if goal.rpy is None else pin.rpy.rpyToMatrix(np.array(goal.rpy))
    axis = None if goal.axis is None else (goal.axis.frame, goal.axis.world)
    free = tuple(goal.free_velocity)
    try:
        chosen = FrameGoal(
            goal.frame, position=goal.position, rotation=rotation, axis=axis, free_velocity=free
        )
        chosen.check(robot)
    except HoviError as wrong:
        raise toml.error((*keys, "frame"), str(wrong)) from None
    return chosen


def read_state(end: EndTable | GoalTable, keys: Keys, robot: Robot, toml: TomlText) -> State:
    """The state of [start], [goal] or [[via]]."""
    name = spelled(keys)
    if end.q is None:
        raise toml.error(keys, f"`{name}` needs q, or a frame and its target")
    q = read_configuration(end.q, keys, robot, toml)
    v, a = (
        read_rates(x, (*keys, key), robot, toml) if isinstance(x, dict) else x
        for key, x in (("v", end.v), ("a", end.a))
    )
    free = {key: tuple(getattr(end, key, ())) for key in _FREE}
    turns: dict[str, Any] = dict(getattr(end, "turns", {}))
    state = State(q, v, a=a, turns=turns, **free)
    for key, check in (
        ("q", lambda: robot.check_configuration(q, f"{name}.q")),
        ("v", lambda: robot.check_velocity(np.zeros(robot.nv) if v is None else v, f"{name}.v")),
        ("a", lambda: robot.check_velocity(np.zeros(robot.nv) if a is None else a, f"{name}.a")),
        ("free", lambda: state.free_on(robot, name, 3)),
        ("turns", lambda: state.turns_on(robot, name)),
    ):
        try:
            check()
        except InputError as wrong:
            raise toml.error((*keys, key), str(wrong)) from None
    return state


def read_via(
    tables: list[ViaTable], duration: float | tuple[float, float], robot: Robot, toml: TomlText
) -> tuple[Via, ...]:
    """The via points. duration: of the motion, in [s], or its bounds."""
    points = []
    for i, table in enumerate(tables):
        longest, time = float(np.max(duration)), _time(table.time, ("via", i, "time"), toml)
        if time >= longest:
            sentence = f"the via point at {time:g} s is not inside the motion of {longest:g} s"
            raise toml.error(("via", i, "time"), sentence)
        for key in ("a", "free_acceleration"):
            if getattr(table, key):
                raise toml.error(("via", i, key), f"a via point takes no `{key}`: leave it out")
        goal = read_goal(table, ("via", i), robot, toml)
        try:
            points.append(Via(time, goal))
        except InputError as wrong:
            raise toml.error(("via", i), str(wrong)) from None
    return tuple(points)


def _time(given: float | str, keys: Keys, toml: TomlText) -> float:
    try:
        return seconds(given, "the time of a via point")
    except InputError as wrong:
        raise toml.error(keys, str(wrong)) from None


def goal_table(goal: State | FrameGoal, robot: Robot) -> dict[str, Any]:
    """The table from which `read_goal` reads this goal."""
    if isinstance(goal, State):
        return state_table(goal, robot, "goal")
    table: dict[str, Any] = {"frame": goal.frame}
    if goal.position is not None:
        table["position"] = _floats(goal.position)
    if goal.rotation is not None:
        table["rpy"] = _floats(pin.rpy.matrixToRpy(np.asarray(goal.rotation)))
    if goal.axis is not None:
        table["axis"] = {"frame": _floats(goal.axis[0]), "world": _floats(goal.axis[1])}
    if goal.free_velocity:
        table["free_velocity"] = list(goal.free_velocity)
    return table


def via_table(via: Via, robot: Robot) -> dict[str, Any]:
    """The table [[via]] of a via point."""
    table = goal_table(via.goal, robot)
    if isinstance(via.goal, State) and via.goal.v is not None:
        table["v"] = _floats(via.goal.v)
    return {"time": float(via.time), **table}


def state_table(state: State, robot: Robot, name: str) -> dict[str, Any]:
    """The table of a state; a velocity and an acceleration of zero are left out."""
    q, v = state.on(robot, name)
    table: dict[str, Any] = {"q": _floats(q)}
    if np.any(v):
        table["v"] = _floats(v)
    if state.a is not None and np.any(state.a):
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
