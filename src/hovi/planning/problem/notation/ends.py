"""Starts and goals from tables, in the words of a scene file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard, cast

import numpy.typing as npt

from hovi.discrete.state import Configuration, State, as_state
from hovi.errors import InputError, nearest
from hovi.planning.problem.frame_goal import FrameGoal, all_of, require_goals
from hovi.planning.problem.notation.other_planners import refuse_pose
from hovi.robot.robot import Robot
from hovi.robot.space.coordinates import Coordinates
from hovi.robot.space.orientation import ORIENTATIONS

Frames = Sequence[FrameGoal | Mapping[str, Any]]
"""Goals of several frames at once, or their tables."""
End = State | FrameGoal | Frames | npt.ArrayLike | str | Mapping[str, Any]
"""A start or a goal as it may be given."""

FRAME_KEYS = (
    *("pose", "position", "rotation", *ORIENTATIONS, "axis", "guess"),
    *("within", "within_angle", "box_frame", "velocity", "angular_velocity"),
)
"""Keys of a table that belong to a frame's target; free_velocity belongs to both."""
STATE_KEYS = ("q", "v", "a", "free", "free_acceleration", "turns")
"""Keys of a table that belong to a state."""
_NAMES = {"free", "free_velocity", "free_acceleration"}
"""Keys with names of joints."""
END_KEYS = ("frame", "free_velocity", *FRAME_KEYS, *STATE_KEYS)


class EndError(InputError):
    """A table of an end is wrong at one of its keys: `key`, or None for the whole table."""

    def __init__(self, sentence: str = "", key: str | None = None) -> None:
        super().__init__(sentence)
        self.key = key

    def __reduce__(self) -> tuple[type[EndError], tuple[str, str | None]]:
        """Pickled with its key."""
        return type(self), (str(self), self.key)


def as_end(given: End, on: Coordinates, name: str) -> State | FrameGoal:
    """A start or a goal from a state, a frame goal, a configuration, a pose's name or a table.

    A table has joint names and positions, or the keys of [start] and [goal] in a scene file; a list
    of frame goals, or of their tables, is a goal of several frames at once.
    on: the robot, or the coordinates of a problem without one, which have no frames.
    name: "start" or "goal". Raises InputError.
    """
    if are_frames(given):
        given = frames_of(given, name)
        if isinstance(on, Robot):
            given.check(on)
    if isinstance(given, FrameGoal):
        return given
    if isinstance(given, Mapping) and _is_end_table(given, on):
        given = end_of(given, name)
        if isinstance(given, FrameGoal):
            if isinstance(on, Robot):
                given.check(on)
            return given
    if not isinstance(given, State | str | Mapping):
        refuse_pose(given, on, name)
    state = as_state(cast(State | Configuration, given), on, name)
    if not isinstance(given, State):
        state.on(on, name)
    return state


def as_start(given: End, on: Coordinates) -> State | FrameGoal:
    """As `as_end`, of a start, which has no region and no frame that moves. Raises InputError."""
    start = as_end(given, on, "start")
    if isinstance(start, FrameGoal) and start.regional:
        raise InputError("a start takes no region: leave `within` and `within_angle` out.")
    if isinstance(start, FrameGoal) and start.moving:
        raise InputError("a start takes no velocity of a frame: give hovi.State(q, v).")
    return start


def end_of(table: Mapping[str, Any], name: str) -> State | FrameGoal:
    """The state or the frame goal of a table with END_KEYS. name: in messages, such as "start".

    Raises InputError for unknown keys, keys that do not belong together, and invalid values.
    """
    given = {key: value for key, value in table.items() if _is_given(value)}
    for key in _NAMES & given.keys():
        given[key] = tuple(given[key]) if isinstance(given[key], list) else given[key]
    for key in given:
        if key not in END_KEYS:
            raise EndError(f"unknown key `{name}.{key}`; {nearest(str(key), END_KEYS)}", None)
    if "frame" not in given:
        for key in FRAME_KEYS:
            if key in given:
                more = ": velocities of joints are `v`" if "velocity" in key else ""
                raise EndError(f"`{key}` needs a `frame`{more}.", key)
        if "q" not in given:
            raise EndError(f"`{name}` needs q, or a frame and its target.")
        return State(given.pop("q"), given.pop("v", None), **given)
    for key in STATE_KEYS:
        if key in given:
            what = "a start" if name == "start" else "a goal"
            raise EndError(f"{what} of a `frame` takes no `{key}`: leave it out.", key)
    axis = given.get("axis")
    if isinstance(axis, Mapping) and axis.keys() != {"frame", "world"}:
        raise EndError(f"`{name}.axis` needs two directions, `frame` and `world`.", "axis")
    return FrameGoal(given.pop("frame"), **given)


def are_frames(given: Any) -> TypeGuard[Frames]:
    """Whether a goal is a list of frame goals or of their tables."""
    if not isinstance(given, list | tuple) or not given:
        return False
    of_tables = all(isinstance(each, FrameGoal | Mapping) for each in given)
    return of_tables or any(isinstance(each, FrameGoal) for each in given)


def frames_of(given: Frames, name: str) -> FrameGoal:
    """The goal of several frames at once. Raises InputError for entries of another kind."""
    ends = [end_of(each, name) if isinstance(each, Mapping) else each for each in given]
    require_goals(ends)
    return all_of([each for each in ends if isinstance(each, FrameGoal)])


def _is_end_table(given: Mapping[str, Any], on: Coordinates) -> bool:
    """Whether a mapping is a table of an end rather than of joints."""
    joints = set(on.joint_names)
    return not any(key in joints for key in given) and any(key in END_KEYS for key in given)


def _is_given(value: Any) -> bool:
    """Whether there is a value, be it an empty one."""
    return value is not None
