"""The task of a motion: its scene between its own ends, within what it was planned within."""

from __future__ import annotations

import dataclasses
import warnings
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from hovi.discrete.measures.motion_segments import motion_segments
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.notation.ends import as_end
from hovi.planning.search.options import PlanOptions
from hovi.planning.search.planner import ASKED_GOAL
from hovi.planning.sequence.segment import Segment
from hovi.planning.task_file.task import Task
from hovi.scene.scene import Scene

if TYPE_CHECKING:
    from hovi.conditions.kept.keep import Keep

Array = npt.NDArray[np.float64]

_DIGITS = 12
"""Decimals of what is read off a motion, in [rad], [m] and [s]."""
_ZERO = 1e-9
"""Rates below count as zero, in [rad/s] and [m/s]."""


def task_of_motion(
    motion: Trajectory,
    limits: Limits | None,
    segment_limits: tuple[Limits, ...] = (),
    clearance: Clearance | None = None,
) -> Task:
    """A task of which the motion is a solution.

    Its ends are states, but for the goal of a frame of a motion without segments, which is as it
    was asked. Velocities are given where segments meet.

    limits, clearance: what the motion was planned within. segment_limits: those of each segment.
    Raises InputError for a motion without a scene, SceneError where scene files have no key.
    """
    scenes = motion.scenes
    if not scenes:
        raise InputError("this motion was saved without its scene.")
    kept = Clearance() if clearance is None else clearance
    options = PlanOptions(
        limits="none" if limits is None or segment_limits else _named(limits, scenes[0]),
        obstacles=kept.obstacles,
        margin=kept.margin,
        self_collision=kept.self_collision,
        keep=_kept(motion),
    )
    start = _state(motion, 0)
    if len(scenes) == 1:
        return Task(scenes[0], start, _goal(motion), motion.duration, options)
    kinds = set.intersection(*({each.key for each in scene.effects} for scene in scenes))
    common = [each for each in scenes[0].effects if each.key in kinds]
    segments = [
        Segment(
            _state(motion, part.intervals.stop),
            round(part.end - part.begin, _DIGITS),
            effects=[each for each in scene.effects if each not in common],
            name=part.name,
            limits=_named(segment_limits[number], scene) if segment_limits else None,
        )
        for number, (part, scene) in enumerate(zip(motion_segments(motion), scenes, strict=True))
    ]
    shared = Scene(scenes[0].robot, common, passive=scenes[0].passive, begin=scenes[0].begin)
    return Task.of_segments(shared, start, segments, options)


def _goal(motion: Trajectory) -> State | FrameGoal:
    """The goal of a frame as it was asked, with the last configuration as its guess; or that.

    Raises InputError for a table in the motion that is none of a goal.
    """
    asked, robot, last = motion.metadata.get(ASKED_GOAL), motion.robot, _state(motion, -1)
    if not isinstance(asked, dict | list) or robot is None:
        return last
    goal = as_end(asked, robot, "goal")
    return dataclasses.replace(goal, guess=motion.q[-1]) if isinstance(goal, FrameGoal) else last


def _kept(motion: Trajectory) -> tuple[Keep, ...]:
    """What it keeps, in the parts of it in which it does."""
    if not motion.metadata.get("keep"):
        return ()
    from hovi.conditions.kept.kinds import recorded  # most motions keep nothing

    return recorded(motion.metadata)


def _named(limits: Limits, scene: Scene) -> Limits | str:
    """The limits, by their name where they are those of the URDF."""
    with warnings.catch_warnings():  # about ranges that look like degrees: planning says so
        warnings.simplefilter("ignore")
        stated = as_limits(scene.robot, "urdf")
    same = not limits.conditions and limits.tolerance == stated.tolerance
    same = same and limits.lower.shape == stated.lower.shape
    same = same and np.array_equal(limits.lower, stated.lower)
    return "urdf" if same and np.array_equal(limits.upper, stated.upper) else limits


def _state(motion: Trajectory, node: int) -> State:
    """The state at a node, with the acceleration of motions of order 3 at their ends."""
    q, v = np.round(motion.q[node], _DIGITS), motion.v[node]
    ends = node in (0, -1, motion.grid.intervals)
    if motion.grid.order < 3 or not ends:
        return State(q, _rounded(v))
    a = motion.jet(0.0 if node == 0 else motion.duration)[2][0]
    return State(q, _rounded(v), a=_rounded(a))


def _rounded(rates: Array) -> Array:
    """Rates without what a solver leaves of a zero."""
    return np.asarray(np.round(np.where(np.abs(rates) < _ZERO, 0.0, rates), _DIGITS), float)
