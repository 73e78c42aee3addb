"""A term of the cost that depends on torque and velocity together, such as mechanical power."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.dynamics.point_function import PointFunction

Array = npt.NDArray[np.float64]


class EffortTerm:
    """phi(tau, v), composed with tau(q, v, a, t) by the chain rule.

    With K = d(tau, v)/d(q, v, a) = (J; E), the gradient is K^T dphi and the Hessian
    K^T d2phi K + sum_i dphi/dtau_i d2 tau_i, whose sum is left to the torque model.

    compile: whether its functions become machine code: see PointFunction.
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
        """dphi/dtau, shape (P, nv): what weighs the second derivatives of tau."""
        return self._expand(tau, v)[1][:, : self._nv]

    def expand(self, tau: Array, v: Array, J: Array) -> tuple[Array, Array, Array]:
        """phi (P,), its gradient (P, 3 nv) and K^T d2phi K (P, 3 nv, 3 nv).

        J: d tau / d(q, v, a), shape (P, nv, 3 nv).
        """
        n = self._nv
        value, slope, bend = self._expand(tau, v)
        K = np.zeros((len(tau), 2 * n, 3 * n))
        K[:, :n] = J
        K[:, n:, n : 2 * n] = np.eye(n)
        gradient = np.matmul(slope[:, None], K)[:, 0]
        return value, gradient, np.matmul(K.transpose(0, 2, 1), np.matmul(bend, K))
