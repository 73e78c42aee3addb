"""A plan for a group of the robot's joints, as its SRDF names them, with the rest held."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.discrete.state import ALL, State
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.inverse_kinematics import first_configuration, position_bounds
from hovi.robot.loading import with_locked
from hovi.robot.robot import Robot
from hovi.robot.space.joint_table import with_angles
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]
Goal = TypeVar("Goal")

MOVED = 1e-9
"""Change of a coordinate above which a goal moves its joint, in [rad] or [m]."""


def in_group(
    scene: Scene, group: str, start: State | FrameGoal, goal: State | FrameGoal
) -> tuple[Scene, State | FrameGoal, State | FrameGoal]:
    """The scene and the ends of a motion of a group's joints alone.

    The others are locked where they are at the start; the goal has to leave them there. Where the
    start is a FrameGoal they are at its guess, or at their neutral configuration.
    Raises InputError for an unknown group, a goal that moves other joints, or vectors of another
    length.
    """
    robot = scene.robot
    chosen = robot.semantics.joints_of(group, robot.model)
    others = tuple(joint for joint in robot.joint_names if joint not in chosen)
    if len(others) == len(robot.joint_names):
        raise InputError(f"group {group!r} has no joint that moves: name another one.")
    if not others:
        return scene, start, goal
    q = _whole(robot, start)
    angles = robot.difference(robot.neutral(), q)
    if isinstance(start, State):
        given = start.angles_on(robot)
        angles = np.where(np.isnan(given), angles, given)
    held = tuple((joint, float(angles[robot.entries_of(joint)][0])) for joint in others)
    for joint in others:
        part = robot.entries_of(joint)
        moved = goal.on(robot, "goal")[0] if isinstance(goal, State) else q
        if np.abs(robot.difference(q, moved)[part]).max() > MOVED:
            raise InputError(
                f"joint {joint!r} is not in group {group!r}, and the goal moves it: give it the "
                "position of the start, or leave the group out."
            )
    smaller = _scene(scene, held)
    return smaller, _end(start, robot, smaller.robot), _end(goal, robot, smaller.robot)


def with_others(
    goal: Goal, group: str | None, robot: Robot, start: State | FrameGoal | None
) -> Goal | State | Mapping[str, Any]:
    """The goal, with the joints outside of the group that its table of joints leaves out.

    They are where they are at the start. Raises InputError for an unknown group.
    """
    table: Any = goal.q if isinstance(goal, State) else goal
    inside = isinstance(table, Mapping) and "q" in table
    given = table["q"] if inside else table
    if group is None or start is None or not isinstance(given, Mapping):
        return goal
    if not any(joint in robot.joint_names for joint in given):
        return goal
    moving, q = robot.semantics.joints_of(group, robot.model), _whole(robot, start)
    still = {j: q[_part(robot, j, "nq")] for j in robot.joint_names if j not in moving}
    whole = {**still, **given}
    if isinstance(goal, State):
        return dataclasses.replace(goal, q=whole)
    return {**table, "q": whole} if inside else whole


@lru_cache(maxsize=16)
def _scene(scene: Scene, held: tuple[tuple[str, float], ...]) -> Scene:
    """The scene without some joints, the same one for the same positions."""
    robot, names = with_locked(scene.robot, dict(held)), {joint for joint, _ in held}
    passive = tuple(joint for joint in scene.passive if joint not in names)
    return dataclasses.replace(scene, robot=robot, passive=passive)


def _whole(robot: Robot, end: State | FrameGoal) -> Array:
    """The configuration of an end, shape (nq,)."""
    if isinstance(end, State):
        return end.on(robot, "start")[0]
    return first_configuration(robot, end, None, position_bounds(robot, "none"))


def _end(end: State | FrameGoal, robot: Robot, smaller: Robot) -> State | FrameGoal:
    """An end of the motion with the joints that the smaller robot has."""
    kept_q, kept_v = (_entries(robot, smaller, key) for key in ("nq", "nv"))
    if isinstance(end, FrameGoal):
        guess = None if end.guess is None else np.asarray(end.guess)[kept_q]
        return dataclasses.replace(end, guess=guess)
    changed: dict[str, Any] = {
        key: None if getattr(end, key) is None else np.asarray(getattr(end, key))[kept_v]
        for key in ("v", "a", "jerk")
    }
    free: dict[str, Any] = {
        key: tuple(
            joint
            for joint in getattr(end, key)
            if joint == ALL or joint.split("[")[0] in smaller.joint_names
        )
        for key in ("free", "free_velocity", "free_acceleration", "free_jerk")
    }
    q, angles = end.on(robot, "an end")[0][kept_q], end.angles_on(robot)[kept_v]
    return dataclasses.replace(end, q=with_angles(q, angles, smaller), **changed, **free)


def _entries(robot: Robot, smaller: Robot, size: str) -> list[int]:
    """The entries of q (size "nq") or v ("nv") of the joints that the smaller robot has."""
    return [i for name in smaller.joint_names for i in _part(robot, name, size)]


def _part(robot: Robot, name: str, size: str) -> range:
    """The entries of q (size "nq") or v ("nv") of a joint."""
    joint = robot.model.joints[robot.model.getJointId(name)]
    first = joint.idx_q if size == "nq" else joint.idx_v
    return range(first, first + getattr(joint, size))
