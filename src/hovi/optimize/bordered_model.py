"""A quadratic model with a few more unknowns t, which every interval may depend on.

With the model of the other unknowns x, the Hessian is [H B; B^T C] and the metric [D 0; 0 d I]. The
border costs one more solve with the factor of H + shift D for each of its unknowns: with
y = -(H + shift D)^-1 g and Z = (H + shift D)^-1 B, the step is t = -P^-1 (g_t + B^T y) with the
pivot P = C + shift d I - B^T Z, and x = y - Z t. The matrix is positive definite if H + shift D and
P are.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hovi.optimize.banded_model import BandModel
from hovi.optimize.equation_model import EquationModel
from hovi.optimize.quadratic_model import Factor, QuadraticModel
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

LEAST_SQUARES_TOLERANCE, MAX_LEAST_SQUARES_STEPS = 1e-14, 100
"""Relative tolerance and maximum number of steps of the bounded least squares problem of t."""


@dataclass(frozen=True, eq=False)
class Border:
    """The part of a quadratic model that belongs to its last unknowns t.

    slope: g_t, shape (p,). columns: B, (size, p). corner: C, (p, p). metric: d.
    room: the least and the largest step of t, (p,) each, of opposite signs or 0; infinite without
        bounds.
    """

    slope: Array
    columns: Array
    corner: Array
    metric: float
    room: tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class BorderedFactor:
    """A factorisation of the bordered H + shift D.

    inner: of H + shift D. columns: B. solved: Z = (H + shift D)^-1 B, (size, p). pivot: P, (p, p).
    free: which t are unknowns, (p,). The others stay at bounds beyond which the cost falls where
    t = 0, which is looked at where P is not positive definite.
    """

    inner: Factor
    columns: Array
    solved: Array
    pivot: Array
    free: Mask

    def solve(self, rhs: Array) -> Array:
        """The solution of the bordered system, 0 where t is kept."""
        size, t = len(self.columns), np.zeros(len(self.free))
        x, free = self.inner.solve(rhs[:size]), self.free
        rest = rhs[size:] - self.columns.T @ x
        t[free] = np.linalg.solve(self.pivot[np.ix_(free, free)], rest[free])
        return np.concatenate([x - self.solved @ t, t])


class BorderedModel(QuadraticModel):
    """A banded model with a few more unknowns, the last ones, whose steps have bounds.

    Equations of the inner model do not depend on them.
    """

    def __init__(self, inner: BandModel | EquationModel, border: Border) -> None:
        self.inner = inner
        self.border = border
        self.equations, self.intervals = inner.equations, inner.intervals
        self.gradient = np.append(inner.gradient, border.slope)
        self.size = len(inner.gradient)

    def scatter(self, local: Array) -> Array:
        """As that of the other unknowns; 0 in the last ones."""
        return np.append(self.inner.scatter(local), np.zeros_like(self.border.slope))

    def gather(self, s: Array) -> Array:
        """The columns of every interval in the other unknowns."""
        return self.inner.gather(s[: self.size])

    def metric_product(self, s: Array) -> Array:
        """D s."""
        x, t = s[: self.size], s[self.size :]
        return np.append(self.inner.metric_product(x), self.border.metric * t)

    def factor(self, shift: float) -> BorderedFactor | None:
        """The factorisation, or None where the bordered H + shift D is not positive definite."""
        inner = self.inner.factor(shift)
        if inner is None:
            return None
        border, count = self.border, len(self.border.slope)
        solved = np.stack([inner.solve(b) for b in border.columns.T], axis=1)
        pivot = border.corner + shift * border.metric * np.eye(count)
        pivot = pivot - border.columns.T @ solved
        free = np.ones(count, dtype=bool)
        if not _positive(pivot):
            free = self._inside(self._slope_at(self.inner.descend(inner)[0]))
            if free.all() or not _positive(pivot[np.ix_(free, free)]):
                return None
        return BorderedFactor(inner, border.columns, solved, pivot, free)

    def descend(self, factor: Factor, radius: float = math.inf) -> tuple[Array, float, float]:
        """The minimum of the model with shift, t within its room; see QuadraticModel.descend.

        Where bounds of t hold with multipliers m, m.t is added to the slope, so that the decrease
        is -slope/2 + shift/2 times the length squared in any case.
        """
        assert isinstance(factor, BorderedFactor)
        x, slope, _ = self.inner.descend(factor.inner, radius)
        rate, free = self._slope_at(x), factor.free
        t, own = np.zeros(len(free)), np.ix_(free, free)
        low, high = self.border.room
        t[free] = least_within(factor.pivot[own], rate[free], low[free], high[free])
        slope += float(t @ (2.0 * rate + factor.pivot @ t))
        s = np.append(x - factor.solved @ t, t)
        return s, slope, float(s @ self.metric_product(s))

    def _slope_at(self, x: Array) -> Array:
        """The slopes in t where all else is at its minimum x for t = 0: g_t + B^T x."""
        return np.asarray(self.border.slope + self.border.columns.T @ x)

    def _inside(self, slope: Array) -> Mask:
        """Which t are not at a bound beyond which the cost falls by these slopes, (p,)."""
        low, high = self.border.room
        return np.asarray(~(((low == 0) & (slope > 0)) | ((high == 0) & (slope < 0))))

    def reaction(self, gradient: Array, s: Array, factor: Factor) -> tuple[Array, Array]:
        """That of the inner model for the gradient g + B t, with the step t."""
        assert isinstance(factor, BorderedFactor)
        x, t = s[: self.size], s[self.size :]
        return self.inner.reaction(gradient[: self.size] + self.border.columns @ t, x, factor.inner)

    def correction(self, factor: Factor, missed: Array) -> Array:
        """That of the inner model."""
        assert isinstance(factor, BorderedFactor)
        still = np.zeros_like(self.border.slope)
        return np.append(self.inner.correction(factor.inner, missed), still)

    def curvature(self, s: Array) -> float:
        """s.H s, of the bordered H."""
        border, x, t = self.border, s[: self.size], s[self.size :]
        return self.inner.curvature(x) + float(t @ (2 * border.columns.T @ x + border.corner @ t))

    def curvature_scale(self) -> float:
        """That of the other unknowns."""
        return self.inner.curvature_scale()

    def negative_eigenvalues(self) -> int:
        """Number of negative eigenvalues of the bordered Hessian, of t that bounds do not hold."""
        border, free = self.border, self._inside(self.border.slope)
        return self.inner.negative_eigenvalues(
            (border.columns[:, free], border.corner[np.ix_(free, free)])
        )


def least_within(pivot: Array, slope: Array, low: Array, high: Array) -> Array:
    """t of the least slope.t + 1/2 t.pivot t, low <= t <= high, shape (p,) each; low < high.

    pivot: positive definite, (p, p).
    """
    if len(slope) == 1:
        return np.asarray(np.clip(-slope / pivot[0], low, high))
    t = np.asarray(np.linalg.solve(pivot, -slope), dtype=np.float64)
    if ((low <= t) & (t <= high)).all():
        return t
    from scipy.optimize import lsq_linear  # takes a quarter of a second to import

    upper = np.linalg.cholesky(pivot).T
    target = np.linalg.solve(upper.T, -slope)
    found = lsq_linear(
        upper,
        target,
        (low, high),
        method="bvls",
        tol=LEAST_SQUARES_TOLERANCE,
        max_iter=MAX_LEAST_SQUARES_STEPS,
    )
    return np.asarray(np.clip(found.x, low, high))


def _positive(matrix: Array) -> bool:
    """Whether a symmetric matrix is positive definite."""
    if len(matrix) == 1:
        return bool(matrix[0, 0] > 0)
    return bool(np.isfinite(matrix).all() and (np.linalg.eigvalsh(matrix) > 0).all())
