"""Quadratic models of Lagrangians f + y.c, whose steps satisfy linearised equations c.

With the change z of their multipliers,

    [H + shift D, A^T; A, 0] [s; z] = [-g; -c].

Where a shift keeps the step within a radius, what takes c away has at most a part of that radius,
and only a fraction of c is taken away [NocedalWright2006, section 18.5]. The multipliers that go
with such a step are those of a step with A s = 0, for large shifts those of least squares in the
metric: those of the step itself grow with the shift.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hovi.optimize.banded_model import BandModel
from hovi.optimize.kkt_model import KktFactor, KktModel
from hovi.optimize.quadratic_model import Factor, QuadraticModel
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

NORMAL = 0.8
"""Largest length of what takes c away, relative to the radius."""


@dataclass(eq=False)
class EquationFactor:
    """A factorisation for steps that keep equations: A s = 0.

    shift: of D. fraction: of c that the last step of the model takes away. weight: of |c|^2 / 2
        with which a step that takes c away costs what it bends.
    """

    kkt: KktFactor
    shift: float
    fraction: float = 1.0
    weight: float = 0.0

    def solve(self, rhs: Array) -> Array:
        """The step for a force that changes no equation."""
        return self.kkt.solve(rhs, np.zeros(len(self.kkt.layout.multipliers)))[0]


class _WithEquations(QuadraticModel):
    """A banded model with equations.

    kkt: the same with the equations.
    """

    def __init__(self, inner: BandModel, kkt: KktModel) -> None:
        self.inner, self.kkt = inner, kkt
        self.intervals, self.gradient = inner.intervals, inner.gradient

    def scatter(self, local: Array) -> Array:
        """As that of the model alone."""
        return self.inner.scatter(local)

    def gather(self, s: Array) -> Array:
        """As that of the model alone."""
        return self.inner.gather(s)

    def metric_product(self, s: Array) -> Array:
        """D s."""
        return self.inner.metric_product(s)

    def curvature_scale(self) -> float:
        """That of the model alone."""
        return self.inner.curvature_scale()


class EquationModel(_WithEquations):
    """A banded model whose steps satisfy equations. residual: c, shape (E,)."""

    equations = True

    def __init__(self, inner: BandModel, kkt: KktModel, residual: Array) -> None:
        super().__init__(inner, kkt)
        self.residual = residual
        self._newton: EquationFactor | None = None

    def factor(self, shift: float) -> EquationFactor | None:
        """That of H + shift D under the equations, cached for a shift of zero.

        None where it is not positive definite on A s = 0.
        """
        if shift == 0.0 and self._newton is not None:
            return self._newton
        found = self.kkt.factor(shift)
        factor = None if found is None else EquationFactor(found, shift)
        if shift == 0.0:
            self._newton = factor
        return factor

    def descend(self, factor: Factor, radius: float = math.inf) -> tuple[Array, float, float]:
        """See QuadraticModel.descend; -z.A s is added to the slope, for the equations."""
        assert isinstance(factor, EquationFactor)
        g, c = self.gradient, self.residual
        s, z = factor.kkt.solve(-g, -c)
        if factor.shift > 0.0:
            n, y = factor.kkt.solve(np.zeros_like(g), -c)
            length = math.sqrt(max(float(n @ self.metric_product(n)), 0.0))
            factor.fraction = min(1.0, NORMAL * radius / length) if length > 0.0 else 1.0
            s, z = s - (1.0 - factor.fraction) * n, z - (1.0 - factor.fraction) * y
            factor.weight = 2.0 * abs(float(y @ c)) / max(float(c @ c), np.finfo(float).tiny)
        slope = float(g @ s) + factor.fraction * float(z @ c)
        return s, slope, float(s @ self.metric_product(s))

    def residual_weight(self, factor: Factor) -> float:
        """See QuadraticModel.residual_weight.

        n.(H + shift D) n is -y.c where a step n takes c away, and twice this is its weight |c|^2.
        """
        assert isinstance(factor, EquationFactor)
        return factor.weight

    def reaction(self, gradient: Array, s: Array, factor: Factor) -> tuple[Array, Array]:
        """See QuadraticModel.reaction."""
        assert isinstance(factor, EquationFactor)
        c = self.residual if factor.shift == 0.0 else np.zeros_like(self.residual)
        return factor.kkt.solve(-gradient, -c)[1], self.kkt.jacobian_product(s)

    def correction(self, factor: Factor, missed: Array) -> Array:
        """See QuadraticModel.correction."""
        assert isinstance(factor, EquationFactor)
        return factor.kkt.solve(np.zeros_like(self.gradient), -missed)[0]

    def negative_eigenvalues(self, border: tuple[Array, Array] | None = None) -> int:
        """Number of negative eigenvalues of H, or [H B; B^T C], on the tangent space A s = 0."""
        return self.kkt.negative_eigenvalues(border)


class PenaltyModel(_WithEquations):
    """A banded model at the multipliers y = weight c, with weight A^T A added to H.

    It is the exact one of f + weight |c|^2 / 2, as what [H, A^T; A, -1 / weight] leaves of H.
    weight: not zero.
    """

    def __init__(self, inner: BandModel, kkt: KktModel, weight: float) -> None:
        super().__init__(inner, kkt)
        self.weight = weight

    def factor(self, shift: float) -> EquationFactor | None:
        """That of H + weight A^T A + shift D; None where it is not positive definite."""
        found = self.kkt.factor(shift, 1.0 / self.weight)
        return None if found is None else EquationFactor(found, shift)
