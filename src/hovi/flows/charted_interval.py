"""An interval of a discrete motion on a group, with all derivatives of L_d.

Points of T^(k-1)Q are varied by (eta, dv), q exp(eta) and v + dv, and derivatives are those in eta
and dv. Second derivatives at one node are along exp, and the momentum p = dL_d/d eta of a node that
moves by eta changes by the bracket besides: (p of q exp(eta)) . zeta = dL_d along
exp(eta) exp(zeta) = exp(eta + zeta + 1/2 [eta, zeta] + ...). [MarsdenPekarskyShkoller1999]
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.flows.interval import flat
from hovi.robot.space.configuration_space import ConfigurationSpace, bracket
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NodalExpansion:
    """L_d of B intervals to second order in m = 2 k + r scaled columns (q0, h v0, q1, h v1, h^k c).

    values: L_d, shape (B,). p0: -D_1 .. -D_k, shape (B, k, n). hessian: shape (B, m, m, n, n).
    step_rate: derivative of L_d in h at fixed columns, shape (B,).
    """

    values: Array
    p0: Array
    hessian: Array
    step_rate: Array


@dataclass(frozen=True, eq=False)
class ChartedInterval:
    """B intervals of length h on a configuration space, with extremal inner modes.

    x0, x1: the ends, shape (B, 1, nq + (k - 1) nv) each.
    w: regularized coordinates, shape (B, k, nv). z: gamma w. inner: inner modes, (B, r, nv); all
        in the units of x^(k), of x in the chart centered at the first node.
    p1: momenta at the end, D_{k+1} .. D_2k of L_d, shape (B, k, nv).
    expand: the second-order expansion, which is computed when it is first asked for.
    """

    space: ConfigurationSpace
    h: float
    x0: Array
    w: Array
    z: Array
    inner: Array
    x1: Array
    p1: Array
    expand: Callable[[], NodalExpansion]

    @property
    def k(self) -> int:
        """Order of the Lagrangian."""
        return int(self.w.shape[1])

    @cached_property
    def expansion(self) -> NodalExpansion:
        """L_d to second order."""
        return self.expand()

    @property
    def values(self) -> Array:
        """L_d, shape (B,)."""
        return self.expansion.values

    @property
    def p0(self) -> Array:
        """Momenta at the start, -D_1 .. -D_k of L_d, shape (B, k, n)."""
        return self.expansion.p0

    @property
    def hessian(self) -> Array:
        """Second derivatives in the scaled columns, inner modes included, (B, m, m, n, n)."""
        return self.expansion.hessian

    @property
    def derivatives(self) -> Array:
        """D_1 .. D_2k of L_d in the tangent space, shape (B, 2 k, n)."""
        return np.concatenate([-self.p0, self.p1], axis=1)

    @property
    def scaled_momenta(self) -> Array:
        """D_1 .. D_2k in the columns (q0, h v0, q1, h v1), times h^(k-1), of one size as h -> 0."""
        powers = float(self.h) ** (self.k - 1 - np.tile(np.arange(self.k), 2))
        return np.asarray(powers[:, None] * self.derivatives)

    @property
    def step_derivative(self) -> Array:
        """D_h of L_d at fixed ends, shape (B,); for the exact L_d it is minus the energy."""
        if self.k == 1:
            return self.expansion.step_rate
        v0, v1 = (x[:, 0, self.space.nq :] for x in (self.x0, self.x1))
        moved = np.vecdot(self.p1[:, 1], v1) - np.vecdot(self.p0[:, 1], v0)
        return np.asarray(self.expansion.step_rate + moved / self.h)

    @cached_property
    def second_derivatives(self) -> Array:
        """D_ij of L_d with the inner modes extremal, shape (B, 2 k, 2 k, n, n)."""
        k, n = self.k, self.w.shape[2]
        H, m = flat(self.hessian), 2 * k * n
        if self.inner.shape[1]:
            H = H[:, :m, :m] - H[:, :m, m:] @ np.linalg.solve(H[:, m:, m:], H[:, m:, :m])
        scales = np.repeat(np.tile(self.h ** np.arange(k), 2), n)
        H = scales[:, None] * H * scales
        return np.asarray(H.reshape(-1, 2 * k, n, 2 * k, n).transpose(0, 1, 3, 2, 4))

    @property
    def regularity_matrix(self) -> Array:
        """W_d = [D_{i, k+j} L_d], i, j = 1 .. k, shape (B, k n, k n)."""
        return flat(self.second_derivatives[:, : self.k, self.k :])

    @property
    def tangent(self) -> Array:
        """The tangent map of the flow, (dx0, dp0) -> (dx1, dp1), shape (B, 2 k n, 2 k n).

        dx = (eta, dv) as above, dp the change of the components of p.
        """
        m = self.k * self.w.shape[2]
        K = flat(self.second_derivatives)
        D00 = K[:, :m, :m] + self._turned(-self.p0)
        D11 = K[:, m:, m:] + self._turned(self.p1)
        by = np.concatenate([D00, np.broadcast_to(np.eye(m), D00.shape)], axis=2)
        dx1 = -np.linalg.solve(K[:, :m, m:], by)
        dp1 = D11 @ dx1
        dp1[:, :, :m] += K[:, m:, :m]
        return np.concatenate([dx1, dp1], axis=1)

    def _turned(self, slopes: Array) -> Array:
        """1/2 D . [eta, zeta] as matrices over (zeta, eta), from D of a node, (B, k, n)."""
        B, k, n = slopes.shape
        result = np.zeros((B, k * n, k * n))
        for one, slope in zip(result, slopes, strict=True):
            one[:n, :n] = 0.5 * coadjoint(self.space, slope[0]).T
        return result


def coadjoint(space: ConfigurationSpace, p: Array) -> Array:
    """The matrix of p . [a, b] over (a, b), shape (n, n), of a momentum p (n,)."""
    each, n = np.eye(len(p)), len(p)
    a, b = np.repeat(each, n, axis=0), np.tile(each, (n, 1))
    return np.asarray((bracket(space, a, b) @ p).reshape(n, n))


def symplectic_form(space: ConfigurationSpace, p: Array) -> Array:
    """The canonical two-form on T*T^(k-1)Q at momenta p (k, n), shape (2 k n, 2 k n).

    Over (dx, dp) as in `ChartedInterval.tangent`: ((a, f), (b, g)) -> g . a - f . b + p_0 . [a, b].
    A map with the tangent D between two points is symplectic if D^T omega_1 D = omega_0.
    """
    k, n = p.shape
    m = k * n
    form = np.zeros((2 * m, 2 * m))
    form[:m, m:], form[m:, :m] = np.eye(m), -np.eye(m)
    form[:n, :n] = coadjoint(space, p[0])
    return form


def joined(intervals: Sequence[ChartedInterval]) -> ChartedInterval:
    """Batches of one interval each as one batch."""
    if len(intervals) == 1:
        return intervals[0]

    def expand() -> NodalExpansion:
        names = "values", "p0", "hessian", "step_rate"
        expansions = [interval.expansion for interval in intervals]
        return NodalExpansion(
            *(np.concatenate([getattr(each, name) for each in expansions]) for name in names)
        )

    x0, w, z, inner, x1, p1 = (
        np.concatenate([getattr(each, name) for each in intervals])
        for name in ("x0", "w", "z", "inner", "x1", "p1")
    )
    first = intervals[0]
    return ChartedInterval(first.space, first.h, x0, w, z, inner, x1, p1, expand)
