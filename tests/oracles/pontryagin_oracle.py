"""Pontryagin's equations of any arm under least effort, solved by SciPy: an oracle.

H = p.v + p~.a - 1/2 |u|^2. With w = M^-1 p~ the torques u are w at the joints with motors, and zero
at the others; p' = d(w.tau)/dq and p~' = d(w.tau)/dv - p at constant w. Torques and their
derivatives are CasADi's of Pinocchio's RNEA; hovi's schemes and kernel have no part in it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
    """q and the torques at times (M,), and 1/2 integral |tau|^2."""

    q: Callable[[Array], Array]
    tau: Callable[[Array], Array]
    cost: float


class Equations:
    """Rates of y = (q, v, p, p~, J) at M points, y of shape (4 n + 1, M)."""

    def __init__(self, model: pin.Model, passive: Sequence[int]) -> None:
        n = self.n = model.nv
        self.motors = np.isin(np.arange(n), passive, invert=True)
        q, v, a, w = (ca.SX.sym(name, n) for name in "qvaw")
        rnea = casadi_functions(model).inverse_dynamics
        tau = rnea(q, v, a)
        gradients = [ca.gradient(ca.dot(w, tau), x) for x in (q, v)]
        drift = rnea(q, v, ca.SX.zeros(n))
        self._mass = ca.Function("M", [q, v], [ca.densify(ca.jacobian(tau, a)), drift])
        self._gradients = ca.Function("dL", [q, v, a, w], gradients)

    def _dynamics(self, y: Array) -> tuple[Array, Array, Array]:
        """w, the torques and a, (n, M)."""
        n, points = self.n, y.shape[1]
        q, v, _, pt = (y[i * n : (i + 1) * n] for i in range(4))
        M, drift = (x.full() for x in self._mass.map(points)(q, v))
        M = M.T.reshape(points, n, n)  # symmetric
        w = np.linalg.solve(M, pt.T[:, :, None])
        u = w * self.motors[:, None]
        a = np.linalg.solve(M, u - drift.T[:, :, None])
        return w[:, :, 0].T, u[:, :, 0].T, a[:, :, 0].T

    def torques(self, y: Array) -> Array:
        """u, (n, M)."""
        return self._dynamics(y)[1]

    def rates(self, y: Array) -> Array:
        """dy/dt."""
        n, points = self.n, y.shape[1]
        q, v, p = (y[i * n : (i + 1) * n] for i in range(3))
        w, u, a = self._dynamics(y)
        dq, dv = (x.full() for x in self._gradients.map(points)(q, v, a, w))
        return np.concatenate([v, a, dq, dv - p, (u**2).sum(axis=0)[None] / 2])


def extremal(
    model: pin.Model,
    ends: tuple[Array, Array, Array, Array],
    t: Array,
    guess: Array,
    tolerance: float,
    passive: Sequence[int] = (),
) -> Extremal:
    """The extremal near a guess between (q0, v0) and (q1, v1).

    t: times (M,). guess: (q, v, p, p~) as rows, shape (4 n, M). passive: joints without motors.
    """
    equations, n = Equations(model, passive), model.nv
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
        lambda times: (found.sol(times) * size)[:n].T,
        lambda times: equations.torques(found.sol(times) * size).T,
        float(found.y[-1, -1] * size[-1, 0]),
    )
