"""A quadratic model g.s + 1/2 s.H s that is a sum over intervals, with a metric D.

An interval couples only its own columns: its two end nodes and its inner modes. A solver orders
the unknowns such that H + shift D is factored in O(N n^3). How well a model predicted the decrease
of a step decides on the radius and the shift of the next one.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Protocol

import numpy as np
import numpy.typing as npt

from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

ACCEPTED_RATIO = 1e-4
"""Ratio of the actual and the predicted decrease above which a step is accepted."""
PREDICTED_NOISE = 10.0
"""Predicted decrease that is rounding, relative to an actual one that is rounding."""
POOR_RATIO, GOOD_RATIO, BEST_RATIO = 0.25, 0.75, 0.9
"""Ratios of the actual and the predicted decrease: below the first one the radius shrinks, above
the second one it grows, and above the third one it doubles."""
LEAST_SHRINKAGE, SMALL_GROWTH = 0.25, 1.4
"""Least factor by which the radius shrinks, and the factor by which it grows if not twofold."""
AT_RADIUS = 0.7
"""Length of a step, relative to the radius, above which the radius limited the step."""


class Factor(Protocol):
    """A factorisation of H + shift D."""

    def solve(self, rhs: Array) -> Array:
        """(H + shift D)^-1 rhs."""


@dataclass(frozen=True, eq=False)
class IntervalSum:
    """The contribution of every interval to the model.

    gradient: shape (N, m, n). hessian: shape (N, m, m, n, n).
    metric: D of an interval, the same for every component, shape (N, m, m).
    """

    gradient: Array
    hessian: Array
    metric: Array


class QuadraticModel(ABC):
    """The model in the coordinates of a solver; `np.vdot` pairs vectors and covectors.

    equations: whether its steps satisfy equations c = 0 to first order.
    """

    equations: bool = False

    def __init__(self, intervals: IntervalSum) -> None:
        self.intervals = intervals
        self.gradient = self.scatter(intervals.gradient)

    @abstractmethod
    def scatter(self, local: Array) -> Array:
        """The sum over intervals of a covector of shape (N, m, n), in the solver's coordinates."""

    @abstractmethod
    def gather(self, s: Array) -> Array:
        """The columns of every interval in a step s, shape (N, m, n)."""

    @abstractmethod
    def factor(self, shift: float) -> Factor | None:
        """A factorisation of H + shift D, or None where that is not positive definite."""

    def metric_product(self, s: Array) -> Array:
        """D s."""
        return self.scatter(np.matmul(self.intervals.metric, self.gather(s)))

    def descend(self, factor: Factor, radius: float = math.inf) -> tuple[Array, float, float]:
        """s = -(H + shift D)^-1 g, its slope g.s and its length squared s.D s.

        radius: within which a shift is to keep the step.
        """
        s = factor.solve(-self.gradient)
        slope = float(np.vdot(self.gradient, s))
        return s, slope, float(np.vdot(s, self.metric_product(s)))

    def residual_weight(self, factor: Factor) -> float:
        """The weight of |c|^2 / 2 with which the last step is measured; 0 for none."""
        return 0.0

    def reaction(self, gradient: Array, s: Array, factor: Factor) -> tuple[Array, Array]:
        """Change of the multipliers of equations with a step s, and A s.

        gradient: of the step that the multipliers belong to.
        """
        raise NotImplementedError

    def correction(self, factor: Factor, missed: Array) -> Array:
        """A step that takes away what the residual is too large after the last one, (E,).

        It is the second-order correction of that step.
        """
        raise NotImplementedError

    def curvature(self, s: Array) -> float:
        """s.H s."""
        columns = self.gather(s)
        N, size = len(columns), columns[0].size
        hessian = self.intervals.hessian.transpose(0, 1, 3, 2, 4).reshape(N, size, size)
        return float(np.vdot(columns, np.matmul(hessian, columns.reshape(N, size, 1))))

    def curvature_scale(self) -> float:
        """Magnitude of H relative to D, from which a first shift is chosen."""
        largest = float(np.max(np.abs(self.intervals.hessian)))
        return largest / float(np.max(np.abs(self.intervals.metric)))

    def random_vector(self, seed: int) -> Array:
        """A reproducible random step, a start of inverse iterations."""
        return np.random.default_rng(seed).standard_normal(self.gradient.shape)


def decrease_ratio(actual: float, predicted: float, noise: float) -> float:
    """Actual over predicted decrease; 1 where both are rounding noise, -1 where not finite."""
    if not math.isfinite(actual):
        return -1.0
    if abs(actual) <= noise and abs(predicted) <= PREDICTED_NOISE * noise:
        return 1.0
    return actual / predicted if predicted > 0 else -1.0


def next_shift(shift: float, norm: float, radius: float) -> float:
    """Initial shift for a new radius: it decreases slightly faster than the radius grows."""
    return float(shift * (norm / radius) ** 1.2)


def next_radius(radius: float, norm: float, ratio: float) -> float:
    """The radius after a step: larger where the model was good and the radius limited the step.

    Where the model failed: the minimum of a parabola along the step, within bounds.
    norm: length of the step. ratio: actual over predicted decrease.
    """
    if ratio < POOR_RATIO:
        fraction = min(0.5, 0.5 / (1.0 - min(ratio, 0.0)))
        return max(LEAST_SHRINKAGE, fraction) * min(radius, norm)
    if ratio > GOOD_RATIO and norm > AT_RADIUS * radius:
        return (2.0 if ratio > BEST_RATIO else SMALL_GROWTH) * radius
    return radius
