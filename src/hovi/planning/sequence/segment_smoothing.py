"""smooth = True of a sequence: each segment has the cost on the jerk that it would have alone.

A segment in which the robot stands still, such as one in which a gripper closes, has that of the
longer of the neighboring motions. By its own duration, its accelerations could come and go as fast
as the gripper closes; the neighboring motions are not that fast, and nothing is gained by it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi.discrete.state import State
from hovi.effects import Effect
from hovi.planning.problem.notation.smoothing import smoothed
from hovi.planning.search.job import Acting, JobSegment
from hovi.planning.sequence.branches import End, MoveToGoal
from hovi.planning.sequence.segment import Segment
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]

SAME = 1e-6
"""Difference of two configurations up to which they are the same, in [rad] or [m]."""


def smoothed_segments(
    scene: Scene,
    start: State,
    moves: Sequence[MoveToGoal],
    segments: Sequence[Segment],
    job_segments: Sequence[JobSegment],
) -> tuple[Scene, tuple[JobSegment, ...]]:
    """The scene of a sequence with a cost on the jerk, and its segments, each with its own.

    One that has such a cost among its effects keeps it.
    moves: to the goals, with the branches in which they are reached. job_segments: of the job.
    Raises InputError as `smoothed` does.
    """
    still = _standing_still(scene.robot, start, moves, len(segments))
    durations = smoothed_durations([each.seconds for each in segments], still)
    found = [smoothed(scene, start, moves[-1].goal, T) for T in durations]
    return found[0], tuple(
        JobSegment(segment.end, _with_default(each.effects[-1], segment.acting))
        for each, segment in zip(found, job_segments, strict=True)
    )


def smoothed_durations(durations: Sequence[float], still: Sequence[bool]) -> list[float]:
    """The durations that the smoothing of segments goes by, in [s]: see the module.

    still: which segments stand still.
    """
    T = np.asarray(durations, dtype=np.float64)
    moving = np.flatnonzero(~np.asarray(still))
    found = T.copy()
    for i in np.flatnonzero(still):
        neighbors = [*moving[moving < i][-1:], *moving[moving > i][:1]]
        found[i] = max(T[i], *T[neighbors]) if neighbors else T[i]
    return [float(each) for each in found]


def _with_default(cost: Effect, acting: Acting) -> Acting:
    known = any(each.key == cost.key for each in acting.effects)
    return acting if known else Acting((cost, *acting.effects))


def _standing_still(
    robot: Robot, start: State, moves: Sequence[MoveToGoal], number: int
) -> list[bool]:
    """Which segments end where the one before them does."""
    still, before = [False] * number, _configuration(robot, start)
    for move in moves:
        here = _configuration(robot, move.goal)
        same = before is not None and here is not None and np.abs(here - before).max() <= SAME
        still[move.numbers[-1]] = same and len(move.numbers) == 1
        before = here
    return still


def _configuration(robot: Robot, end: End) -> Array | None:
    """q at an end: that of the branch where a frame has a goal; None if none is known."""
    if isinstance(end, State):
        return end.on(robot, "goal")[0]
    return None if end.guess is None else np.asarray(end.guess, dtype=np.float64)
