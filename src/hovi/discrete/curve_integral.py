"""The integral of a Lagrangian along a motion's own curve, by a rule that no scheme uses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.scene.lagrangian import Lagrangian

Array = npt.NDArray[np.float64]

MORE_POINTS = 5
"""Gauss points that the first rule has more than the scheme with the most points."""
STEP = 4
"""Gauss points that the second rule has more than the first."""


@dataclass(frozen=True)
class CurveIntegral:
    """An integral along a curve.

    value: by the rule with more points. error: its distance from the rule with fewer points, which
    bounds the error of the value where the integrand is resolved, plus rounding.
    """

    value: float
    error: float

    @property
    def upper_bound(self) -> float:
        """value + error."""
        return self.value + self.error


def integral_along(lagrangian: Lagrangian, trajectory: Trajectory) -> CurveIntegral:
    """The integral of L(q, v, a, t) dt along the interpolant, by two Gauss rules per interval.

    Of Q + 5 and Q + 9 points, Q the largest number of points of the trajectory's schemes.
    lagrangian: L on T^(2)Q.
    """
    grid = trajectory.grid
    most = max(len(scheme.points) for scheme, _ in grid.groups)
    fewer = _gauss(lagrangian, trajectory, most + MORE_POINTS)
    value = _gauss(lagrangian, trajectory, most + MORE_POINTS + STEP)
    rounding = 1e-14 * abs(value)
    return CurveIntegral(value, abs(value - fewer) + rounding)


def _gauss(lagrangian: Lagrangian, trajectory: Trajectory, points: int) -> float:
    grid = trajectory.grid
    x, w = np.polynomial.legendre.leggauss(points)
    k = np.repeat(np.arange(grid.intervals), points)
    s = np.tile((x + 1) / 2, grid.intervals)
    q, v, a = trajectory.jet_intervals(k, s)
    values = lagrangian.value(q, v, a, t=trajectory.t[k] + s * grid.steps[k])
    return float(grid.steps @ (values.reshape(grid.intervals, -1) @ (w / 2)))
