"""A direct transcription with limits on (q, v, a) and tau at every point, for Ipopt.

Rows of q, v and a are linear in the unknowns. Those of tau, and the Hessian of the Lagrangian, are
assembled from kernels of one point, which are compiled by gcc or interpreted by CasADi.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.accuracy.peers.point_program import IPOPT, PointProgram, block_diagonal
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LimitedKernels:
    """tau and L = 1/2 |tau|^2 at one point p = (q, v, a), shape (3 n,): CasADi functions.

    value: p -> (L, tau). first: p -> (L, dL, tau, J). second: (p, s, l) -> the Hessian of
    s L + l . tau, dense.
    """

    value: ca.Function
    first: ca.Function
    second: ca.Function

    def passed_through(
        self, change: Callable[[Sequence[ca.Function]], list[ca.Function]]
    ) -> LimitedKernels:
        """The kernels after a change to the three functions, such as a compilation."""
        return LimitedKernels(*change((self.value, self.first, self.second)))


def limited_kernels(inverse_dynamics: ca.Function) -> LimitedKernels:
    """The kernels of an inverse dynamics function (q, v, a) -> tau, for CasADi's interpreter."""
    n = int(inverse_dynamics.size1_in(1))
    p, s, multipliers = ca.SX.sym("p", 3 * n), ca.SX.sym("s"), ca.SX.sym("l", n)
    tau = ca.cse(inverse_dynamics(p[:n], p[n : 2 * n], p[2 * n :]))
    L, J = ca.sumsqr(tau) / 2, ca.densify(ca.jacobian(tau, p))
    H = ca.hessian(s * L + ca.dot(multipliers, tau), p)[0]
    return LimitedKernels(
        ca.Function("value", [p], [L, tau]),
        ca.Function("first", [p], [L, *ca.cse([ca.mtimes(J.T, tau), tau, J])]),
        ca.Function("second", [p, s, multipliers], [ca.cse(ca.densify(H))]),
    )


@dataclass(frozen=True, eq=False)
class LimitedProgram:
    """A PointProgram with bounds on (q, v, a, tau) at its points.

    lower, upper: shape (4, n); rows of q, v and a without any bound are left out.
    """

    program: PointProgram
    lower: Array
    upper: Array

    @property
    def bounds(self) -> dict[str, Array]:
        """Bounds on the constraints: the defects, linear rows and torques of all points."""
        P, defects = len(self.program.weights), np.zeros(self.program.defects.shape[0])
        parts = {}
        for name, bound in (("lbg", self.lower), ("ubg", self.upper)):
            linear = np.tile(bound[:3].ravel()[self._bounded], P)
            parts[name] = np.concatenate([defects, linear, np.tile(bound[3], P)])
        return parts

    def solver(self, kernels: LimitedKernels) -> ca.Function:
        """An Ipopt solver for this program, to be called with `bounds`."""
        P = len(self.program.weights)
        w = ca.MX.sym("w", self.program.points.shape[1])
        p = ca.reshape(ca.mtimes(self.program.points, w), -1, P)
        L, tau = kernels.value.map(P)(p)
        f = ca.dot(L.T, ca.DM(self.program.weights))
        g = ca.vertcat(ca.mtimes(self._linear, w), ca.vec(tau))
        options: dict[str, Any] = {"print_time": 0, "ipopt": IPOPT, "no_nlp_grad": True}
        options |= self._derivatives(w, p, kernels)
        return ca.nlpsol("S", "ipopt", {"x": w, "f": f, "g": g}, options)

    def _derivatives(self, w: ca.MX, p: ca.MX, kernels: LimitedKernels) -> dict[str, ca.Function]:
        """The functions that nlpsol would otherwise generate, by their option names."""
        points, W = self.program.points, ca.DM(self.program.weights)
        P, n = len(self.program.weights), self.lower.shape[1]
        L, slope, tau, J = kernels.first.map(P)(p)
        slope = ca.mtimes(points.T, ca.vec(slope * ca.repmat(W.T, 3 * n, 1)))
        g = ca.vertcat(ca.mtimes(self._linear, w), ca.vec(tau))
        jacobian = ca.vertcat(ca.MX(self._linear), ca.mtimes(block_diagonal(J, P), points))
        no_parameters, lf = ca.MX.sym("par", 0, 1), ca.MX.sym("lf")
        lg = ca.MX.sym("lg", g.shape[0])
        multipliers = ca.reshape(lg[self._linear.shape[0] :], n, P)
        H = block_diagonal(kernels.second.map(P)(p, lf * W.T, multipliers), P)
        H = ca.triu(ca.mtimes(ca.mtimes(points.T, H), points))
        known, fgrad = [w, no_parameters], [ca.dot(L.T, W), slope]
        names, of_lagrangian = ["x", "p"], ["x", "p", "lam:f", "lam:g"]
        return {
            "grad_f": ca.Function("nlp_grad_f", known, fgrad, names, ["f", "grad:f:x"]),
            "jac_g": ca.Function("nlp_jac_g", known, [g, jacobian], names, ["g", "jac:g:x"]),
            "hess_lag": ca.Function(
                "nlp_hess_l", [*known, lf, lg], [H], of_lagrangian, ["triu:hess:gamma:x:x"]
            ),
        }

    @cached_property
    def _bounded(self) -> npt.NDArray[np.intp]:
        """The bounded ones of (q, v, a)."""
        finite = np.isfinite(self.lower[:3]) | np.isfinite(self.upper[:3])
        return np.flatnonzero(finite.ravel())

    @cached_property
    def _linear(self) -> ca.DM:
        """The defects, and the bounded rows of q, v and a of all points."""
        first = 3 * self.lower.shape[1] * np.arange(len(self.program.weights))
        rows = (first[:, None] + self._bounded).ravel().tolist()
        return ca.vertcat(self.program.defects, self.program.points[rows, :])
