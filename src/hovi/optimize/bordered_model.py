"""A quadratic model with one more unknown t, which every interval may depend on.

With the model of the other unknowns x, the Hessian is [H b; b^T c] and the metric [D 0; 0 d]. The
border costs one more solve with the factor of H + shift D: with y = -(H + shift D)^-1 g and
z = (H + shift D)^-1 b, the step is t = -(g_t + b.y) / p with the pivot p = c + shift d - b.z, and
x = y - z t. The matrix is positive definite if H + shift D is and p > 0.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.optimize.banded_model import BandModel
from hovi.optimize.equation_model import EquationModel
from hovi.optimize.quadratic_model import Factor, QuadraticModel
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Border:
    """The part of a quadratic model that belongs to its last unknown t.

    slope: g_t. column: b, shape (size,). corner: c. metric: d.
    room: the least and the largest step of t, of opposite signs or 0; infinite without bounds.
    """

    slope: float
    column: Array
    corner: float
    metric: float
    room: tuple[float, float]


@dataclass(frozen=True, eq=False)
class BorderedFactor:
    """A factorisation of the bordered H + shift D.

    inner: of H + shift D. solved: z = (H + shift D)^-1 b. pivot: p; None where t is kept at its
    bound, since the cost falls beyond it and p is not positive.
    """

    inner: Factor
    column: Array
    solved: Array
    pivot: float | None

    def solve(self, rhs: Array) -> Array:
        """The solution of the bordered system; (H + shift D)^-1 rhs and 0 where t is kept."""
        x = self.inner.solve(rhs[:-1])
        if self.pivot is None:
            return np.append(x, 0.0)
        t = (rhs[-1] - float(self.column @ x)) / self.pivot
        return np.append(x - t * self.solved, t)


class BorderedModel(QuadraticModel):
    """A banded model with one more unknown, the last one, whose steps have bounds.

    Equations of the inner model do not depend on it.
    """

    def __init__(self, inner: BandModel | EquationModel, border: Border) -> None:
        self.inner = inner
        self.border = border
        self.intervals = inner.intervals
        self.gradient = np.append(inner.gradient, border.slope)

    def scatter(self, local: Array) -> Array:
        """As that of the other unknowns; 0 in the last one."""
        return np.append(self.inner.scatter(local), 0.0)

    def gather(self, s: Array) -> Array:
        """The columns of every interval in the other unknowns."""
        return self.inner.gather(s[:-1])

    def metric_product(self, s: Array) -> Array:
        """D s."""
        return np.append(self.inner.metric_product(s[:-1]), self.border.metric * s[-1])

    def factor(self, shift: float) -> BorderedFactor | None:
        """The factorisation, or None where the bordered H + shift D is not positive definite."""
        inner = self.inner.factor(shift)
        if inner is None:
            return None
        border = self.border
        solved = inner.solve(border.column)
        pivot = border.corner + shift * border.metric - float(border.column @ solved)
        if pivot > 0:
            return BorderedFactor(inner, border.column, solved, pivot)
        slope = self._slope_at(self.inner.descend(inner)[0])
        low, high = border.room
        kept = (low == 0 and slope > 0) or (high == 0 and slope < 0)
        return BorderedFactor(inner, border.column, solved, None) if kept else None

    def descend(self, factor: Factor) -> tuple[Array, float, float]:
        """The minimum of the model with shift, t within its room; see QuadraticModel.descend.

        Where a bound of t holds with a multiplier m, m t is added to the slope, so that the
        decrease is -slope/2 + shift/2 times the length squared in any case.
        """
        assert isinstance(factor, BorderedFactor)
        x, slope, _ = self.inner.descend(factor.inner)
        t = multiplier = 0.0
        rate = self._slope_at(x)
        if factor.pivot is not None:
            free = -rate / factor.pivot
            t = float(np.clip(free, *self.border.room))
            multiplier = factor.pivot * (t - free)
        s = np.append(x - t * factor.solved, t)
        return s, slope + (rate + multiplier) * t, float(s @ self.metric_product(s))

    def _slope_at(self, x: Array) -> float:
        """The slope in t where all else is at its minimum x for t = 0: g_t + b.x."""
        return self.border.slope + float(self.border.column @ x)

    def reaction(
        self, gradient: Array, s: Array, factor: Factor | None
    ) -> tuple[Array, float] | None:
        """That of the inner model for the gradient g + t b, with the step t."""
        if not isinstance(factor, BorderedFactor):
            return None
        return self.inner.reaction(gradient[:-1] + s[-1] * self.border.column, s[:-1], factor.inner)

    def curvature_scale(self) -> float:
        """That of the other unknowns."""
        return self.inner.curvature_scale()

    def negative_eigenvalues(self) -> int:
        """Number of negative eigenvalues of the bordered Hessian."""
        return self.inner.negative_eigenvalues((self.border.column, self.border.corner))
