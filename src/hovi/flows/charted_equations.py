"""The equations of an interval on a group, as functions of its start and its modes, k = 1 and 2.

The curve is q(s) = q0 (+) x(s) in the chart centered at the first node; the modes (w, c) are those
of x^(k), of order one as the length h tends to zero.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.discrete.interval_charts import IntervalCharts, embedded
from hovi.errors import InputError
from hovi.flows.regularized import Regularized, regularized
from hovi.optimize.batched_newton import System, roots
from hovi.robot.space.chart import Chart
from hovi.robot.space.configuration_space import ConfigurationSpace, bracket
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import Scheme
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ChartedEquations:
    """The equations of an interval of length h, by a scheme of order k, 1 or 2.

    lagrangian: L on T^(k)Q. space: Q. h: in [s].
    """

    lagrangian: Lagrangian
    space: ConfigurationSpace
    scheme: Scheme
    h: float

    @property
    def k(self) -> int:
        """Order of the Lagrangian."""
        return self.lagrangian.order

    @property
    def n(self) -> int:
        """Degrees of freedom."""
        return self.lagrangian.nv

    @property
    def regularized(self) -> Regularized:
        """The transformation between the end in the chart and w."""
        return regularized(self.k, self.h)

    def split(self, x: Array) -> list[Array]:
        """(q, q', ..) of rows x (N, nq + (k - 1) nv)."""
        return np.split(x, [self.space.nq], axis=1)[: self.k]

    def charts(self, start: Array, modes: Array) -> IntervalCharts:
        """The charts of N intervals from (w, c), shape (N, k + r, n)."""
        h, k, N = self.h, self.k, len(start)
        scaled = h**k * np.append(self.regularized.z(modes[:, :k]), modes[:, k:], axis=1)
        still = np.zeros((N, 1, self.n))
        hv = h * self.split(start)[1][:, None] if k == 2 else still
        Z = scaled if k == 2 else np.concatenate([scaled[:, :1], still, scaled[:, 1:]], axis=1)
        table = self._scheme.table / h ** np.arange(3.0)[:, None]
        points: Array = np.einsum("qri,nia->rnqa", table, np.append(hv, Z, axis=1))
        ends = hv + Z[:, :2]
        return IntervalCharts(
            Chart(self.space),
            self._scheme,
            np.full(N, float(h)),
            points.reshape(3, -1, self.n),
            ends,
        )

    def end(self, start: Array, interval: IntervalCharts) -> Array:
        """The end point, shape (1, nq + (k - 1) nv)."""
        x1, hdx1 = np.moveaxis(interval.ends, 1, 0)
        q0 = self.split(start)[0]
        q1, v1, _ = Chart(self.space).jet(q0, x1, hdx1 / self.h, np.zeros_like(x1))
        return np.append(q1, v1, axis=1) if self.k == 2 else q1

    def ending_at(self, end: Array, modes: Array) -> tuple[Array, IntervalCharts]:
        """The start (1, nq + ..) of the interval with modes (1, k + r, n) that ends at a point."""
        space, parts = self.space, self.split(end)
        z = self.regularized.z(modes[:, : self.k])
        rest = [np.zeros_like(z[:, 0])] if self.k == 2 else []
        start = np.concatenate([parts[0], *rest], axis=1)
        if self.k == 2:
            start = np.append(parts[0], self._start_velocity(parts[1], modes, z), axis=1)
        interval = self.charts(start, modes)
        q0 = space.integrate(parts[0], -interval.ends[:, 0])
        return np.append(q0, start[:, space.nq :], axis=1), interval

    def _start_velocity(self, v1: Array, modes: Array, z: Array) -> Array:
        """v0 of J(h v0 + h^2 z0) (v0 + h z1) = v1, for k = 2, shape (1, n)."""
        h, n = self.h, self.n
        anywhere = np.zeros((1, self.space.nq))

        def system(v0: Array) -> tuple[Array, Array]:
            start = np.append(anywhere, v0, axis=1)
            interval = self.charts(start, modes)
            x1, hdx1 = np.moveaxis(interval.ends, 1, 0)
            v = Chart(self.space).jet(np.ones_like(anywhere), x1, hdx1 / h, 0 * x1)[1]
            E = self._end_slopes(interval)[n:]
            return v - v1, (E[:, :n] + E[:, n:])[None]

        return root_of(system, v1 - h * z[:, 1], h)

    def start_slopes(self, interval: IntervalCharts) -> Array:
        """d(q0, h v0) / dw at a fixed end, (k n, k n)."""
        k, n, chart = self.k, self.n, Chart(self.space)
        x1, each = np.tile(interval.ends[0, 0], (n, 1)), np.eye(n)
        anywhere = np.ones((n, self.space.nq))
        back, ahead = (chart.jet(anywhere, x, each, 0 * each)[1].T for x in (-x1, x1))
        E = self._end_slopes(interval)
        own = np.zeros((k * n, k * n))
        own[:n, :n] = np.linalg.solve(back, ahead)  # Ad of exp(-x1)
        if k == 2:
            own[:, n:] += E[:, :n] + E[:, n:]
        gamma = np.kron(self.regularized.gamma, each)
        return -(self.h**k) * np.asarray(np.linalg.solve(own, E @ gamma))

    def jets(self, interval: IntervalCharts, start: Array) -> list[Array]:
        """(q, .., q^(k)) at the quadrature points."""
        jets = Chart(self.space).jets_from(self.split(start)[0], interval.x)
        return list(jets[: self.k + 1])

    def times(self, t0: float) -> Array:
        """Those of the quadrature points, (Q,), in [s]."""
        return np.asarray(t0 + self.h * self.scheme.points)

    def momenta(self, interval: IntervalCharts, start: Array, t0: float) -> tuple[Array, Array]:
        """p0 and p1, shape (1, k, n) each."""
        gradient = self.lagrangian.gradient(*self.jets(interval, start), t=self.times(t0))
        return self._ends(interval, self._force(gradient))

    def expand(
        self, interval: IntervalCharts, start: Array, t0: float
    ) -> tuple[Array, Array, Array]:
        """p0 (1, k, n), D_c L_d (r, n) and their derivatives with respect to (w, c)."""
        n, k = self.n, self.k
        p0, _, slack, H = self.nodal(interval, start, t0)
        H[: k * n] *= -np.repeat([1.0, self.h], n)[: k * n, None]
        H = np.delete(H, np.s_[k * n : 2 * k * n], axis=0)[:, k * n :]  # rows (p0, c)
        return p0, slack, H @ self._columns(interval)

    def nodal(
        self, interval: IntervalCharts, start: Array, t0: float
    ) -> tuple[Array, Array, Array, Array]:
        """p0 and p1 (1, k, n), D_c L_d (r, n), and the Hessian in the used columns, (C, C)."""
        n, k, Q = self.n, self.k, len(self.scheme.weights)
        jets = self.jets(interval, start)
        _, gradient, hessian = self.lagrangian.evaluate(*jets, t=self.times(t0))
        force = self._force(gradient)
        # the "Hessian" with a force is not symmetric: the chart's curvature is added separately
        g, chart_curvature = interval.expand(force, np.zeros((Q, 3 * n, 3 * n)))
        used = self._used
        chart_curvature = chart_curvature[0][np.ix_(used, used)].transpose(0, 2, 1, 3)
        D = self._point_steps(interval)  # (C, Q, (k + 1) n), C columns
        weighted = self.h * self.scheme.weights[:, None] * D
        size = (k + 1) * n
        moved = np.matmul(D.transpose(1, 0, 2), hessian.reshape(Q, size, size).swapaxes(1, 2))
        H = weighted.reshape(len(D), -1) @ moved.transpose(0, 2, 1).reshape(-1, len(D))
        H += chart_curvature.reshape(len(D), len(D))
        return *self._ends(interval, force), g[0, 4:], H

    def _ends(self, interval: IntervalCharts, force: Array) -> tuple[Array, Array]:
        ends = interval.end_gradient(force) * np.array([1.0, self.h, 1.0, self.h])[:, None]
        return -ends[:, : self.k], ends[:, 2 : 2 + self.k]

    def _force(self, gradient: Array) -> Array:
        """A gradient at the points, padded with zeros up to order 2, (Q, 3, n)."""
        return np.append(gradient, np.zeros((len(gradient), 2 - self.k, self.n)), axis=1)

    def _columns(self, interval: IntervalCharts) -> Array:
        """d(q1, h v1, h^k c) / d(w, c) in the tangent space, (C, (k + r) n)."""
        n, k, r = self.n, self.k, self.scheme.inner_modes
        columns = self.h**k * np.eye((k + r) * n)
        ends = np.kron(self.regularized.gamma, np.eye(n))
        columns[: k * n, : k * n] = self.h**k * self._end_slopes(interval) @ ends
        return columns

    def _end_slopes(self, interval: IntervalCharts) -> Array:
        """d(q1, h v1) / d(x1, h x1'), for k = 1 without the velocities, (k n, k n).

        h v1 = J(x1) y with y = h x1'. Charts give the sum of the derivatives of J e along y and of
        J y along e; their difference is the bracket.
        """
        n, (x1, y) = self.n, interval.ends[0]
        each, still = np.eye(n), np.zeros((n, n))
        chart, origin = Chart(self.space), np.ones((n, self.space.nq))  # any origin
        _, J, own = chart.jet(origin, still + x1, each, still)
        if self.k == 1:
            return J.T
        _, both, mixed = chart.jet(origin, still + x1, each + y, still)
        v, alone = (both - J)[:1], chart.jet(origin[:1], x1[None], y[None], still[:1])[2]
        slope = 0.5 * (mixed - own - alone + bracket(self.space, still + v, J))
        return np.block([[J.T, still], [slope.T, J.T]])

    def _point_steps(self, interval: IntervalCharts) -> Array:
        """Change of (q, .., q^(k)) at the points in every used column, shape (C, Q, (k + 1) n)."""
        n, m, used = self.n, 4 + self.scheme.inner_modes, self._used
        C = len(used) * n
        step = np.zeros((C, m, n))
        step.reshape(C, -1)[np.arange(C), (used[:, None] * n + np.arange(n)).ravel()] = 1.0
        many = IntervalCharts(
            interval.chart,
            interval.scheme,
            np.full(C, float(self.h)),
            np.tile(interval.x, (1, C, 1)),
            np.repeat(interval.ends, C, axis=0),
        )
        steps = many.point_steps(step)[:, :, : self.k + 1]
        return steps.reshape(C, -1, (self.k + 1) * n)

    @cached_property
    def _scheme(self) -> Scheme:
        """The scheme as a table for k = 2; for k = 1 it ignores the end velocities."""
        return self.scheme if self.k == 2 else embedded(self.scheme)

    @property
    def _used(self) -> npt.NDArray[np.intp]:
        """Which of (q0, h v0, q1, h v1, c) L_d depends on."""
        every = np.arange(4 + self.scheme.inner_modes)
        return every if self.k == 2 else np.delete(every, [1, 3])


def root_of(system: System, u: Array, h: float) -> Array:
    """A root of the equations of an interval of length h. Raises InputError if there is none."""
    found = roots(system, u)
    if not found.found.all():
        raise InputError(
            f"the discrete equations of an interval of h = {h:g} s have no solution near the "
            "initial guess: use a shorter step or smaller momenta."
        )
    return found.u
