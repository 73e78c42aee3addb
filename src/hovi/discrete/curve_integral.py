"""The integral of a Lagrangian along a motion's own curve, by a rule that no scheme uses."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.scene.lagrangian import Lagrangian
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

MORE_POINTS = 5
"""Gauss points of the first rule beyond those of the scheme with the most, so that it sees what
hides between them."""
STEP = 4
"""Gauss points of the second rule beyond those of the first."""


@dataclass(frozen=True)
class CurveIntegral:
    """An integral along a curve.

    value: by the rule with more points. error: its distance from that by the rule with fewer
    points, plus rounding; it bounds the error where the integrand is resolved.
    """

    value: float
    error: float

    @property
    def upper_bound(self) -> float:
        """value + error."""
        return self.value + self.error


def integral_along(lagrangian: Lagrangian, trajectory: Trajectory) -> CurveIntegral:
    """The integral of L(q, v, a, t) dt along the interpolant, by two Gauss rules per interval.

    They have Q + 5 and Q + 9 points, with Q the largest number of points of a scheme on the grid.
    lagrangian: L on T^(k)Q, that of the grid.
    """
    grid = trajectory.grid
    x, weights = _rules(max(len(scheme.points) for scheme, _ in grid.groups) + MORE_POINTS)
    k, s = np.repeat(np.arange(grid.intervals), len(x)), np.tile(x, grid.intervals)
    jet = trajectory.jet_intervals(k, s, lagrangian.order)
    values = lagrangian.value(*jet, t=trajectory.t[k] + s * grid.steps[k])
    fewer, value = grid.steps @ (values.reshape(grid.intervals, -1) @ weights.T)
    return CurveIntegral(float(value), float(abs(value - fewer) + 1e-14 * abs(value)))


@cache
def _rules(fewer: int) -> tuple[Array, Array]:
    """Points of both rules in [0, 1], and the weights of each, (2, points)."""
    rules = [np.polynomial.legendre.leggauss(points) for points in (fewer, fewer + STEP)]
    x = np.concatenate([(x + 1) / 2 for x, _ in rules])
    weights = np.zeros((2, len(x)))
    weights[0, :fewer], weights[1, fewer:] = rules[0][1] / 2, rules[1][1] / 2
    return x, weights
