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
