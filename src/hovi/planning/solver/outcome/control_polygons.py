"""Whether polynomials stay within their bounds at all times, by their control points.

On an interval a limited coordinate is at most its largest control point. Where that is over the
bound the interval is halved, which brings the control points four times nearer to the curve, until
they are within the bound or the curve itself is over it: the answer needs no samples.
[Farin2002]
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from math import comb
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import Condition, scales
from hovi.conditions.joint_quantity import DERIVATIVES, JointQuantity
from hovi.conditions.places import ControlPoints
from hovi.discrete.interval_paths import scaled_data
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.limit_conditions import LimitRange
from hovi.planning.problem.way_back.excused import Excused
from hovi.schemes.control_points import control_rows

Array = npt.NDArray[np.float64]

MOST_HALVINGS = 40
"""Number of halvings after which a polynomial that still may be over its bound counts as over it:
the control points are nearer to the curve than rounding errors."""


def exceeds(motion: Trajectory, given: Condition[Any, ControlPoints]) -> bool:
    """Whether a limited coordinate is over a bound anywhere by more than the tolerance."""
    return any(_exceeds(each, given.tolerance) for each in _over_bounds(motion, given))


def _over_bounds(motion: Trajectory, given: Condition[Any, ControlPoints]) -> Iterator[Array]:
    """Control points over the upper and below the lower bounds, as fractions, (M, d + 1) each."""
    y, on, scale = given.y, given.on, scales(given)
    assert isinstance(y, JointQuantity)
    assert isinstance(on, LimitRange)
    whole = _control_points(motion, DERIVATIVES[y.quantity], np.zeros(1), np.ones(1))[:, 0]
    points = whole[:, :, y.joints].transpose(0, 2, 1)
    for side, bounds in zip((-1, 1), on.limits.on(motion.t), strict=True):
        over = side * (points - bounds[:, on.row, on.joints, None])
        for each in on.limits.excused:
            if each.side == side and each.limit == y.quantity:
                column = int(np.flatnonzero(y.joints == each.coordinate)[0])
                yield _led_back(motion, each, over[:, column]) / scale[column]
        yield (over / scale[:, None]).reshape(-1, points.shape[2])


def _led_back(motion: Trajectory, excused: Excused, over: Array) -> Array:
    """Control points of what is excused over its wider bound, until it is inside, (M, d + 1).

    over: those over the bound itself on all intervals, (N, d + 1), which these are taken out of.
    """
    grid, degree = motion.grid, over.shape[1] - 1
    last = int(np.searchsorted(grid.t[1:], excused.until))
    whole = over[:last].copy() - excused.control_points(grid.t[:last], grid.steps[:last], degree)
    over[:last] = -np.inf
    if last == grid.intervals:
        return whole
    h = grid.steps[last]
    cut = float(np.clip((excused.until - grid.t[last]) / h, 0.0, 1.0))
    left, width = np.array([0.0, cut]), np.array([cut, 1.0 - cut])
    order = DERIVATIVES[excused.limit]
    parts = _control_points(motion, order, left, width)[last, :, :, excused.coordinate]
    parts = over[last, :1] + excused.side * (parts - parts[0, 0])
    parts[:1] -= excused.control_points(grid.t[last : last + 1], cut * h * np.ones(1), degree)
    over[last] = -np.inf
    return np.concatenate([whole, parts])


def _control_points(motion: Trajectory, order: int, left: Array, width: Array) -> Array:
    """Control points of q^(order) on P parts of all intervals, (N, P, d + 1, nv)."""
    grid, path, space = motion.grid, motion.path, motion.space
    table = control_rows(left, width, grid.order, grid.inner_modes, order)[0]
    numbers, steps = np.arange(grid.intervals), grid.steps[:, None]
    data = scaled_data(path, numbers, steps, grid.inner_modes)
    points = np.matmul(table, data[:, None])
    if order > 0:
        return np.asarray(points / steps[:, :, None, None] ** order)
    q = path.q if space is None else space.coordinates(path.q)
    return np.asarray(points + q[:-1, None, None])


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
