"""Times at which a motion is sampled for formats that hold it whole in memory."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.joined_motion import AnyMotion, JoinedMotion
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, expect
from hovi.viewing.csv_table import sample_times

Array = npt.NDArray[np.float64]

MAX_SAMPLES = 1_000_000
"""Maximum number of samples of a file that is not written piece by piece."""


def times_of(trajectory: AnyMotion, rate: float) -> Array:
    """Multiples of 1/rate below T, and T, shape (M,), strictly increasing, in [s].

    Raises InputError for a rate that is not positive or that gives more than MAX_SAMPLES.
    """
    if not isinstance(trajectory, JoinedMotion):
        expect(trajectory, Trajectory, "the trajectory of a solution")
    if trajectory.duration * rate > MAX_SAMPLES:
        raise InputError(
            f"a rate of {rate:g} gives {trajectory.duration * rate:.3g} samples, more than "
            f"{MAX_SAMPLES:,}; choose a lower rate, or the format 'csv'."
        )
    return sample_times(trajectory.duration, rate)
