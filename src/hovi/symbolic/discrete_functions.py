"""The discrete Lagrangian of a scheme and its Euler-Lagrange equations as CasADi functions."""

from __future__ import annotations

import casadi as ca

from hovi.checks.arguments import check_arguments
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.schemes import Scheme
from hovi.symbolic import scene_functions
from hovi.system.dataclass import dataclass


@check_arguments
def discrete_lagrangian(of: Scene | CasadiLagrangian, scheme: Scheme, h: float) -> ca.Function:
    """L_d(x0, x1, c, t0) = h sum_j w_j L(q_j, q'_j, ..., q^(k)_j, t0 + h s_j) of one interval.

    of: a scene, for its L~, or a Lagrangian on T^(k)Q. scheme: a table for the same k. h: in [s].
    The function takes x0 and x1 of shape (n, k), with the columns (q, q', ..., q^(k-1)) at the
    ends, the inner modes c of shape (n, r), per [s^k], and t0 in [s].
    Raises SchemeError if the orders differ, InputError for joints with nq != nv.
    [ColomboFerraroMartin2016, sections 3 and 5]
    """
    interval = _Interval.of(of, scheme, h)
    (x0, c, t0), (x1, _, _) = interval.symbols("0"), interval.symbols("1")
    names = ["x0", "x1", "c", "t0"]
    return ca.Function("L_d", [x0, x1, c, t0], [interval.action(x0, x1, c, t0)], names, ["L_d"])


@check_arguments
def euler_lagrange(of: Scene | CasadiLagrangian, scheme: Scheme, h: float) -> ca.Function:
    """The discrete Euler-Lagrange equations at x1, between two intervals of length h.

    D_{1+j} L_d(x1, x2) + D_{k+1+j} L_d(x0, x1) = 0, j = 0 .. k-1, and dL_d/dc = 0 in both.
    Arguments and errors as for `discrete_lagrangian`. The function takes (x0, x1, x2, c0, c1, t0),
    with c0 and c1 the inner modes of the first and the second interval, and returns the residuals
    at the node (n, k) and of the inner modes (n, r) of both.
    """
    interval = _Interval.of(of, scheme, h)
    (x0, c0, t0), (x1, c1, _), (x2, _, _) = (interval.symbols(each) for each in "012")
    action = interval.action(x0, x1, c0, t0) + interval.action(x1, x2, c1, t0 + h)
    residuals = [ca.reshape(ca.gradient(action, x), *x.shape) for x in (x1, c0, c1)]
    inputs = ["x0", "x1", "x2", "c0", "c1", "t0"]
    outputs = ["node", "inner0", "inner1"]
    return ca.Function("euler_lagrange", [x0, x1, x2, c0, c1, t0], residuals, inputs, outputs)


@dataclass(frozen=True, eq=False)
class _Interval:
    """The action of one interval as an expression.

    numeric: the same L_d for numbers, with the scheme's table. L: (q, ..., q^(k), t) -> L.
    """

    numeric: SchemeLagrangian
    L: ca.Function

    @classmethod
    def of(cls, of: Scene | CasadiLagrangian, scheme: Scheme, h: float) -> _Interval:
        """Raises SchemeError if the orders differ, InputError for joints with nq != nv."""
        if isinstance(of, Scene):
            given: Lagrangian = of.effort_lagrangian()
            return cls(SchemeLagrangian(given, scheme, h), scene_functions.lagrangian(of))
        time = ca.SX.sym("t") if of.time is None else of.time
        L = ca.Function("L", [*of.jet, time], [of.expression])
        return cls(SchemeLagrangian(of, scheme, h), L)

    def symbols(self, node: str) -> tuple[ca.SX, ca.SX, ca.SX]:
        """x (n, k) of a node, and the inner modes (n, r) and t of the interval after it."""
        n, k, r = self.numeric.n, self.numeric.k, self.numeric.scheme.inner_modes
        return ca.SX.sym(f"x{node}", n, k), ca.SX.sym(f"c{node}", n, r), ca.SX.sym(f"t{node}")

    def action(self, x0: ca.SX, x1: ca.SX, inner: ca.SX, t0: ca.SX) -> ca.SX:
        """h sum_j w_j L at the points of the curve with these ends and inner modes."""
        scheme, h = self.numeric.scheme, self.numeric.h
        w = ca.horzcat(x0, x1) @ ca.DM(self.numeric.regularized.from_ends).T
        data = ca.horzcat(x0, w, inner)  # (n, 2 k + r)
        total = ca.SX(0)
        for s, weight, rows in zip(scheme.points, scheme.weights, self.numeric.table, strict=True):
            jet = ca.horzsplit(data @ ca.DM(rows).T)
            total += h * weight * self.L(*jet, t0 + h * s)
        return total
