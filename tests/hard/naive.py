"""A literal implementation of the paper: its Taylor scheme, full Newton steps, the cubic guess.

It shows what happens on the hard cases without hovi's methods. The Lagrangian comes from
paper_arm.py, derivatives from CasADi, linear algebra from SciPy's sparse LU; only `full_newton`
uses hovi's equations, to take the same steps for any robot.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from hovi.planning.problem.problem import TrajectoryProblem
from oracles.dense_action import DenseAction
from oracles.path_steps import moved
from samples.paper_arm import symbols

Array = npt.NDArray[np.float64]

NODE = 4
"""Numbers at a node: q and v of two joints."""


@dataclass(frozen=True)
class Cost:
    """The integrand 1/2 |u|^2 plus penalties.

    gravity: whether to include gravity.
    elbow: slope of the paper's piecewise linear potential outside 0 to 170 degrees.
    penalty: rho of the penalty rho/2 times the squared excess of |u| over `max_torque`.
    max_torque: in [N m].
    """

    gravity: bool = True
    elbow: float = 0.0
    penalty: float = 0.0
    max_torque: float = 2.0

    def of(self, q: ca.SX, u: ca.SX) -> ca.SX:
        """The integrand."""
        outside = ca.fmax(0, -q[1]) + ca.fmax(0, q[1] - np.radians(170))
        excess = ca.fmax(0, ca.fabs(u) - self.max_torque)
        return ca.sumsqr(u) / 2 + self.elbow * outside + self.penalty / 2 * ca.sumsqr(excess)


@cache
def _torque() -> ca.Function:
    s = symbols()
    return ca.Function("u", [s.q, s.v, s.a], [s.u])


def torque(q: Array, v: Array, a: Array) -> Array:
    """u at one point, shape (2,), in [N m]."""
    return np.array(_torque()(q, v, a)).ravel()


@cache
def discrete_lagrangian(cost: Cost) -> ca.Function:
    """(x0, x1, h) -> L_d and its gradient and Hessian, x = (q, v).

    L_d = h/2 (L(qm, vm, a0) + L(qm, vm, a1)), a0 = 2/h^2 (q1 - q0 - h v0) and
    a1 = 2/h^2 (q0 - q1 + h v1). [ColomboFerraroMartin2016, section 5]
    """
    s = symbols()
    at_rest = ca.substitute(s.u, ca.vertcat(s.v, s.a), ca.SX.zeros(4))
    u = s.u if cost.gravity else s.u - at_rest
    L = ca.Function("L", [s.q, s.v, s.a], [cost.of(s.q, u)])
    x, h = ca.SX.sym("x", 2 * NODE), ca.SX.sym("h")
    q0, v0, q1, v1 = ca.vertsplit(x, 2)
    a0, a1 = 2 / h**2 * (q1 - q0 - h * v0), 2 / h**2 * (q0 - q1 + h * v1)
    q, v = (q0 + q1) / 2, (v0 + v1) / 2
    L_d = h / 2 * (L(q, v, a0) + L(q, v, a1))
    H, g = ca.hessian(L_d, x)
    return ca.Function("L_d", [x, h], [L_d, g, H])


@dataclass
class Problem:
    """Nodes x, shape (N + 1, 4), with both ends fixed."""

    x: Array
    h: float
    cost: Cost = Cost()

    @classmethod
    def cubic(
        cls, start: Array, goal: Array, duration: float, intervals: int, cost: Cost = Cost()
    ) -> Problem:
        """The cubic through (q, v) at both ends."""
        s, T = np.linspace(0, 1, intervals + 1)[:, None], duration
        (q0, v0), (q1, v1) = np.split(start, 2), np.split(goal, 2)
        b, c = 3 * (q1 - q0) - T * (2 * v0 + v1), 2 * (q0 - q1) + T * (v0 + v1)
        q = q0 + T * v0 * s + b * s**2 + c * s**3
        v = v0 + (2 * b * s + 3 * c * s**2) / T
        return cls(np.hstack([q, v]), duration / intervals, cost)

    @property
    def expansion(self) -> tuple[float, Array, Array]:
        """The action, the residual of the inner nodes (N - 1, 4), and all L_d's Hessians."""
        N = len(self.x) - 1
        pairs = np.hstack([self.x[:-1], self.x[1:]]).T
        values, g, H = discrete_lagrangian(self.cost).map(N)(pairs, self.h)
        gradient = np.array(g).T
        residual = gradient[1:, :NODE] + gradient[:-1, NODE:]
        blocks = np.array(H).reshape(2 * NODE, N, 2 * NODE).transpose(1, 0, 2)
        return float(ca.sum2(values)), residual, blocks

    @property
    def values(self) -> Array:
        """L_d of every interval, shape (N,)."""
        N = len(self.x) - 1
        pairs = np.hstack([self.x[:-1], self.x[1:]]).T
        return np.array(discrete_lagrangian(self.cost).map(N)(pairs, self.h)[0]).ravel()

    @staticmethod
    def assembled(blocks: Array) -> sp.csc_matrix:
        """The Hessian of the action, over the inner nodes."""
        N = len(blocks)
        index = NODE * np.arange(N)[:, None] + np.arange(2 * NODE)
        rows, columns = np.broadcast_arrays(index[:, :, None], index[:, None, :])
        full = sp.coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel()))).tocsc()
        return full[NODE:-NODE, NODE:-NODE]

    @property
    def n_neg(self) -> int:
        """Negative eigenvalues of the Hessian."""
        return int(np.sum(np.linalg.eigvalsh(self.assembled(self.expansion[2]).toarray()) < 0))

    @property
    def momenta(self) -> Array:
        """-D1 L_d at the first node of every interval, (N, 2)."""
        N = len(self.x) - 1
        pairs = np.hstack([self.x[:-1], self.x[1:]]).T
        gradient = np.array(discrete_lagrangian(self.cost).map(N)(pairs, self.h)[1]).T
        return -gradient[:, :2]

    def newton(self, residual: Array, blocks: Array) -> Array:
        """One full Newton step; returns it."""
        step = spsolve(self.assembled(blocks), -residual.ravel()).reshape(-1, NODE)
        self.x[1:-1] += step
        return np.asarray(step)


