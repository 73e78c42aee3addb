"""What is shown or written: a trajectory, or a solution for its own."""

from __future__ import annotations

import os
from typing import Any

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, expect


def motion_in(given: Any) -> Trajectory:
    """A trajectory, or that of a solution. Raises InputError for anything else."""
    if isinstance(given, str | os.PathLike):
        raise InputError(
            f"expected a motion, got the name {str(given)!r}: read the file by "
            "hovi.Trajectory.load(...)."
        )
    motion = getattr(given, "trajectory", given)
    expect(motion, Trajectory, "the trajectory of a solution")
    assert isinstance(motion, Trajectory)
    return motion


def motions_in(given: Any) -> list[Trajectory]:
    """The trajectories of a list of motions, or of a single one. Raises InputError."""
    if isinstance(given, str | os.PathLike | Trajectory) or hasattr(given, "trajectory"):
        given = (given,)
    try:
        motions = list(given)
    except TypeError:
        raise InputError(
            f"compare must be a list of motions, got {type(given).__name__}."
        ) from None
    return [motion_in(each) for each in motions]
