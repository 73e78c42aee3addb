"""Joint torques tau(q, v, a, t) at batches of points, with their exact derivatives."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Protocol

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi._native import dynamics as native
from hovi.dynamics.inverse_dynamics_kernel import InverseDynamicsKernel
from hovi.dynamics.mimic_kernel import MimicKernel
from hovi.dynamics.point_function import PointFunction, default_threads
from hovi.robot.space import tangent
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.tangent import Symbols

Array = npt.NDArray[np.float64]


class TorqueModel(Protocol):
    """tau(q, v, a, t) with its derivatives in the tangent space, as C-contiguous arrays."""

    def torque(self, q: Array, v: Array, a: Array, t: Array | None = None) -> Array:
        """tau, shape (P, nv), in [N m] or [N]."""

    def linearize(
        self, q: Array, v: Array, a: Array, t: Array | None = None
    ) -> tuple[Array, Array]:
        """tau (P, nv) and J = d tau / d(q, v, a), shape (P, nv, 3 nv)."""

    def expand(
        self,
        q: Array,
        v: Array,
        a: Array,
        t: Array | None,
        R: Array,
        curvature: Array | None,
    ) -> tuple[Array, Array, Array]:
        """tau, J and J^T diag(R) J + sum_i curvature_i d2 tau_i, shape (P, 3 nv, 3 nv).

        R: weight of each joint, shape (nv,) or (P, nv). curvature: shape (P, nv); R * tau when
            None.
        """


class CasadiTorque:
    """A torque model from CasADi expressions: the reference, and the fallback of faster models.

    space: the configuration space; None if it is a vector space.
    """

    def __init__(
        self,
        symbols: Symbols,
        tau: ca.SX,
        space: ConfigurationSpace | None = None,
    ) -> None:
        self.nv = int(tau.shape[0])
        self._symbols, self._tau = symbols, tau
        self._space = space
        self._torque = PointFunction(ca.Function("tau", list(symbols), [tau]))

    @cached_property
    def _linearize(self) -> PointFunction:
        J = tangent.jacobian(self._tau, self._symbols, self._space)
        function = ca.Function("tau_J", list(self._symbols), [self._tau, J])
        return PointFunction(function)

    @cached_property
    def _curvature(self) -> PointFunction | None:
        """The weighted second derivatives; None if tau is affine."""
        weight = ca.SX.sym("weight", self.nv)
        weighted = ca.dot(weight, self._tau)
        curvature = tangent.hessian(weighted, self._symbols, self._space)[0]
        if curvature.nnz() == 0:
            return None
        function = ca.Function("ddtau", [*self._symbols, weight], [curvature])
        return PointFunction(function)

    def __getstate__(self) -> dict[str, Any]:
        """The functions without the symbols, which cannot be pickled."""
        functions = ("_torque", "_linearize", "_curvature")
        return {"nv": self.nv, **{name: getattr(self, name) for name in functions}}

    def torque(self, q: Array, v: Array, a: Array, t: Array | None = None) -> Array:
        """tau, shape (P, nv)."""
        return self._torque(q, v, a, times(t, len(q)))[0].reshape(len(q), self.nv)

    def linearize(
        self, q: Array, v: Array, a: Array, t: Array | None = None
    ) -> tuple[Array, Array]:
        """tau and its Jacobian."""
        tau, J = self._linearize(q, v, a, times(t, len(q)))
        return tau.reshape(len(q), self.nv), J.reshape(len(q), self.nv, 3 * self.nv)

    def curvature(self, q: Array, v: Array, a: Array, t: Array | None, weight: Array) -> Array:
        """sum_i weight_i d2 tau_i, shape (P, 3 nv, 3 nv)."""
        if self._curvature is None:
            return np.zeros((len(q), 3 * self.nv, 3 * self.nv))
        return self._curvature(q, v, a, times(t, len(q)), weight)[0]

    @property
    def has_curvature(self) -> bool:
        """Whether tau has nonzero second derivatives."""
        return self._curvature is not None

    def expand(
        self,
        q: Array,
        v: Array,
        a: Array,
        t: Array | None,
        R: Array,
        curvature: Array | None,
    ) -> tuple[Array, Array, Array]:
        """tau, J and the Hessian of TorqueModel.expand."""
        tau, J = self.linearize(q, v, a, t)
        weight = R * tau if curvature is None else curvature
        hessian = np.matmul(J.transpose(0, 2, 1), R[..., None] * J)
        hessian += self.curvature(q, v, a, t, weight)
        return tau, J, hessian


class AnalyticTorque:
    """RNEA with analytic derivatives in C++.

    kernel: RNEA of the scene's model.
    """

    def __init__(self, kernel: InverseDynamicsKernel | MimicKernel) -> None:
        self.kernel = kernel
        self._threads = default_threads()

    def torque(self, q: Array, v: Array, a: Array, t: Array | None = None) -> Array:
        """tau, shape (P, nv)."""
        return self.kernel.torque(q, v, a)

    def linearize(
        self, q: Array, v: Array, a: Array, t: Array | None = None
    ) -> tuple[Array, Array]:
        """tau and its Jacobian."""
        return self.kernel.linearize(q, v, a)

    def expand(
        self,
        q: Array,
        v: Array,
        a: Array,
        t: Array | None,
        R: Array,
        curvature: Array | None,
    ) -> tuple[Array, Array, Array]:
        """tau, J and the Hessian of TorqueModel.expand."""
        if curvature is None:
            curvature = R * self.kernel.torque(q, v, a)
        return self.kernel.expand(q, v, a, R, curvature, self._threads)


class SummedTorque:
    """The sum of a main torque model and the CasADi torques that effects add."""

    def __init__(self, main: TorqueModel, added: CasadiTorque) -> None:
        self.main = main
        self.added = added

    def torque(self, q: Array, v: Array, a: Array, t: Array | None = None) -> Array:
        """tau, shape (P, nv)."""
        return self.main.torque(q, v, a, t) + self.added.torque(q, v, a, t)

    def linearize(
        self, q: Array, v: Array, a: Array, t: Array | None = None
    ) -> tuple[Array, Array]:
        """tau and its Jacobian."""
        tau, J = self.main.linearize(q, v, a, t)
        more, dmore = self.added.linearize(q, v, a, t)
        return tau + more, J + dmore

    def expand(
        self,
        q: Array,
        v: Array,
        a: Array,
        t: Array | None,
        R: Array,
        curvature: Array | None,
    ) -> tuple[Array, Array, Array]:
        """tau, J and the Hessian of TorqueModel.expand.

        (J + J')^T R (J + J') = J^T R J + X + X^T with X = (J + J'/2)^T R J'.
        """
        more, dmore = self.added.linearize(q, v, a, t)
        if curvature is None:
            curvature = R * (self.main.torque(q, v, a, t) + more)
        tau, J, hessian = self.main.expand(q, v, a, t, R, curvature)
        cross = np.matmul((J + 0.5 * dmore).transpose(0, 2, 1), R[..., None] * dmore)
        hessian += cross
        hessian += cross.transpose(0, 2, 1)
        if self.added.has_curvature:
            hessian += self.added.curvature(q, v, a, t, curvature)
        return tau + more, J + dmore, hessian


def compiled_rnea(model: TorqueModel) -> native.InverseDynamicsKernel | None:
    """The compiled RNEA that all torques of a model come from; None where there is more to them."""
    kernel = model.kernel if isinstance(model, AnalyticTorque) else None
    return kernel.compiled if isinstance(kernel, InverseDynamicsKernel) else None


def times(t: Array | None, points: int) -> Array:
    """Times as a column, shape (P, 1); zeros if t is None."""
    return np.zeros((points, 1)) if t is None else np.asarray(t, dtype=np.float64).reshape(-1, 1)
