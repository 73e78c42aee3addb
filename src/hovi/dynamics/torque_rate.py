"""The rate of the torques along a motion, d tau / dt, with its derivatives.

With x = (q, v, a), its rate x' = (v, a, j) and J = d tau / dx, d tau / dt = J x'. Derivatives of it
contain derivatives of J, and of the weighted second derivatives S of tau, along x'. These are
differences of the exact J and S along that direction, of the fourth order and accurate to about
1e-12 for J, of the second order and accurate to about 1e-8 for S, which Newton's method needs less
accurately. The rate itself is exact.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from hovi.dynamics.torque_model import TorqueModel
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

FOURTH_ORDER = 1e-3, ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))
"""A central difference: the largest change of q in a step, in [rad] or [m]; steps and weights."""
SECOND_ORDER = 1e-4, ((-1, -1 / 2), (1, 1 / 2))
"""The same with fewer steps."""
Stencil = tuple[float, tuple[tuple[int, float], ...]]


@dataclass(frozen=True, eq=False)
class TorqueRate:
    """d tau / dt at P points, for torques that do not depend on time.

    On vector spaces and commutative groups, where q (+) t v has the velocity v.

    torques: tau(q, v, a). q: at the points, shape (P, nq). v, a, j: shape (P, n) each.
    space: the configuration space; None if it is a vector space.
    """

    torques: TorqueModel
    q: Array
    v: Array
    a: Array
    j: Array
    space: ConfigurationSpace | None = None

    def value(self, jacobian: Array | None = None) -> Array:
        """d tau / dt, shape (P, n), in [N m/s] or [N/s]. jacobian: J, if it is known."""
        J = self.torques.linearize(self.q, self.v, self.a)[1] if jacobian is None else jacobian
        return np.asarray(np.matmul(J, self._direction[:, :, None])[:, :, 0])

    def linearize(self, jacobian: Array) -> tuple[Array, Array]:
        """d tau / dt, (P, n), and its Jacobian in (q, v, a, j), (P, n, 4 n); jacobian: J."""
        n = self.v.shape[1]
        derivative = np.zeros((*self.v.shape, 4 * n))

        def jacobian_at(q: Array, v: Array, a: Array) -> Array:
            return self.torques.linearize(q, v, a)[1]

        derivative[:, :, : 3 * n] = self._along(jacobian_at, FOURTH_ORDER)
        derivative[:, :, n:] += jacobian
        return self.value(jacobian), derivative

    def curvature(self, weight: Array) -> Array:
        """sum_i weight_i d2 (d tau_i / dt), shape (P, 4 n, 4 n); weight: shape (P, n).

        With E y = x' for y = (q, v, a, j) it is S' + S E + (S E)^T.
        """
        n = self.v.shape[1]
        none = np.zeros(n)

        def second(q: Array, v: Array, a: Array) -> Array:
            return self.torques.expand(q, v, a, None, none, weight)[2]

        hessian = np.zeros((len(self.q), 4 * n, 4 * n))
        hessian[:, : 3 * n, : 3 * n] = self._along(second, SECOND_ORDER)
        S = second(self.q, self.v, self.a)
        hessian[:, : 3 * n, n:] += S
        hessian[:, n:, : 3 * n] += S.transpose(0, 2, 1)
        return hessian

    @property
    def _direction(self) -> Array:
        """x' = (v, a, j), shape (P, 3 n)."""
        return np.concatenate([self.v, self.a, self.j], axis=1)

    def _along(self, function: Callable[[Array, Array, Array], Array], stencil: Stencil) -> Array:
        """The derivative of a function of (q, v, a) along x' at every point."""
        largest, terms = stencil
        step = largest / (1.0 + np.abs(self.v).max(axis=1, initial=0.0))[:, None]  # (P, 1)
        total: Array | float = 0.0
        for number, weight in terms:
            e = number * step
            dq = e * self.v
            q = self.q + dq if self.space is None else self.space.integrate(self.q, dq)
            moved = function(q, self.v + e * self.a, self.a + e * self.j)
            moved *= weight / step[:, :, None]
            total += moved
        return np.asarray(total)
