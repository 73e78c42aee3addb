"""The two-link arm of [ColomboFerraroMartin2016, section 5], derived by hand from its energies.

Neither hovi's tables nor Pinocchio have a part in it: an independent oracle for both.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_bvp

Array = npt.NDArray[np.float64]

MASS, LENGTH, GRAVITY = (0.375, 0.25), (1.5, 1.0), 9.8
HANG = np.array([-np.pi / 2, 0.0])
REACH_Q, REACH_V = np.array([0.3, 0.7]), np.array([0.5, -0.4])
REST = np.zeros(2)
REACH_COST = 20.2088008225
"""Minimum of 1/2 integral |tau|^2 from hanging at rest to (REACH_Q, REACH_V) in one second."""


@dataclass(frozen=True)
class Symbols:
    """u = d/dt dL/dv - dL/dq of L = K - V, with J_i = m_i l_i^2 / 3 about the centres of mass."""

    q: ca.SX
    v: ca.SX
    a: ca.SX
    u: ca.SX

    @property
    def effort(self) -> ca.SX:
        """L~ = 1/2 |u|^2."""
        return ca.sumsqr(self.u) / 2


@cache
def symbols() -> Symbols:
    q, v, a = (ca.SX.sym(name, 2) for name in "qva")
    angles, rates = (q[0], q[0] + q[1]), (v[0], v[0] + v[1])
    rods = [ca.vertcat(ca.cos(angle), ca.sin(angle)) for angle in angles]
    centres = [LENGTH[0] / 2 * rods[0], LENGTH[0] * rods[0] + LENGTH[1] / 2 * rods[1]]
    L = 0
    for m, length, centre, rate in zip(MASS, LENGTH, centres, rates, strict=True):
        J = m * length**2 / 3
        L += m / 2 * ca.sumsqr(ca.jtimes(centre, q, v)) + J / 2 * rate**2 - m * GRAVITY * centre[1]
    p = ca.gradient(L, v)
    u = ca.jtimes(p, q, v) + ca.jtimes(p, v, a) - ca.gradient(L, q)
    return Symbols(q, v, a, ca.simplify(u))


@cache
def _effort_function() -> ca.Function:
    s = symbols()
    return ca.Function("effort", [s.q, s.v, s.a], [s.effort])


def effort(q: Array, v: Array, a: Array) -> float:
    """L~(q, v, a) at one point."""
    return float(_effort_function()(q, v, a))


@dataclass(frozen=True)
class Extremal:
    """A solution of Pontryagin's equations by SciPy's collocation.

    at: times (M,) -> q, v, p, p~, each (M, 2). cost: 1/2 integral |u|^2.
    """

    at: Callable[[Array], tuple[Array, Array, Array, Array]]
    cost: float


def extremal(
    ends: tuple[Array, Array, Array, Array],
    duration: float,
    guess: tuple[Array, Array],
    tolerance: float,
) -> Extremal:
    """Pontryagin's equations of the arm between (q0, v0) and (q1, v1), solved by solve_bvp.

    H = p.v + p~.a - L~, with a from p~ = dL~/da = M u; p' = dL~/dq and p~' = dL~/dv - p.
    guess: times (M,), and (q, v, p, p~) as rows, shape (8, M).
    """
    q0, v0, q1, v1 = ends
    T = duration
    # s = t/T and (q, T v, T^3 p, T^2 p~, T^3 J), so that all numbers are of one size
    scale = np.repeat([1.0, T, T**3, T**2, T**3], [2, 2, 2, 2, 1])[:, None]
    rates, jacobian = _pontryagin()

    def rhs(s: Array, y: Array) -> Array:
        return np.asarray(T * scale * rates(y[:8] / scale[:8]).full())

    def rhs_jacobian(s: Array, y: Array) -> Array:
        flat = jacobian(y[:8] / scale[:8]).full()  # (9, 8 M)
        columns = flat.reshape(9, y.shape[1], 8).transpose(0, 2, 1)
        full = np.zeros((9, 9, y.shape[1]))
        full[:, :8] = T * scale[:, :, None] * columns / scale[None, :8]
        return full

    def boundary(y0: Array, yT: Array) -> Array:
        start = [y0[:2] - q0, y0[2:4] - T * v0, y0[8:]]
        return np.concatenate([*start, yT[:2] - q1, yT[2:4] - T * v1])

    t, y = guess
    y = np.concatenate([y, np.zeros((1, len(t)))]) * scale
    found = solve_bvp(rhs, boundary, t / T, y, fun_jac=rhs_jacobian, tol=tolerance, max_nodes=20000)
    assert found.success, found.message

    def at(times: Array) -> tuple[Array, Array, Array, Array]:
        q, v, p, pt = np.split((found.sol(times / T) / scale)[:8].T, 4, axis=1)
        return q, v, p, pt

    return Extremal(at, float(found.y[8, -1] / T**3))


@cache
def _pontryagin() -> tuple[ca.Function, ca.Function]:
    """(q, v, p, p~)' and 1/2 |u|^2 as functions of y = (q, v, p, p~), and their Jacobian."""
    s = symbols()
    p, pt = ca.SX.sym("p", 2), ca.SX.sym("pt", 2)
    M = ca.jacobian(s.u, s.a)
    drift = ca.substitute(s.u, s.a, ca.SX.zeros(2))
    u = ca.solve(M, pt)
    a = ca.solve(M, u - drift)
    dL = [ca.substitute(ca.gradient(s.effort, x), s.a, a) for x in (s.q, s.v)]
    y = ca.vertcat(s.q, s.v, p, pt)
    rates = ca.vertcat(s.v, a, dL[0], dL[1] - p, ca.sumsqr(u) / 2)
    jacobian = ca.densify(ca.jacobian(rates, y))
    return ca.Function("rates", [y], [rates]), ca.Function("jacobian", [y], [jacobian])
