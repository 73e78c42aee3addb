"""The ends of motions that are planned again."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.state import Periodic, State, as_state
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.space.coordinates import Coordinates

NEAR_DISTANCE, NEAR_ANGLE = 0.1, 0.5
"""Distance in [m] and angle in [rad] from a frame goal up to which `replan` keeps the old end."""


ROOM = 5e-7
"""Distance of a start from a limit that it is at, as a share of the range: without any there would
be no motion strictly within the limits."""


def is_near(goal: FrameGoal, problem: TrajectoryProblem, path: DiscretePath) -> bool:
    """Whether the end of a path is near a frame goal, whose equations also hold at half a turn."""
    distance, angle = goal.condition(problem.robot).pose_error(path.q[-1])
    return distance <= NEAR_DISTANCE and angle <= NEAR_ANGLE


def as_goal(
    goal: State | FrameGoal | Periodic | npt.ArrayLike | str, coordinates: Coordinates
) -> State | FrameGoal | Periodic:
    """A goal, from one, a configuration at rest or the name of a pose."""
    return goal if isinstance(goal, FrameGoal | Periodic) else as_state(goal, coordinates)


def first_state(path: DiscretePath) -> State:
    """The state that a path starts in."""
    return State(path.q[0], **dict(zip(("v", "a", "jerk"), path.rates[0], strict=False)))


def inside_limits(state: State, problem: TrajectoryProblem) -> State:
    """A state that is at limits to their tolerance, with room between it and them.

    Others are left as they are: they may be outside the limits.
    """
    on, limits = problem.coordinates, problem.limits
    if limits is None or not limits.bounded.any():
        return state
    first, given = limits.at_ends[0], state.jet_on(on, "start")
    moved: dict[str, Any] = {}
    for row, key in enumerate(("q", "v", "a")[: problem.ld.k]):
        if row == 0 and not on.vector_joints:
            continue
        x, room = given[row], ROOM * limits.ranges[row]
        low, high = first.lower[row] + room, first.upper[row] - room
        near = np.where(limits.bounded[row], (1.0 + limits.tolerance / ROOM) * room, 0.0)
        inside = np.clip(x, low, high)
        moved[key] = np.where(np.abs(inside - x) <= near, inside, x)
    return dataclasses.replace(state, **moved)
