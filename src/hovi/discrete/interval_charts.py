"""The chain rule of charts in the expansion of a discrete Lagrangian.

In an interval's chart the columns are (q0, h v0, x1, h x1', c), where q0 is the center of the
chart; pulled back along the end map they become the nodal ones, (q0, h v0, q1, h v1, c).
Columns are in the scaled variables of the scheme's table. Lagrangians of order 1 have those without
the velocities, (q0, q1, c).
"""

from __future__ import annotations

import dataclasses
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.instants import InstantBatch
from hovi.discrete.interval_batch import IntervalBatch, Jet
from hovi.robot.space.chart import Chart
from hovi.robot.space.compiled_charts import CompiledCharts
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.schemes import Scheme
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class IntervalCharts:
    """The charts of some intervals of one scheme along a path, or those of instants.

    chart: of the robot. scheme: of the intervals; that of instants has one point, and one table, of
    each. h: their lengths, shape (B,).
    x: (x, x', x'') at their quadrature points, shape (3, B Q, n).
    ends: (x1, h x1'), shape (B, 2, n).
    """

    chart: Chart
    scheme: Scheme
    h: Array
    x: Array
    ends: Array

    @property
    def turns(self) -> Array:
        """The largest rotation angle in every chart, at points and ends, (B,), in [rad].

        Infinite where the chart holds NaN, as it does far beyond the turns that it covers.
        """
        points = self.x[0].reshape(len(self.h), -1, self.x.shape[2])
        x = np.concatenate([points, self.ends[:, :1]], axis=1)
        turns = [
            np.linalg.norm(x[..., [f.v.start + i for i in f.group.angular]], axis=-1).max(axis=1)
            for f in self.chart.space.curved
        ]
        largest = np.max(turns, axis=0)
        return np.where(np.isnan(largest), np.inf, largest)

    def expand(self, gradient: Array, hessian: Array) -> tuple[Array, Array]:
        """Gradient (B, m, n) and Hessian (B, m, m, n, n) of L_d in nodal columns.

        gradient (P, 3 n), hessian (P, 3 n, 3 n), symmetric: of the Lagrangian at the points.
        """
        return self.compiled(self.scheme.nodal_table).expand(gradient, hessian)

    def nodal_gradient(self, gradient: Array) -> Array:
        """The gradient (B, m, n) of L_d in nodal columns from that at the points, (P, 3, n)."""
        return self.compiled(self.scheme.nodal_table).pull_gradient(gradient, False)

    def end_gradient(self, gradient: Array) -> Array:
        """As `nodal_gradient`, in (q0, h v0, q1, h v1) only and without cancellation."""
        return self.compiled(self.scheme.regular_table).pull_gradient(gradient, True)[:, :4]

    def nodal_moments(self, tests: Array, jacobian: Array) -> Array:
        """The gradients (B, K, p, m, n) of h sum_q w_q t_q y in nodal columns.

        tests: test functions t at the points, shape (K, Q). jacobian: of the outputs y in
        (q, v, a) at the points, shape (P, p, 3 n).
        """
        return self.compiled(self.scheme.nodal_table).pull_moments(tests, jacobian)

    def point_steps(self, step: Array) -> Array:
        """Change of (q, v, a) at the points in a nodal step (B, m, n), (B, Q, 3, n)."""
        return self.compiled(self.scheme.nodal_table).push_steps(step)

    def compiled(self, table: Array, portable: bool = False) -> CompiledCharts:
        """The same charts over the columns of a table, (Q, 3, m)."""
        layout, weights = self.chart.space.layout, self.scheme.weights
        return CompiledCharts(layout, table, weights, self.h, self.x, self.ends, portable)


