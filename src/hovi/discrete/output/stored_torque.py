"""Stored torques: Chebyshev interpolants, one per interval.

A robot given as a Pinocchio model cannot be stored, so a trajectory file stores its torques. Within
an interval tau(s) is smooth, and its interpolant at Chebyshev points converges geometrically; the
ends are among the points, so jumps at nodes are reproduced.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.errors import InputError
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

_COUNTS = (9, 17, 33, 65)
_TOLERANCE = 1e-12


@check_arguments
@dataclass(frozen=True, eq=False)
class StoredTorque:
    """Torques at the C Chebyshev points of each of N intervals.

    values: joint effort, shape (N, C, nv), C >= 2, in [N m] or [N]; (N, C, 0) for a motion without
        torques, of a Lagrangian that has none.
    """

    values: Array

    def __post_init__(self) -> None:
        """Raise InputError for values that cannot be interpolated."""
        if self.values.ndim != 3 or self.values.shape[1] < 2:
            raise InputError(
                f"stored torques need the shape (intervals, 2 or more points, nv), "
                f"not {self.values.shape}."
            )

    @classmethod
    def none(cls, intervals: int) -> StoredTorque:
        """No torques, on N intervals."""
        return cls(np.zeros((intervals, 2, 0)))

    @classmethod
    def fit(cls, torque: Callable[[Index, Array], Array], intervals: int) -> StoredTorque:
        """Sample torque(k, s) until the interpolant between the samples agrees with it.

        torque: interval numbers k (M,) and positions s (M,) in [0, 1] -> tau (M, nv).
        intervals: N.
        """
        for count in _COUNTS:
            fitted = cls(_sample(torque, intervals, chebyshev_points(count)))
            between = 0.5 * (chebyshev_points(count)[1:] + chebyshev_points(count)[:-1])
            expected = _sample(torque, intervals, between)
            got = _sample(fitted, intervals, between)
            if np.abs(got - expected).max() <= _TOLERANCE * max(np.abs(expected).max(), 1e-300):
                break
        return fitted

    def __call__(self, k: Index, s: Array) -> Array:
        """tau (M, nv) at the positions s (M,) in [0, 1] of the intervals k (M,).

        Barycentric formula of the second kind [BerrutTrefethen2004, eq. (4.2)].
        """
        points = chebyshev_points(self.values.shape[1])
        weights = (-1.0) ** np.arange(points.size)
        weights[[0, -1]] *= 0.5
        offset = s[:, None] - points  # (M, C)
        hit = offset == 0.0
        kernel = weights / np.where(hit, 1.0, offset)
        kernel = np.where(hit.any(axis=1, keepdims=True), hit, kernel)
        kernel /= kernel.sum(axis=1, keepdims=True)
        tau: Array = np.einsum("mc,mcn->mn", kernel, self.values[k])
        return tau


def chebyshev_points(count: int) -> Array:
    """Chebyshev points of the second kind on [0, 1], ascending, with exact ends, shape (count,)."""
    points: Array = np.sin(0.5 * np.pi * np.arange(count) / (count - 1)) ** 2
    points[-1] = 1.0
    return points


def _sample(torque: Callable[[Index, Array], Array], intervals: int, s: Array) -> Array:
    k = np.repeat(np.arange(intervals), s.size)
    return torque(k, np.tile(s, intervals)).reshape(intervals, s.size, -1)
