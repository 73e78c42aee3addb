"""Pontryagin's equations of any arm under least effort, solved by SciPy: an oracle.

H = p.v + p~.a - 1/2 |tau|^2, with a from p~ = M tau; p' = dL/dq and p~' = dL/dv - p. Torques and
their derivatives are CasADi's of Pinocchio's RNEA; hovi's schemes and kernel have no part in it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.integrate import solve_bvp

from hovi.dynamics.symbolic_dynamics import casadi_functions

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Extremal:
    """q at times (M,), and 1/2 integral |tau|^2."""

    q: Callable[[Array], Array]
    cost: float


class Equations:
    """Rates of y = (q, v, p, p~, J) at M points, y of shape (4 n + 1, M)."""

    def __init__(self, model: pin.Model) -> None:
        n = self.n = model.nv
        q, v, a = (ca.SX.sym(name, n) for name in "qva")
        rnea = casadi_functions(model).inverse_dynamics
        tau = rnea(q, v, a)
        gradients = [ca.gradient(ca.sumsqr(tau) / 2, x) for x in (q, v)]
        drift = rnea(q, v, ca.SX.zeros(n))
        self._mass = ca.Function("M", [q, v], [ca.densify(ca.jacobian(tau, a)), drift])
        self._gradients = ca.Function("dL", [q, v, a], gradients)

    def rates(self, y: Array) -> Array:
        """dy/dt."""
        n, points = self.n, y.shape[1]
        q, v, p, pt = (y[i * n : (i + 1) * n] for i in range(4))
        M, drift = (x.full() for x in self._mass.map(points)(q, v))
        M = M.T.reshape(points, n, n)  # symmetric
        u = np.linalg.solve(M, pt.T[:, :, None])
        a = np.linalg.solve(M, u - drift.T[:, :, None])[:, :, 0].T
        dq, dv = (x.full() for x in self._gradients.map(points)(q, v, a))
        return np.concatenate([v, a, dq, dv - p, (u[:, :, 0] ** 2).sum(axis=1)[None] / 2])


def extremal(
    model: pin.Model,
    ends: tuple[Array, Array, Array, Array],
    t: Array,
    guess: Array,
    tolerance: float,
) -> Extremal:
    """The extremal near a guess between (q0, v0) and (q1, v1).

    t: times (M,). guess: (q, v, p, p~) as rows, shape (4 n, M).
    """
    equations, n = Equations(model), model.nv
    q0, v0, q1, v1 = ends
    cost = np.zeros((1, len(t)))
    y = np.concatenate([guess, cost])
    size = np.maximum(np.abs(y).max(axis=1), 1.0)[:, None]
    size[-1] = 100.0

    def rates(_: Array, scaled: Array) -> Array:
        return equations.rates(scaled * size) / size

    def boundary(first: Array, last: Array) -> Array:
        start, end = first * size[:, 0], last * size[:, 0]
        rows = [start[:n] - q0, start[n : 2 * n] - v0, start[-1:]]
        return np.concatenate([*rows, end[:n] - q1, end[n : 2 * n] - v1])

    found = solve_bvp(rates, boundary, t, y / size, tol=tolerance, max_nodes=20_000)
    assert found.success, found.message
    return Extremal(
        lambda times: (found.sol(times) * size)[:n].T, float(found.y[-1, -1] * size[-1, 0])
    )