@dataclass(frozen=True, eq=False)
class FirstOrderCharts:
    """The same for Lagrangians of order 1: L(q, v), in the columns (q0, q1, c).

    embedded: the charts with a table of order 2, on whose velocities at the ends nothing depends.
    """

    embedded: IntervalCharts

    @property
    def turns(self) -> Array:
        """See IntervalCharts.turns."""
        return self.embedded.turns

    def expand(self, gradient: Array, hessian: Array) -> tuple[Array, Array]:
        """Gradient (B, m, n) and Hessian (B, m, m, n, n) from those at the points, of (q, v)."""
        n = self.embedded.x.shape[2]
        padded = np.zeros((len(gradient), 3 * n, 3 * n))
        padded[:, : 2 * n, : 2 * n] = hessian.reshape(-1, 2 * n, 2 * n)
        g, H = self.embedded.expand(self._padded(gradient), padded)
        used = _used(g.shape[1])
        return g[:, used], np.ascontiguousarray(H[:, used][:, :, used])

    def nodal_gradient(self, gradient: Array) -> Array:
        """The gradient (B, m, n) alone."""
        g = self.embedded.nodal_gradient(self._padded(gradient))
        return g[:, _used(g.shape[1])]

    def end_gradient(self, gradient: Array) -> Array:
        """That in (q0, q1) only and without cancellation."""
        return self.embedded.end_gradient(self._padded(gradient))[:, [0, 2]]

    def point_steps(self, step: Array) -> Array:
        """Change of (q, v) at the points in a nodal step (B, m, n), (B, Q, 2, n)."""
        B, m, n = step.shape
        whole = np.zeros((B, m + 2, n))
        whole[:, _used(m + 2)] = step
        return self.embedded.point_steps(whole)[:, :, :2]

    def _padded(self, gradient: Array) -> Array:
        """A gradient in (q, v) as one in (q, v, a), (P, 3, n)."""
        n = self.embedded.x.shape[2]
        rows = gradient.reshape(-1, 2, n)
        return np.concatenate([rows, np.zeros((len(rows), 1, n))], axis=1)


Charts = IntervalCharts | FirstOrderCharts


def _used(columns: int) -> list[int]:
    """Which of (q0, h v0, q1, h v1, c) a Lagrangian of order 1 depends on."""
    return [0, 2, *range(4, columns)]


@lru_cache(maxsize=64)
def embedded(scheme: Scheme) -> Scheme:
    """A scheme for order 1 with a table for order 2 that ignores the velocities at the ends.

    (Q, 2, 1 + r) over (Z0, c) becomes (Q, 3, 3 + r) over (h v0, Z0, Z1, c), with
    q1 - q0 = h v0 + Z0.
    """
    first = scheme.table
    table = np.zeros((len(first), 3, first.shape[2] + 2))
    table[:, :2, 0] = table[:, :2, 1] = first[:, :, 0]
    table[:, :2, 3:] = first[:, :, 1:]
    return dataclasses.replace(scheme, table=table)


def jet_on(space: ConfigurationSpace, batch: IntervalBatch, path: DiscretePath) -> Jet:
    """As `IntervalBatch.jet`, in the charts q = q0 (+) x.

    For orders other than 1 and 2 on commutative groups, where x' is the velocity.
    """
    q0, k = path.q[:-1][batch.index], batch.scheme.derivatives
    if k == 2:
        return Chart(space).jets_from(q0, batch.local(path))
    x = batch.local(path)
    if not space.flat:
        return Chart(space).jets_from(q0, x)[:2]
    each = x[0].reshape(len(q0), -1, space.nv)
    return space.integrate(q0[:, None], each).reshape(-1, space.nq), *x[1 : k + 1]


def charts_on(chart: Chart, batch: IntervalBatch | InstantBatch, path: DiscretePath) -> Charts:
    """The charts of a batch's intervals, or of those of its instants."""
    h = batch.h[:, None, None]
    if batch.scheme.derivatives == 1:
        x1 = h * path.z[batch.index]  # (B, 1, n)
        ends = np.concatenate([x1, np.zeros_like(x1)], axis=1)
        scheme = embedded(batch.scheme)
        return FirstOrderCharts(IntervalCharts(chart, scheme, batch.h, batch.local(path), ends))
    v0, z = path.v[:-1][batch.index], path.z[batch.index]
    ends = h * v0[:, None] + h**2 * z
    return IntervalCharts(chart, batch.scheme, batch.h, batch.local(path), ends)
