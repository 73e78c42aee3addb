"""Terms of the cost besides the squared torque, from CasADi expressions."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.dynamics.point_function import PointFunction
from hovi.dynamics.torque_model import times
from hovi.robot.space import tangent
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.tangent import Symbols

Array = npt.NDArray[np.float64]


class TorqueVelocityCost:
    """phi(tau, v), composed with tau(q, v, a, t) by the chain rule.

    With K = d(tau, v)/d(q, v, a) = (J; E), the gradient is K^T dphi and the Hessian
    K^T d2phi K + sum_i dphi/dtau_i d2 tau_i; the torque model evaluates the sum.

    compile: whether its functions are compiled: see PointFunction.
    """

    def __init__(self, tau: ca.SX, v: ca.SX, expression: ca.SX, compile: bool = False) -> None:
        self._nv = int(v.shape[0])
        hessian, gradient = ca.hessian(expression, ca.vertcat(tau, v))
        expand = ca.Function("phi_expand", [tau, v], [expression, gradient, hessian])
        self._value = PointFunction(ca.Function("phi", [tau, v], [expression]), compile)
        self._expand = PointFunction(expand, compile)

    def value(self, tau: Array, v: Array) -> Array:
        """phi at P points, shape (P,)."""
        return self._value(tau, v)[0]

    def slope(self, tau: Array, v: Array) -> Array:
        """dphi/dtau, shape (P, nv): weights of the second derivatives of tau."""
        return self._expand(tau, v)[1][:, : self._nv]

    def expand(self, tau: Array, v: Array, J: Array) -> tuple[Array, Array, Array]:
        """phi (P,), its gradient (P, 3 nv) and K^T d2phi K (P, 3 nv, 3 nv).

        J: d tau / d(q, v, a), shape (P, nv, 3 nv).
        """
        n = self._nv
        value, slope, curvature = self._expand(tau, v)
        K = np.zeros((len(tau), 2 * n, 3 * n))
        K[:, :n] = J
        K[:, n:, n : 2 * n] = np.eye(n)
        gradient = np.matmul(slope[:, None], K)[:, 0]
        return value, gradient, np.matmul(K.transpose(0, 2, 1), np.matmul(curvature, K))


class PotentialTerm:
    """A term V(q, v, a, t) of the cost from a CasADi expression.

    compile: whether its functions are compiled: see PointFunction.
    space: the configuration space; None if it is a vector space.
    """

    def __init__(
        self,
        symbols: Symbols,
        expression: ca.SX,
        compile: bool = False,
        space: ConfigurationSpace | None = None,
    ) -> None:
        q, v, a, t = symbols
        hessian, gradient = tangent.hessian(expression, symbols, space)
        expand = ca.Function("V_expand", [q, v, a, t], [expression, gradient, hessian])
        self._value = PointFunction(ca.Function("V", [q, v, a, t], [expression]), compile)
        self._expand = PointFunction(expand, compile)

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """V at P points, shape (P,)."""
        return self._value(*jet, times(t, len(jet[0])))[0]

    def expand(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """V (P,), its gradient (P, 3 nv) and its Hessian (P, 3 nv, 3 nv)."""
        value, gradient, hessian = self._expand(*jet, times(t, len(jet[0])))
        return value, gradient, hessian
