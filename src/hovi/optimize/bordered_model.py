"""A quadratic model with one more unknown t, which every interval may depend on.

With the model of the other unknowns x, the Hessian is [H b; b^T c] and the metric [D 0; 0 d]. The
border costs one more solve with the factor of H + shift D: with y = -(H + shift D)^-1 g and
z = (H + shift D)^-1 b, the step is t = -(g_t + b.y) / p with the pivot p = c + shift d - b.z, and
x = y - z t. The matrix is positive definite if H + shift D is and p > 0.

Or with a few equations A s = -c, whose multipliers z are the border: of the Newton step, with
K = H, U = K^-1 A^T and S = A U, they are z = S^-1 (c - U^T g), and s = -K^-1 g - U z.
[NocedalWright2006, section 16.2]
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.optimize.banded_model import BandModel
from hovi.optimize.quadratic_model import Factor, QuadraticModel
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

LEAST_STIFFNESS = 1e-2
"""Eigenvalue of S times the penalty below which a combination of equations is left to the penalty.
It is nearly one where nothing holds the combination back. Where bounds do, steps that satisfy it
would be cut to nothing, and its multiplier would grow without end."""


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
    """A banded model with one more unknown, the last one, whose steps have bounds."""

    def __init__(self, inner: BandModel, border: Border) -> None:
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
        # the slope of the cost in t, all else at its minimum for every t
        slope = border.slope - float(solved @ self.inner.gradient)
        low, high = border.room
        kept = (low == 0 and slope > 0) or (high == 0 and slope < 0)
        return BorderedFactor(inner, border.column, solved, None) if kept else None

    def descend(self, factor: Factor) -> tuple[Array, float, float]:
        """The minimum of the model with shift, t within its room; see QuadraticModel.descend.

        Where a bound of t holds with a multiplier m, m t is added to the slope, so that the
        decrease is -slope/2 + shift/2 times the length squared in any case.
        """
        s = factor.solve(-self.gradient)
        t = float(np.clip(s[-1], *self.border.room))
        multiplier = 0.0
        if t != s[-1] and isinstance(factor, BorderedFactor) and factor.pivot is not None:
            multiplier = factor.pivot * (t - s[-1])
            s[:-1] += (s[-1] - t) * factor.solved
            s[-1] = t
        slope = float(self.gradient @ s) + multiplier * t
        return s, slope, float(s @ self.metric_product(s))

    def curvature_scale(self) -> float:
        """That of the other unknowns."""
        return self.inner.curvature_scale()

    def negative_eigenvalues(self) -> int:
        """Number of negative eigenvalues of the bordered Hessian."""
        return self.inner.negative_eigenvalues((self.border.column, self.border.corner))


@dataclass(frozen=True, eq=False)
class EquationFactor:
    """A factorisation of H for steps that keep equations: A s = 0.

    inner: of H. rows: A, shape (E, size). solved: U^T, shape (E, size). inverse: of S on what the
    penalty in H makes stiff, zero on combinations of equations that say nothing, shape (E, E).
    """

    inner: Factor
    rows: Array
    solved: Array
    inverse: Array

    def solve(self, rhs: Array) -> Array:
        """The solution of the equations with multipliers for rhs, A s = 0."""
        s = self.inner.solve(rhs)
        return s - (self.inverse @ (self.rows @ s)) @ self.solved

    def multipliers(self, gradient: Array, residual: Array) -> Array:
        """z for a gradient and a residual c, shape (E,)."""
        return np.asarray(self.inverse @ (residual - self.solved @ gradient))


class EquationModel(QuadraticModel):
    """A banded model of an augmented Lagrangian, whose Newton steps satisfy linearised equations.

    Steps with a shift are those of the model alone, which its penalty leads to the equations.
    rows: A, shape (E, size). residual: c, shape (E,). penalty: of c^2 / 2 in the model, by which
    the eigenvalues of S are about 1 / penalty.
    """

    def __init__(self, inner: BandModel, rows: Array, residual: Array, penalty: float) -> None:
        self.inner = inner
        self.rows = rows
        self.residual = residual
        self.penalty = penalty
        self.intervals = inner.intervals
        self.gradient = inner.gradient
        self._with_equations: EquationFactor | None = None

    def scatter(self, local: Array) -> Array:
        """As that of the model alone."""
        return self.inner.scatter(local)

    def gather(self, s: Array) -> Array:
        """As that of the model alone."""
        return self.inner.gather(s)

    def metric_product(self, s: Array) -> Array:
        """D s."""
        return self.inner.metric_product(s)

    def factor(self, shift: float) -> Factor | None:
        """That of H + shift D, with equations for a shift of zero, which is cached."""
        if shift == 0.0 and self._with_equations is not None:
            return self._with_equations
        inner = self.inner.factor(shift)
        if inner is None or shift != 0.0:
            return inner
        solved = np.stack([inner.solve(row) for row in self.rows])
        values, vectors = np.linalg.eigh(self.rows @ solved.T)
        stiff = values * self.penalty > LEAST_STIFFNESS
        some = vectors[:, stiff]
        inverse = (some / values[stiff]) @ some.T
        self._with_equations = EquationFactor(inner, self.rows, solved, inverse)
        return self._with_equations

    def descend(self, factor: Factor) -> tuple[Array, float, float]:
        """See QuadraticModel.descend; z c is added to the slope, as for a bound of a border."""
        if not isinstance(factor, EquationFactor):
            return self.inner.descend(factor)
        s = factor.inner.solve(-self.gradient)
        z = factor.multipliers(self.gradient, self.residual)
        s = s - z @ factor.solved
        slope = float(self.gradient @ s) + float(z @ self.residual)
        return s, slope, float(s @ self.metric_product(s))

    def reaction(self, gradient: Array, factor: Factor | None) -> tuple[Array, float] | None:
        """z of a step for a gradient, and z c; None for a step without equations."""
        if not isinstance(factor, EquationFactor):
            return None
        z = factor.multipliers(gradient, self.residual)
        return z, float(z @ self.residual)

    def curvature_scale(self) -> float:
        """That of the model alone."""
        return self.inner.curvature_scale()

    def negative_eigenvalues(self) -> int:
        """Number of negative eigenvalues of H, which are those on the tangent space A s = 0."""
        return self.inner.negative_eigenvalues()
