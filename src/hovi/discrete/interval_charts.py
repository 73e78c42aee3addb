"""The chain rule of charts in the expansion of a discrete Lagrangian.

In an interval's chart the columns are (q0, h v0, x1, h x1', c), where q0 is the center of the
chart; pulled back along the end map they become the nodal ones, (q0, h v0, q1, h v1, c).
Columns are in the scaled variables of the scheme's table.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.interval_batch import IntervalBatch, Jet
from hovi.robot.space.chart import Chart
from hovi.robot.space.compiled_charts import CompiledCharts
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.schemes import Scheme

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class IntervalCharts:
    """The charts of some intervals of one scheme along a path.

    chart: of the robot. scheme: of the intervals. h: their lengths, shape (B,).
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
        """The largest rotation angle in every chart, at points and ends, (B,), in [rad]."""
        points = self.x[0].reshape(len(self.h), -1, self.x.shape[2])
        x = np.concatenate([points, self.ends[:, :1]], axis=1)
        turns = [
            np.linalg.norm(x[..., [f.v.start + i for i in f.group.angular]], axis=-1).max(axis=1)
            for f in self.chart.space.curved
        ]
        return np.asarray(np.max(turns, axis=0))

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


def jet_on(space: ConfigurationSpace, batch: IntervalBatch, path: DiscretePath) -> Jet:
    """As `IntervalBatch.jet`, in the charts q = q0 (+) x."""
    return Chart(space).jets_from(path.q[:-1][batch.index], batch.local(path))


def charts_on(chart: Chart, batch: IntervalBatch, path: DiscretePath) -> IntervalCharts:
    """The charts of a batch's intervals."""
    h = batch.h[:, None, None]
    v0, z = path.v[:-1][batch.index], path.z[batch.index]
    ends = h * v0[:, None] + h**2 * z
    return IntervalCharts(chart, batch.scheme, batch.h, batch.local(path), ends)
