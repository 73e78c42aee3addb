"""Whether the numbers of a motion that came from a file belong together."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.errors import InputError
from hovi.robot.space.chart import Chart
from hovi.robot.space.configuration_space import ConfigurationSpace

Array = npt.NDArray[np.float64]

TOLERANCE = 1e-6
"""Relative to the largest coordinate; a motion as it was written misses by rounding alone."""


def require_continuous(
    path: DiscretePath, grid: Grid, space: ConfigurationSpace | None = None
) -> None:
    """Refuse a path whose nodes do not follow from each other by what it says about its intervals.

    q1 = q0 (+) x1 and v1 = J(x1) x1' hold for every interval, with x1 = h v0 + h^2 z0 and
    x1' = v0 + h z1; where configurations are vectors that is q1 = q0 + x1 and v1 = x1'.

    space: the configuration space; None where configurations are vectors.
    Raises InputError naming the interval.
    """
    h = grid.steps[:, None]
    x, v = h * path.v[:-1] + h**2 * path.z[:, 0], path.v[:-1] + h * path.z[:, 1]
    if space is None:
        q = path.q[:-1] + x
    else:
        q, v, _ = Chart(space).jet(path.q[:-1], x, v, np.zeros_like(v))
        q = space.nearest(q, path.q[1:])
    for name, found, wanted in (("q", path.q, q), ("v", path.v, v)):
        miss = np.abs(found[1:] - wanted).max(axis=1, initial=0.0)  # (N,)
        if not miss.max() <= TOLERANCE * (1.0 + np.abs(found).max(initial=0.0)):
            raise InputError(
                f"{name} at the end of interval {int(miss.argmax())} is not what its beginning "
                f"and z say; the difference is {miss.max():.3g}."
            )
