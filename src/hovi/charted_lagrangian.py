"""The discrete Lagrangian of mechanics on groups: L_d on Q x Q, one interval at a time.

An interval's curve is q(s) = q0 (+) x(s) in the chart of its first node, which moves with that
node: L_d = h sum_j w_j L(q0 (+) x_j, J(x_j) x_j') keeps the left symmetries of L. The step solves

    p0 = -D_1 L_d(q0, q1),   0 = D_c L_d,   p1 = D_2 L_d(q0, q1)

for the mean w = x1 / h of x' and the inner modes c, which stay of order one as h tends to zero.
What `SchemeLagrangian` is for k = 1 where configurations are vectors. [MarsdenPekarskyShkoller1999]
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.chart import Chart
from hovi.chart_expansion import IntervalCharts
from hovi.configuration_space import ConfigurationSpace
from hovi.errors import InputError, SchemeError
from hovi.lagrangian import Lagrangian
from hovi.newton import newton
from hovi.schemes import Scheme

Array = npt.NDArray[np.float64]

WIDEST = 3.0
"""Turn of an orientation in one step, in [rad], that a chart holds: less than half a turn."""


@dataclass(frozen=True, eq=False)
class ChartedSegment:
    """An interval of a discrete motion on a group.

    w: x1 / h, shape (1, 1, nv). inner: inner modes, shape (1, r, nv).
    x1: q1, shape (1, 1, nq). p1: momenta there, shape (1, 1, nv).
    """

    w: Array
    inner: Array
    x1: Array
    p1: Array

    @property
    def z(self) -> Array:
        """The regularised coordinate w."""
        return self.w


@dataclass(frozen=True, eq=False)
class ChartedLagrangian:
    """L_d of one interval on a configuration space with groups, for L on TQ.

    lagrangian: L, of order 1. space: Q. scheme: a table for order 1. h: the step, in [s].
    Raises InputError for a step that is not positive, SchemeError for another order.
    """

    lagrangian: Lagrangian
    space: ConfigurationSpace
    scheme: Scheme
    h: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.h) and self.h > 0):
            raise InputError(f"a step must be positive and finite, got {self.h} s.")
        if (self.lagrangian.order, self.scheme.derivatives) != (1, 1):
            raise SchemeError(
                "flows on groups are those of Lagrangians of order 1, got order "
                f"{self.lagrangian.order} and a scheme for {self.scheme.derivatives}."
            )

    @property
    def k(self) -> int:
        """Order of the Lagrangian."""
        return 1

    @property
    def n(self) -> int:
        """Degrees of freedom."""
        return self.lagrangian.nv

    def from_start(
        self, x0: Array, p0: Array, t0: float = 0.0, guess: ChartedSegment | None = None
    ) -> ChartedSegment:
        """The segment that starts at q0 with momentum p0, (1, 1, nq) and (1, 1, nv).

        By Newton's method. Raises InputError where there is none, or it turns too far.
        """
        q0, n, h, r = x0[0], self.n, self.h, self.scheme.inner_modes

        def system(u: Array) -> tuple[Array, Array]:
            modes = u.reshape(1 + r, n)
            g, H = self._expand(q0, modes, t0)
            H = h * H[np.r_[:n, 2 * n : len(H)], n:]  # rows p0 and c by columns q1 and c
            H[:, :n] = H[:, :n] @ self._jacobian(q0, h * modes[0])
            F = np.concatenate([-g[0] - p0[0, 0], g[2:].ravel()])
            H[:n] *= -1.0
            return F[None], H[None]

        first = (
            np.zeros((1, 1 + r, n)) if guess is None else np.append(guess.w, guess.inner, axis=1)
        )
        u, found = newton(system, first.reshape(1, -1))
        self._check(u[0, :n], bool(found.all()))
        modes = u.reshape(1, 1 + r, n)
        p1 = self._expand(q0, modes[0], t0)[0][1]
        q1 = self.space.integrate(q0, h * modes[:, 0])
        return ChartedSegment(modes[:, :1], modes[:, 1:], q1[None], p1[None, None])

    def jet(self, q0: Array, w: Array, inner: Array) -> tuple[Array, Array]:
        """(q, v) at the quadrature points of N intervals, (N Q, nq) and (N Q, nv).

        q0: (N, 1, nq). w, inner: (N, 1, nv) and (N, r, nv).
        """
        q, v, _ = Chart(self.space).jets_from(q0[:, 0], self._curve(np.append(w, inner, axis=1)))
        return q, v

    @cached_property
    def _twofold(self) -> Scheme:
        """The scheme as a table for k = 2 that ignores the velocities of the ends."""
        first = self.scheme.table  # (Q, 2, 1 + r) over (Z0, c)
        table = np.zeros((len(first), 3, first.shape[2] + 2))
        table[:, :2, 0] = table[:, :2, 1] = first[:, :, 0]  # q1 - q0 = h v0 + Z0
        table[:, :2, 3:] = first[:, :, 1:]
        return dataclasses.replace(self.scheme, table=table)

    def _curve(self, modes: Array) -> Array:
        """(x, x', 0) at the points, shape (3, N Q, n), of modes (w, c), shape (N, 1 + r, n)."""
        table = np.delete(self._twofold.table, [0, 2], axis=2)  # over (Z0, c)
        table = table * self.h ** (1.0 - np.arange(3.0))[:, None]
        points: Array = np.einsum("qri,nia->rnqa", table, modes)
        return points.reshape(3, -1, self.n)

    def _expand(self, q0: Array, modes: Array, t0: float) -> tuple[Array, Array]:
        """Derivatives of L_d by (q0, q1, h c): gradient (2 + r, n), Hessian, both indices flat."""
        n, Q = self.n, len(self.scheme.weights)
        charts = self._charts(modes[None])
        q, v, _ = Chart(self.space).jets_from(q0, charts.x)
        _, gradient, hessian = self.lagrangian.evaluate(q, v, t=t0 + self.h * self.scheme.points)
        force = np.append(gradient, np.zeros((Q, 1, n)), axis=1)
        # the work of a force has no symmetric Hessian, so that the chart's part stands alone
        g, bent = charts.expand(force, np.zeros((Q, 3 * n, 3 * n)))
        used = np.delete(np.arange(g.shape[1]), [1, 3])
        bent = bent[0][np.ix_(used, used)].transpose(0, 2, 1, 3)
        D = self._point_steps(charts, used)  # (C, Q, 2 n), C = (2 + r) n
        weighted = self.h * self.scheme.weights[:, None] * D
        moved = np.matmul(D.transpose(1, 0, 2), hessian.reshape(Q, 2 * n, 2 * n).swapaxes(1, 2))
        rows = weighted.reshape(len(D), -1)
        H = rows @ moved.transpose(0, 2, 1).reshape(-1, len(D))
        return g[0, used], H + bent.reshape(len(D), len(D))

    def _point_steps(self, charts: IntervalCharts, used: npt.NDArray[np.intp]) -> Array:
        """Change of (q, v) at the points in every column, shape (C, Q, 2 n)."""
        n, m = self.n, 4 + self.scheme.inner_modes
        C = len(used) * n
        step = np.zeros((C, m, n))
        step.reshape(C, -1)[np.arange(C), (used[:, None] * n + np.arange(n)).ravel()] = 1.0
        many = IntervalCharts(
            charts.chart,
            charts.scheme,
            np.full(C, self.h),
            np.tile(charts.x, (1, C, 1)),
            np.repeat(charts.ends, C, axis=0),
        )
        return many.point_steps(step)[:, :, :2].reshape(C, -1, 2 * n)

    def _charts(self, modes: Array) -> IntervalCharts:
        x1 = self.h * modes[:, 0]
        ends = np.stack([x1, np.zeros_like(x1)], axis=1)
        h = np.array([self.h])
        return IntervalCharts(Chart(self.space), self._twofold, h, self._curve(modes), ends)

    def _jacobian(self, q0: Array, x1: Array) -> Array:
        """J of dq1 = J(x1) dx1, in the tangent space at q1, shape (n, n)."""
        each, still = np.eye(self.n), np.zeros((self.n, self.n))
        moved = Chart(self.space).jets_from(q0, np.stack([still + x1, each, still]))
        return moved[1].T

    def _check(self, w: Array, found: bool) -> None:
        turns = [w[f.v][list(f.group.angular)] for f in self.space.curved]
        widest = self.h * max((float(np.linalg.norm(turn)) for turn in turns), default=0.0)
        if not (found and widest < WIDEST):
            raise InputError(
                f"the discrete equations of a step of h = {self.h:g} s have no solution near the "
                "one sought: take a shorter step, or smaller momenta."
            )
