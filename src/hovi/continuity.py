"""Whether the numbers of a motion that came from a file belong together."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError
from hovi.grid import DiscretePath, Grid

Array = npt.NDArray[np.float64]

TOLERANCE = 1e-6
"""Relative to the largest coordinate; a motion as it was written misses by rounding alone."""


def require_continuous(path: DiscretePath, grid: Grid) -> None:
    """Refuse a path whose nodes do not follow from each other by what it says about its intervals.

    q1 = q0 + h v0 + h^2 z0 and v1 = v0 + h z1 hold for every interval of joints with nq = nv.
    Raises InputError naming the interval.
    """
    h = grid.steps[:, None]
    q = path.q[:-1] + h * path.v[:-1] + h**2 * path.z[:, 0]
    v = path.v[:-1] + h * path.z[:, 1]
    for name, found, wanted in (("q", path.q, q), ("v", path.v, v)):
        miss = np.abs(found[1:] - wanted).max(axis=1, initial=0.0)  # (N,)
        if not miss.max() <= TOLERANCE * (1.0 + np.abs(found).max(initial=0.0)):
            raise InputError(
                f"{name} at the end of interval {int(miss.argmax())} is not what its beginning "
                f"and z say; the difference is {miss.max():.3g}."
            )
