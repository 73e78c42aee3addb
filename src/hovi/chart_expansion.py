"""What charts do to the expansion of a discrete Lagrangian: the chain rule at points and at ends.

In an interval's chart the columns are (q0, h v0, x1, h x1', c), where q0 moves the chart as a
whole; pulled back along the end map they become the nodal ones, (q0, h v0, q1, h v1, c).
Columns are in the scaled variables of the scheme's table.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.chart import Chart
from hovi.lie_groups import Layout, _charts
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
        """The largest turn of an orientation in every chart, at points and ends, (B,)."""
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
        B, n, m = len(self.h), self.x.shape[2], 4 + self.scheme.inner_modes
        H = np.ascontiguousarray(hessian.reshape(-1, 3 * n, 3 * n))
        gradients, hessians = np.empty((B, m, n)), np.empty((B, m, m, n, n))
        charts = self._charts(self.scheme.nodal_table)
        _charts.expand(*charts, self._at_points(gradient), H, gradients, hessians)
        return gradients, hessians

    def nodal_gradient(self, gradient: Array) -> Array:
        """The gradient (B, m, n) of L_d in nodal columns from that at the points, (P, 3, n)."""
        return self._pulled(gradient, self.scheme.nodal_table, False)

    def end_gradient(self, gradient: Array) -> Array:
        """As `nodal_gradient`, by (q0, h v0, q1, h v1) alone and without differences of ends."""
        return self._pulled(gradient, self.scheme.regular_table, True)[:, :4]

    def point_steps(self, step: Array) -> Array:
        """Change of (q, v, a) at the points in a nodal step (B, m, n), (B, Q, 3, n)."""
        change = np.empty((len(self.h), len(self.scheme.weights), 3, self.x.shape[2]))
        charts = self._charts(self.scheme.nodal_table)
        _charts.push_steps(*charts, np.ascontiguousarray(step), change)
        return change

    def _pulled(self, gradient: Array, table: Array, regular: bool) -> Array:
        pulled = np.empty((len(self.h), 4 + self.scheme.inner_modes, self.x.shape[2]))
        at_points = self._at_points(gradient)
        _charts.pull_gradient(*self._charts(table), at_points, regular, pulled)
        return pulled

    def _at_points(self, gradient: Array) -> Array:
        return np.ascontiguousarray(gradient.reshape(self.x.shape[1], -1))

    def _charts(self, table: Array) -> tuple[Layout, Array, Array, Array, Array, Array]:
        """What the compiled chain rule has to know of the charts."""
        scheme = np.ascontiguousarray(table), self.scheme.weights
        intervals = np.ascontiguousarray(self.h), self.x, self.ends
        return self.chart.space.layout, *scheme, *intervals
