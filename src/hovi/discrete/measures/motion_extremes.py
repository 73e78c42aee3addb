"""The extremes of a motion: its largest acceleration and jerk, and both at its ends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from numpy.polynomial import chebyshev

from hovi.checks.arguments import check_arguments
from hovi.discrete.output.stored_torque import chebyshev_points
from hovi.discrete.trajectory import Trajectory
from hovi.robot.space.coordinates import NO_UNITS
from hovi.robot.space.joint_kinds import Units
from hovi.system.dataclass import dataclass
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

CURVED_DEGREE = 16
"""Smallest degree of the polynomials through accelerations on groups, which are none themselves."""
SAMPLES_PER_DEGREE = 16
"""Chebyshev points per interval and degree in the first pass: what a polynomial of that degree
reaches between m d of them is at most 1 / cos(pi / 2 m) times what it is at one, 0.5 % more."""
REFINED_SAMPLES, REFINEMENTS = 25, 3
"""Samples of each further pass, between the neighbours of the largest sample, and passes."""
CHUNK = 2048
"""Maximum number of intervals that are sampled together, which bounds the memory."""


@dataclass(frozen=True, eq=False)
class Extreme:
    """The largest absolute value of a quantity along a motion, and its values at both ends.

    value: |x| of the joint that has the largest one; numbers in [rad] and in [m] are compared as
        they are. joint, t, unit: where and when that is, t in [s], and the unit of `value`.
    largest: |x| of each coordinate at its own maximum, shape (nv,).
    start, end: x at t = 0, from the right, and at t = T, from the left, shape (nv,).
    names, units: of the coordinates.
    """

    value: float
    joint: str
    t: float
    unit: str
    largest: Array
    start: Array
    end: Array
    names: tuple[str, ...]
    units: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Extremes:
    """The largest acceleration and jerk of a motion.

    acceleration: a, per [s^2]. jerk: da/dt, per [s^3].
    """

    acceleration: Extreme
    jerk: Extreme


@check_arguments
def extremes(trajectory: Trajectory) -> Extremes:
    """The largest |a| and |da/dt| along the interpolant, between the nodes, too.

    The curve of a scheme of order k has k - 1 continuous derivatives. For k = 2, as for the effort,
    the jerk is that of each interval: at a node the larger one of its two limits counts. A jump of
    the acceleration itself, as from rest at both ends, is no jerk; the accelerations at the ends
    show its size. For k = 3 accelerations are continuous and the jerk may jump.
    """
    series, units = _accelerations(trajectory), _units(trajectory)
    return Extremes(
        _extreme(trajectory, series, [each.a for each in units]),
        _extreme(trajectory, _derivative(trajectory, series), [each.jerk for each in units]),
    )


def _accelerations(trajectory: Trajectory) -> Array:
    """Chebyshev coefficients of a(s) in every interval, s in [0, 1], shape (N, d + 1, nv).

    On vector spaces these are the polynomials of the interpolant themselves.
    """
    N, s = trajectory.grid.intervals, chebyshev_points(_degree(trajectory) + 1)
    to_series = np.linalg.inv(chebyshev.chebvander(2 * s - 1, len(s) - 1))
    series = np.empty((N, len(s), trajectory.v.shape[1]))
    for first in range(0, N, CHUNK):
        raise_if_late()
        k = np.arange(first, min(first + CHUNK, N))
        a = trajectory.jet_intervals(np.repeat(k, len(s)), np.tile(s, len(k)))[2]
        series[k] = to_series @ a.reshape(len(k), len(s), -1)
    return series


def _degree(trajectory: Trajectory) -> int:
    """The degree of the polynomials for the acceleration: of q, 2 k - 1 + r, less two."""
    grid, space = trajectory.grid, trajectory.space
    degree = max(1, 2 * grid.order - 3 + grid.inner_modes)
    return degree if space is None or space.flat else max(CURVED_DEGREE, 2 * degree)


def _derivative(trajectory: Trajectory, series: Array) -> Array:
    """The coefficients of the derivative in t, shape (N, d, nv)."""
    scale = 2.0 / trajectory.grid.steps[:, None, None]
    return np.asarray(scale * chebyshev.chebder(series, axis=1))


def _extreme(trajectory: Trajectory, series: Array, units: Sequence[str]) -> Extreme:
    """The extreme of the quantity with these coefficients, shape (N, d + 1, nv)."""
    k, s, largest = _largest(series)
    joint = int(np.argmax(largest))
    t = trajectory.t[k] + s * trajectory.grid.steps[k]
    names = trajectory.coordinate_names
    return Extreme(
        value=float(largest[joint]),
        joint=names[joint],
        t=float(t[joint]),
        unit=units[joint],
        largest=largest,
        start=_values(series[0], np.array([0.0]))[0],
        end=_values(series[-1], np.array([1.0]))[0],
        names=names,
        units=tuple(units),
    )


def _largest(series: Array) -> tuple[Index, Array, Array]:
    """The largest |x| of each coordinate: its interval, its position there, and |x|, (nv,) each."""
    N, size, nv = series.shape
    grid = chebyshev_points(SAMPLES_PER_DEGREE * size + 1)
    k, at, largest = np.zeros(nv, np.intp), np.zeros(nv, np.intp), np.full(nv, -1.0)
    for first in range(0, N, CHUNK):
        raise_if_late()
        values = np.abs(_values(series[first : first + CHUNK], grid)).reshape(-1, nv)
        best = np.argmax(values, axis=0)
        higher = values[best, np.arange(nv)] > largest
        largest = np.where(higher, values[best, np.arange(nv)], largest)
        k = np.where(higher, first + best // len(grid), k)
        at = np.where(higher, best % len(grid), at)
    low, high = grid[np.maximum(at - 1, 0)], grid[np.minimum(at + 1, len(grid) - 1)]
    return k, *_refined(series[k, :, np.arange(nv)], low, high)


def _refined(series: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """The largest |x| of single polynomials within ranges: its position and its value, (M,) each.

    series: coefficients, shape (M, d + 1). low, high: within [0, 1], shape (M,).
    """
    rows = np.arange(len(series))
    for _ in range(REFINEMENTS):
        step = (high - low) / (REFINED_SAMPLES - 1)
        s = np.minimum(low[:, None] + step[:, None] * np.arange(REFINED_SAMPLES), 1.0)
        s[:, -1] = high
        basis = chebyshev.chebvander(2 * s - 1, series.shape[1] - 1)
        values = np.abs(np.vecdot(basis, series[:, None]))
        best = np.argmax(values, axis=1)
        at = s[rows, best]
        low, high = np.maximum(at - step, low), np.minimum(at + step, high)
    return at, values[rows, best]


def _values(series: Array, s: Array) -> Array:
    """The polynomials at s (M,), shape (..., M, nv); series: shape (..., d + 1, nv)."""
    return np.asarray(chebyshev.chebvander(2 * s - 1, series.shape[-2] - 1) @ series)


def _units(trajectory: Trajectory) -> Sequence[Units]:
    robot = trajectory.robot
    return [NO_UNITS] * trajectory.v.shape[1] if robot is None else robot.coordinate_units
