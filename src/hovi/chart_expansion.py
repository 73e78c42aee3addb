"""What charts do to the expansion of a discrete Lagrangian: the chain rule at points and at ends.

In an interval's chart the columns are (q0, h v0, x1, h x1', c), where q0 moves the chart as a
whole; pulled back along the end map they become the nodal ones, (q0, h v0, q1, h v1, c).
Everything is in the scaled variables of the scheme's table.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.chart import Bend, Chart
from hovi.schemes import Scheme

Array = npt.NDArray[np.float64]

PIECE = 256
"""Intervals whose point Hessians are held at a time, so that memory stays bounded."""


@dataclass(frozen=True, eq=False)
class IntervalCharts:
    """The charts of some intervals of one scheme along a path.

    chart: of the robot. scheme: of the intervals. h: their lengths, shape (B,).
    x: (x, h x', h^2 x'') at their quadrature points, shape (B, Q, 3, n).
    ends: (x1, h x1'), shape (B, 2, n).
    """

    chart: Chart
    scheme: Scheme
    h: Array
    x: Array
    ends: Array

    @property
    def _m(self) -> int:
        return 4 + self.scheme.inner_modes

    @property
    def turns(self) -> Array:
        """The largest turn of an orientation in every chart, at points and ends, (B,)."""
        x = np.concatenate([self.x[:, :, 0], self.ends[:, :1]], axis=1)
        turns = [
            np.linalg.norm(x[..., [f.v.start + i for i in f.group.angular]], axis=-1).max(axis=1)
            for f in self.chart.space.curved
        ]
        return np.asarray(np.max(turns, axis=0))

    @cached_property
    def nodal_table(self) -> Array:
        """(q0, x, h x', h^2 x'') over (q0, h v0, x1, h x1', c), shape (Q, 4, m)."""
        return _with_base(self.scheme.nodal_table)

    def expand(self, gradient: Array, hessian: Array) -> tuple[Array, Array]:
        """Gradient (B, m, n) and Hessian (B, m, m, n, n) of L_d in nodal columns.

        gradient (P, 3 n), hessian (P, 3 n, 3 n): those of the Lagrangian at the points.
        """
        B, n = len(self.h), self.x.shape[-1]
        g = gradient.reshape(B, -1, 3 * n)
        H = hessian.reshape(B, -1, 3 * n, 3 * n)
        gradients = np.empty((B, self._m, n))
        hessians = np.empty((B, self._m, self._m, n, n))
        for first in range(0, B, PIECE):
            part = slice(first, first + PIECE)
            gradients[part], hessians[part] = self._piece(part)._expand(g[part], H[part])
        return gradients, hessians

    def nodal_gradient(self, gradient: Array) -> Array:
        """The gradient (B, m, n) of L_d in nodal columns from that at the points, (P, 3, n)."""
        return self._pulled(np.einsum("qri,bqra->bia", self.nodal_table, self._lifted(gradient)))

    def end_gradient(self, gradient: Array) -> Array:
        """As `nodal_gradient`, by (q0, h v0, q1, h v1) alone and without differences of ends."""
        table = _with_base(self.scheme.regular_table)
        g = np.einsum("qri,bqra->bia", table, self._lifted(gradient))[:, :4]
        g[:, 1] -= g[:, 2] + g[:, 3]
        return self._pulled(g)

    def _pulled(self, gradient: Array) -> Array:
        """A gradient in the charts' columns as one in the nodal ones."""
        bends = self.chart.ends(self.ends[:, 0], self.ends[:, 1], gradient[:, 2:4])
        return _pulled_from_ends(gradient[:, None], bends)[:, 0]

    def point_steps(self, step: Array) -> Array:
        """Change of (q, h v, h^2 a) at the points in a nodal step (B, m, n), (B, Q, 3, n)."""
        zero = np.zeros_like(self.ends)
        local = step.copy()
        local[:, 2] -= step[:, 0]
        for bend in self.chart.ends(self.ends[:, 0], self.ends[:, 1], zero):
            i = bend.factor.v
            ends = np.concatenate([step[:, 0, i], step[:, 2, i], step[:, 3, i]], axis=1)
            moved = np.matmul(bend.first, ends[..., None])[..., 0]
            local[:, 2, i], local[:, 3, i] = np.split(moved, 2, axis=1)
        chart = np.einsum("qri,bia->bqra", self.nodal_table, local)
        points = chart[:, :, 1:].copy()
        points[:, :, 0] += chart[:, :, 0]
        for factor, first in self.chart.linear_points(*self._rows):
            i = factor.v
            flat = chart[..., i].reshape(len(first), -1, 1)
            points[..., i] = np.matmul(first, flat).reshape(points[..., i].shape)
        return np.asarray(points)

    def _piece(self, part: slice) -> IntervalCharts:
        return IntervalCharts(self.chart, self.scheme, self.h[part], self.x[part], self.ends[part])

    @property
    def _rows(self) -> tuple[Array, Array, Array]:
        """x, h x' and h^2 x'' as rows (P, n)."""
        n = self.x.shape[-1]
        x, dx, ddx = np.moveaxis(self.x.reshape(-1, 3, n), 1, 0)
        return x, dx, ddx

    @cached_property
    def _point_weights(self) -> Array:
        """h w_j / (1, h, h^2), shape (B, Q, 3)."""
        powers = self.h[:, None] ** -np.arange(3.0)
        return np.asarray(self.h[:, None, None] * self.scheme.weights[:, None] * powers[:, None])

    def _lifted(self, gradient: Array) -> Array:
        """The weighted gradient at the points by (q0, x, h x', h^2 x''), (B, Q, 4, n)."""
        weighted = gradient.reshape(self.x.shape) * self._point_weights[..., None]
        lifted = np.concatenate([weighted[:, :, :1], weighted], axis=2)
        for factor, first in self.chart.linear_points(*self._rows):
            i = factor.v
            flat = weighted[..., i].reshape(len(first), 1, -1)
            lifted[..., i] = np.matmul(flat, first).reshape(lifted[..., i].shape)
        return lifted

    def _expand(self, g: Array, H: Array) -> tuple[Array, Array]:
        B, Q, _, n = self.x.shape
        P, m = B * Q, self._m
        weights = self._point_weights.reshape(P, 3)
        g = g.reshape(P, 3, n) * weights[..., None]
        # h w_j / h^(r + s) = (h w_j / h^r) / h^s
        powers = np.repeat(self.h[:, None] ** -np.arange(3.0), Q, axis=0)
        H = H.reshape(P, 3, n, 3, n) * (
            weights[:, :, None, None, None] * powers[:, None, None, :, None]
        )
        bends = self.chart.points(*self._rows, g)
        lifted = _pulled_from_points(g[:, None], bends)[:, 0]
        half = _pulled_from_points(H.reshape(P, 3 * n, 3, n), bends)  # (P, 3 n, 4, n)
        half = half.reshape(P, 3, n, 4 * n).transpose(0, 3, 1, 2)
        both = _pulled_from_points(half, bends).reshape(P, 4, n, 4, n)
        for bend in bends:
            i, k = bend.factor.v, bend.factor.group.nv
            both[:, :, i, :, i] += bend.second.reshape(P, 4, k, 4, k)
        table = self.nodal_table
        gradient = np.einsum("qri,bqra->bia", table, lifted.reshape(B, Q, 4, n))
        pairs = np.einsum("qri,qsj->ijqrs", table, table).reshape(m * m, -1)
        blocks = both.reshape(B, Q, 4, n, 4, n).transpose(0, 1, 2, 4, 3, 5)
        hessian = np.matmul(pairs, blocks.reshape(B, Q * 16, n * n)).reshape(B, m, m, n, n)
        return self._at_nodes(gradient, hessian)

    def _at_nodes(self, gradient: Array, hessian: Array) -> tuple[Array, Array]:
        """From the charts' columns to the nodal ones."""
        B, m, n = gradient.shape
        bends = self.chart.ends(self.ends[:, 0], self.ends[:, 1], gradient[:, 2:4])
        half = hessian.transpose(0, 1, 3, 2, 4).reshape(B, m * n, m, n)
        half = _pulled_from_ends(half, bends).reshape(B, m, n, m * n).transpose(0, 3, 1, 2)
        both = _pulled_from_ends(half, bends).reshape(B, m, n, m, n)
        for bend in bends:
            i, k = bend.factor.v, bend.factor.group.nv
            second = bend.second.reshape(B, 3, k, 3, k)
            for a, row in enumerate((0, 2, 3)):
                for b, column in enumerate((0, 2, 3)):
                    both[:, row, i, column, i] += second[:, a, :, b]
        return _pulled_from_ends(gradient[:, None], bends)[:, 0], both.transpose(0, 1, 3, 2, 4)


def _with_base(table: Array) -> Array:
    """A table (Q, 3, m) with a row for q0, which moves the chart and nothing in it, (Q, 4, m)."""
    full = np.concatenate([np.zeros_like(table[:, :1]), table], axis=1)
    full[:, :, 0] = 0.0
    full[:, 0, 0] = 1.0
    return full


def _pulled_from_points(covector: Array, bends: list[Bend]) -> Array:
    """Covectors of (q, h v, h^2 a), (P, R, 3, n), by (q0, x, h x', h^2 x'')."""
    P, R = covector.shape[:2]
    pulled = np.concatenate([covector[:, :, :1], covector], axis=2)
    for bend in bends:
        i = bend.factor.v
        flat = covector[..., i].reshape(P, R, -1)
        pulled[..., i] = np.matmul(flat, bend.first).reshape(P, R, 4, -1)
    return pulled


def _pulled_from_ends(covector: Array, bends: list[Bend]) -> Array:
    """Covectors of the charts' columns, (B, R, m, n), as those of the nodal columns."""
    B, R, _, _ = covector.shape
    pulled = covector.copy()
    pulled[:, :, 0] -= covector[:, :, 2]
    for bend in bends:
        i = bend.factor.v
        flat = covector[:, :, 2:4, i].reshape(B, R, -1)
        ends = np.matmul(flat, bend.first).reshape(B, R, 3, -1)
        pulled[:, :, 0, i] = covector[:, :, 0, i] + ends[:, :, 0]
        pulled[:, :, 2:4, i] = ends[:, :, 1:]
    return pulled
