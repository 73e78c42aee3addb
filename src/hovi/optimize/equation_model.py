"""A quadratic model of an augmented Lagrangian, whose Newton steps satisfy linearised equations.

For K, which includes the penalty of the equations c, and with their multipliers' change z,

    [K, A^T; A, -delta I] [s; z] = [-g; -c].

Combinations of equations whose eigenvalue of A K^-1 A^T is far below delta are left to the penalty.
It is nearly 1 / penalty where nothing holds a combination back. Where bounds do, steps that satisfy
it would be cut to nothing, and its multiplier would grow without end.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.optimize.banded_model import BandModel
from hovi.optimize.kkt_model import KktFactor, KktModel
from hovi.optimize.quadratic_model import Factor, QuadraticModel
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

SOFTNESS = 1e-4
"""delta times the penalty."""


@dataclass(frozen=True, eq=False)
class EquationFactor:
    """A factorisation for steps that keep equations: A s = 0."""

    kkt: KktFactor

    def solve(self, rhs: Array) -> Array:
        """The step for a force that changes no equation."""
        return self.kkt.solve(rhs, np.zeros(len(self.kkt.layout.multipliers)))[0]


class EquationModel(QuadraticModel):
    """A banded model whose Newton steps satisfy equations; those with a shift are its own.

    kkt: the same with the equations. residual: c, shape (E,). penalty: of c^2 / 2 in the model.
    stiffness: by how much less delta is, for each equation or all.
    """

    def __init__(
        self,
        inner: BandModel,
        kkt: KktModel,
        residual: Array,
        penalty: float,
        stiffness: Array | float = 1.0,
    ) -> None:
        self.inner, self.kkt, self.residual = inner, kkt, residual
        self.delta = SOFTNESS / penalty / stiffness
        self.intervals, self.gradient = inner.intervals, inner.gradient
        self._newton: EquationFactor | None = None

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
        if shift != 0.0:
            return self.inner.factor(shift)
        if self._newton is None:
            found = self.kkt.factor(0.0, self.delta)
            self._newton = None if found is None else EquationFactor(found)
        return self._newton

    def descend(self, factor: Factor) -> tuple[Array, float, float]:
        """See QuadraticModel.descend; z (c - delta z) is added to the slope, for the equations."""
        if not isinstance(factor, EquationFactor):
            return self.inner.descend(factor)
        s, z = factor.kkt.solve(-self.gradient, -self.residual)
        slope = float(self.gradient @ s) + float(z @ (self.residual - self.delta * z))
        return s, slope, float(s @ self.metric_product(s))

    def reaction(
        self, gradient: Array, s: Array, factor: Factor | None
    ) -> tuple[Array, float] | None:
        """z of a step for a gradient, and z c; None for a step without equations."""
        if not isinstance(factor, EquationFactor):
            return None
        z = factor.kkt.solve(-gradient, -self.residual)[1]
        return z, float(z @ self.residual)

    def curvature_scale(self) -> float:
        """That of the model alone."""
        return self.inner.curvature_scale()

    def negative_eigenvalues(self, border: tuple[Array, Array] | None = None) -> int:
        """Number of negative eigenvalues of H, or [H B; B^T C], on the tangent space A s = 0."""
        return self.kkt.negative_eigenvalues(border)
