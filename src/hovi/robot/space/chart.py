"""The chart of an interval, q(t) = q0 (+) x(t).

Velocities and accelerations are v = J(x) x' and a = J(x) x'' + J' x' with J the right Jacobian of
exp; at the end node x1 = q1 (-) q0 and x1' = J(x1)^-1 v1. The chart is centered at the interval's
first node, so that L_d is a function on TQ x TQ with the left symmetries of L. For vector
coordinates and continuous joints J is the identity.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.robot.space.compiled_charts import local_rates, rates
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Jet = tuple[Array, Array, Array]


@dataclass(frozen=True)
class Chart:
    """Curves q0 (+) x(t) on a configuration space; rows of arrays are points.

    space: the configuration space.
    """

    space: ConfigurationSpace

    def jet(self, q0: Array, x: Array, dx: Array, ddx: Array) -> Jet:
        """(q, v, a) of q0 (+) x(t): q0 (P, nq), x and its derivatives (P, nv)."""
        return self.jets_from(q0, np.stack([x, dx, ddx]))

    def jets_from(self, q0: Array, x: Array) -> Jet:
        """As `jet` for (x, x', x''), (3, P, nv); each row of q0 (B, nq) belongs to P / B points."""
        v, a = rates(self.space.layout, x)
        of_each = x[0].reshape(len(q0), -1, self.space.nv)
        return self.space.integrate(q0[:, None], of_each).reshape(len(v), -1), v, a

    def rates(self, x: Array, v: Array, a: Array | None = None) -> tuple[Array, Array]:
        """(x', x'') of a curve at x with velocity v and acceleration a (zero if None)."""
        return local_rates(self.space.layout, x, v, np.zeros_like(x) if a is None else a)

    def difference_slopes(self, x: Array) -> Array:
        """d(q1 (-) q0) / dq0 in the tangent space at q0, where x = q1 (-) q0, (P, nv, nv)."""
        P, n = x.shape
        each = np.tile(np.eye(n), (P, 1))
        columns = self.rates(-np.repeat(x, n, axis=0), each)[0]  # of J(-x)^-1
        return -columns.reshape(P, n, n).swapaxes(1, 2)

    def end_slope(self, x: Array) -> Array:
        """d(q1 (-) q0) / dq1 in the tangent space at q1, where x = q1 (-) q0, (nv, nv)."""
        n = len(x)
        return np.asarray(self.rates(np.tile(x, (n, 1)), np.eye(n))[0].T)

    def composed(self, jet: Jet, x: Array, dx: Array, ddx: Array) -> Jet:
        """(q, v, a) of q(t) (+) x(t) for a curve q(t) with the jet (q, v, a)."""
        q, v, a = jet
        velocity, acceleration = rates(self.space.layout, np.stack([x, dx, ddx]), np.stack([v, a]))
        return self.space.integrate(q, x), velocity, acceleration
