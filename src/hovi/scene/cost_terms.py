"""Terms of the cost besides the weighted squares of the torques, from CasADi expressions."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.dynamics.point_function import PointFunction
from hovi.dynamics.torque_model import times
from hovi.robot.space import tangent
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.tangent import Symbols

Array = npt.NDArray[np.float64]


class CostDerivatives(NamedTuple):
    """C(x, tau) and its partial derivatives at P points, for the m columns of x that C names.

    value: shape (P,). jet: C_x, (P, m). torque: C_tau, (P, nv). torque_torque: (P, nv, nv).
    torque_jet: (P, nv, m). jet_jet: (P, m, m).
    """

    value: Array
    jet: Array
    torque: Array
    torque_torque: Array
    torque_jet: Array
    jet_jet: Array


class RunningCostTerm:
    """C(q, v, a, tau, t), composed with tau(q, v, a, t) by the chain rule.

    With x = (q, v, a) and J = d tau/dx, the gradient is C_x + J^T C_tau and the Hessian
    C_xx + S + S^T + sum_i C_tau_i d2 tau_i, S = J^T (1/2 C_tautau J + C_taux); the torque model
    evaluates the sum.

    symbols: (q, v, a, t). tau: another symbol, shape (nv,). expression: C, a scalar of them.
    space: the configuration space; None if it is a vector space.
    """

    def __init__(
        self,
        symbols: Symbols,
        tau: ca.SX,
        expression: ca.SX,
        space: ConfigurationSpace | None = None,
    ) -> None:
        q, v, a, t = symbols
        n = int(tau.shape[0])
        named = [i for i, x in enumerate((q, v, a)) if ca.depends_on(expression, x)]
        first, last = (named[0], named[-1] + 1) if named else (0, 0)
        self.columns = slice(first * n, last * n)
        """From the first to the last of q, v and a that C names, in x."""
        self.names_torques = bool(ca.depends_on(expression, tau))
        nothing, arguments = ca.SX(0, 1), [q, v, a, tau, t]
        hessian, gradient = tangent.hessian(
            expression, (q, ca.vertcat(v, a, tau), nothing, nothing), space
        )
        x, u = self.columns, slice(3 * n, 4 * n)
        parts = [gradient[x], gradient[u], hessian[u, u], hessian[u, x], hessian[x, x]]
        self._value = PointFunction(ca.Function("C", arguments, [expression]))
        expand = ca.Function("C_expand", arguments, [expression, *parts])
        self._expand = PointFunction(expand)

    def value(self, *jet: Array, tau: Array, t: Array | None = None) -> Array:
        """C at P points, shape (P,)."""
        return self._value(*jet, tau, times(t, len(tau)))[0]

    def derivatives(self, *jet: Array, tau: Array, t: Array | None = None) -> CostDerivatives:
        """C at P points with its partial derivatives."""
        points, n = tau.shape
        m = self.columns.stop - self.columns.start
        shapes = (points,), (points, m), (points, n), (points, n, n), (points, n, m), (points, m, m)
        found = self._expand(*jet, tau, times(t, points))
        parts = (each.reshape(shape) for each, shape in zip(found, shapes, strict=True))
        return CostDerivatives(*parts)

    def gradient(self, at: CostDerivatives, J: Array) -> Array:
        """C_x + J^T C_tau, shape (P, 3 nv). J: d tau/dx, shape (P, nv, 3 nv)."""
        gradient: Array = np.matmul(at.torque[:, None], J)[:, 0]
        gradient[:, self.columns] += at.jet
        return gradient

    def hessian(self, at: CostDerivatives, J: Array) -> Array:
        """The Hessian without the second derivatives of tau, shape (P, 3 nv, 3 nv)."""
        half = np.matmul(0.5 * at.torque_torque, J)
        half[:, :, self.columns] += at.torque_jet
        S = np.matmul(J.transpose(0, 2, 1), half)
        hessian: Array = S + S.transpose(0, 2, 1)
        hessian[:, self.columns, self.columns] += at.jet_jet
        return hessian

    def curvature(
        self, *jet: Array, tau: Array, t: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """C_tautau, C_taua and C_aa, each of shape (P, nv, nv)."""
        at = self.derivatives(*jet, tau=tau, t=t)
        n = tau.shape[1]
        torque_jet = np.zeros((len(tau), n, 3 * n))
        torque_jet[:, :, self.columns] = at.torque_jet
        jet_jet = np.zeros((len(tau), 3 * n, 3 * n))
        jet_jet[:, self.columns, self.columns] = at.jet_jet
        return at.torque_torque, torque_jet[:, :, 2 * n :], jet_jet[:, 2 * n :, 2 * n :]


class PotentialTerm:
    """A term V(q, v, a, t) of the cost from a CasADi expression.

    space: the configuration space; None if it is a vector space.
    """

    def __init__(
        self,
        symbols: Symbols,
        expression: ca.SX,
        space: ConfigurationSpace | None = None,
    ) -> None:
        q, v, a, t = symbols
        hessian, gradient = tangent.hessian(expression, symbols, space)
        expand = ca.Function("V_expand", [q, v, a, t], [expression, gradient, hessian])
        self._value = PointFunction(ca.Function("V", [q, v, a, t], [expression]))
        self._expand = PointFunction(expand)

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """V at P points, shape (P,)."""
        return self._value(*jet, times(t, len(jet[0])))[0]

    def expand(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """V (P,), its gradient (P, 3 nv) and its Hessian (P, 3 nv, 3 nv)."""
        value, gradient, hessian = self._expand(*jet, times(t, len(jet[0])))
        return value, gradient, hessian
