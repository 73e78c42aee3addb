"""Which limits a motion was planned under, and when it stands at one of them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Sample, Trajectory
from hovi.errors import InputError
from hovi.planning.problem.limits import Limits
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

AT_LIMIT = 1e-3
"""Share of its range within which an output counts as standing at its bound."""


def imposed_limits(trajectory: Trajectory) -> Limits | None:
    """The limits that the metadata of a motion remembers; None where there are none.

    Metadata may come from a file: what does not describe limits of this motion counts as none.
    """
    data = trajectory.metadata.get("limits")
    if not isinstance(data, dict):
        return None
    try:
        limits = Limits.from_dict(data)
    except (InputError, KeyError, TypeError, ValueError):
        return None
    shape = (4, trajectory.v.shape[1])
    fits = limits.lower.shape == limits.upper.shape == shape
    return limits if fits and limits.bounded.any() else None


def at_limit(limits: Limits, motion: Sample, robot: Robot | None) -> Mask:
    """Which of q, v, a and tau stand at a bound, shape (M, 4, nv)."""
    q = motion.q
    if robot is not None and not robot.vector_joints:
        q = robot.space.coordinates(q)
    outputs = np.stack([q, motion.v, motion.a, motion.tau], axis=1)
    return np.asarray(limits.excess(outputs) >= -AT_LIMIT)