@dataclass
class Run:
    """The result of Newton's method."""

    problem: Problem
    steps: int
    stopped: str
    cost: float
    residual: float

    @property
    def summary(self) -> str:
        """The result in a few words."""
        if self.stopped == "not finite":
            return f"NaN after {self.steps} steps"
        return f"{self.stopped} after {self.steps} steps, J = {self.cost:.6g}"


def solve(problem: Problem, tolerance: float = 1e-10, max_steps: int = 50) -> Run:
    """Newton steps until the largest residual is below an absolute tolerance."""
    with np.errstate(all="ignore"):
        for steps in range(max_steps + 1):
            cost, residual, blocks = problem.expansion
            size = float(np.abs(residual).max(initial=0.0))
            if not np.isfinite(size):
                return Run(problem, steps, "not finite", cost, size)
            if size <= tolerance:
                return Run(problem, steps, "converged", cost, size)
            if steps < max_steps:
                problem.newton(residual, blocks)
    return Run(problem, max_steps, "still running", cost, size)


def full_newton(problem: TrajectoryProblem, max_steps: int = 60) -> str:
    """Undamped Newton steps from the cubic guess, until one changes q and v by less than 1e-9."""
    path, T = problem.guess("cubic"), problem.grid.duration
    with np.errstate(all="ignore"):
        for steps in range(max_steps):
            action, cost = DenseAction(problem, path), problem.ld.action(path)
            if not (np.isfinite(action.hessian).all() and np.isfinite(cost)):
                return f"not finite after {steps} steps"
            change = np.linalg.solve(action.hessian, -action.gradient)
            after = moved(problem, path, action.step(change))
            moves = np.abs(after.q - path.q).max(), T * np.abs(after.v - path.v).max()
            if max(moves) <= 1e-9 * max(1.0, np.abs(path.q).max(), T * np.abs(path.v).max()):
                n_neg = int(np.sum(np.linalg.eigvalsh(action.hessian) < 0))
                return f"converged after {steps} steps, J = {cost:.4g}, n_neg = {n_neg}"
            path = after
    largest = np.abs(path.q).max()
    return f"still running after {max_steps} steps, J = {cost:.2g}, |q| up to {largest:.2g}"
