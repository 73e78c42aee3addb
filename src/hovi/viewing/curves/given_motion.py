"""What is shown or written: a trajectory, or a solution for its own."""

from __future__ import annotations

from typing import Any

from hovi.discrete.trajectory import Trajectory
from hovi.errors import expect


def motion_in(given: Any) -> Trajectory:
    """A trajectory, or that of a solution. Raises InputError for anything else."""
    motion = getattr(given, "trajectory", given)
    expect(motion, Trajectory, "the trajectory of a solution")
    assert isinstance(motion, Trajectory)
    return motion
