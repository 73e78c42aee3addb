"""Whether polynomials stay within their bounds at all times, by their control points.

On an interval a limited coordinate is at most its largest control point. Where that is over the
bound the interval is halved, which brings the control points four times nearer to the curve, until
they are within the bound or the curve itself is over it: the answer needs no samples.
[Farin2002]
"""

from __future__ import annotations

from functools import cache
from math import comb

import numpy as np
import numpy.typing as npt

from hovi.discrete.interval_paths import scaled_data
from hovi.discrete.trajectory import Trajectory
from hovi.planning.solver.limits.limited_coordinates import LimitedCoordinates
from hovi.schemes.control_points import control_rows

Array = npt.NDArray[np.float64]

MOST_HALVINGS = 40
"""Number of halvings after which a polynomial that still may be over its bound counts as over it:
the control points are nearer to the curve than rounding errors."""


def exceeds(motion: Trajectory, limited: LimitedCoordinates, most: float) -> bool:
    """Whether a limited coordinate is over a bound anywhere by more than a share of its range.

    most: the share.
    """
    orders = map(int, np.unique(limited.order))
    return any(_exceeds(each, most) for j in orders for each in _over_bounds(motion, limited, j))


def _over_bounds(motion: Trajectory, limited: LimitedCoordinates, order: int) -> list[Array]:
    """Control points over the upper and below the lower bounds, as shares, (N C, d + 1) each."""
    own = np.flatnonzero(limited.order == order)
    points = _control_points(motion, order)[:, :, limited.joint[own]].transpose(0, 2, 1)
    lower, upper = (each[:, own, None] for each in (limited.lower, limited.upper))
    ranges = limited.ranges[own, None]
    sides = (points - upper) / ranges, (lower - points) / ranges
    return [side.reshape(-1, points.shape[2]) for side in sides]


def _control_points(motion: Trajectory, order: int) -> Array:
    """Control points of q^(order) on all intervals, (N, d + 1, nv)."""
    grid, path, space = motion.grid, motion.path, motion.space
    whole = np.zeros(1), np.ones(1)
    table = control_rows(*whole, grid.order, grid.inner_modes, order)[0][0]
    numbers, steps = np.arange(grid.intervals), grid.steps[:, None]
    points = np.matmul(table, scaled_data(path, numbers, steps, grid.inner_modes))
    if order > 0:
        return np.asarray(points / steps[:, :, None] ** order)
    q = path.q if space is None else space.coordinates(path.q)
    return np.asarray(points + q[:-1, None])


def _exceeds(points: Array, most: float) -> bool:
    """Whether any of M polynomials with control points (M, d + 1) is over a value."""
    left, right = _halves(points.shape[1] - 1)
    for _ in range(MOST_HALVINGS):
        points = points[~(points.max(axis=1) <= most)]  # true where one is no number
        if len(points) == 0:
            return False
        if not (points[:, [0, -1]] <= most).all():
            return True
        points = np.concatenate([points @ left.T, points @ right.T])
    return True


@cache
def _halves(degree: int) -> tuple[Array, Array]:
    """The control points of the left and right halves over those of the whole, (d + 1, d + 1)."""
    left = np.array([[comb(i, j) / 2.0**i for j in range(degree + 1)] for i in range(degree + 1)])
    return left, left[::-1, ::-1].copy()
