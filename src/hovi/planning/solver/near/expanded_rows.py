"""Rows of distances with their derivatives at a path."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.discrete.interval_charts import Charts
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

ROUNDING = 1e-12
"""Negative eigenvalue that counts as none, relative to the largest one of all instants."""


@dataclass(frozen=True, eq=False)
class RowSums:
    """Sums over the rows of each instant, and over the instants of each interval.

    instant: of each of E rows, (E,). order: of the rows by their instants. first: where those of
    each instant begin in that order, (M,). intervals: of the M instants, ascending, (M,).
    numbers: the different intervals. begin: where their instants begin.
    """

    instant: Index
    order: Index
    first: Index
    intervals: Index
    numbers: Index
    begin: Index

    @classmethod
    def of(cls, intervals: Index, instant: Index) -> RowSums:
        """intervals: of the instants, ascending, each of which has rows. instant: of the rows."""
        order = np.argsort(instant, kind="stable")
        first = np.flatnonzero(np.diff(instant[order], prepend=-1))
        begin = np.flatnonzero(np.diff(intervals, prepend=-1))
        return cls(instant, order, first, intervals, intervals[begin], begin)

    def by_instant(self, rows: Array) -> Array:
        """Sums over the rows of each instant, (M, ...)."""
        return np.add.reduceat(rows[self.order], self.first, axis=0)

    def by_interval(self, instants: Array) -> Array:
        """Sums over the instants of each of the different intervals."""
        return np.add.reduceat(instants, self.begin, axis=0)


@dataclass(frozen=True, eq=False)
class ExpandedRows:
    """The first derivatives of rows at a path, and the sum of their weighted second ones.

    sums: over the rows. table: of the configurations at the instants over the columns of their
    intervals, (M, m). jacobian: of the rows in these configurations, (E, nv). curvature: sum of
    force y'' at the instants, (M, nv, nv).
    charts: of the instants' intervals, in place of the table; None where they are identities.
    order: k of (q, q', ..., q^(k)), which charts move.
    """

    sums: RowSums
    table: Array
    jacobian: Array
    curvature: Array
    charts: Charts | None
    order: int

    def without_negative_curvature(self) -> ExpandedRows | None:
        """The same with the positive part of the curvature at every instant.

        None if the curvature is positive semidefinite to rounding, or not finite.
        """
        if not np.isfinite(self.curvature).all():
            return None
        values, vectors = np.linalg.eigh(self.curvature)
        if values.min(initial=0.0) >= -ROUNDING * np.abs(values).max(initial=0.0):
            return None
        scaled = vectors * np.maximum(values, 0.0)[:, None]
        return dataclasses.replace(self, curvature=scaled @ vectors.transpose(0, 2, 1))

    def push(self, columns: Array) -> Array:
        """The change of y in a step of the intervals' columns (N, m, n), shape (E,)."""
        step = columns[self.sums.intervals]
        if self.charts is not None:
            dq = self.charts.point_steps(step)[:, 0, 0]
        else:
            dq = np.matmul(self.table[:, None], step)[:, 0]
        return np.asarray(np.vecdot(self.jacobian, dq[self.sums.instant]))

    def pull(self, forces: Array, gradient: Array) -> None:
        """Add the forces on rows, (E,), to a covector in the intervals' columns, (N, m, n)."""
        at = self._at_instants(forces)
        if self.charts is not None:
            pulled = self.charts.nodal_gradient(self._jets(at))
        else:
            pulled = self.table[:, :, None] * at[:, None]
        gradient[self.sums.numbers] += self.sums.by_interval(pulled)

    def add_squares(self, forces: Array, weights: Array, hessian: Array) -> None:
        """Add the weighted squares of rows' changes, and the curvature, to (N, m, m, n, n).

        In charts, that of the configurations with the forces on rows, (E,), as well.
        """
        J = self.jacobian
        squares = (weights[:, None] * J)[:, :, None] * J[:, None]
        at = self.sums.by_instant(squares) + self.curvature
        self._add_at_instants(self._at_instants(forces), at, hessian)

    def add_curvature(self, curvature: Array, hessian: Array) -> None:
        """Add a curvature at the instants, (M, nv, nv), to the intervals' Hessians."""
        self._add_at_instants(np.zeros(curvature.shape[:2]), curvature, hessian)

    def _at_instants(self, forces: Array) -> Array:
        """The forces on rows as those on the configurations, (M, nv)."""
        return self.sums.by_instant(forces[:, None] * self.jacobian)

    def _jets(self, at: Array) -> Array:
        """Covectors of configurations, (M, nv), as those of (q, v, ...), (M, k + 1, nv)."""
        whole = np.zeros((len(at), self.order + 1, at.shape[1]))
        whole[:, 0] = at
        return whole

    def _add_at_instants(self, slopes: Array, at: Array, hessian: Array) -> None:
        """Add derivatives at the instants, (M, nv) and (M, nv, nv), to the intervals' Hessians."""
        T, n = self.table, self.jacobian.shape[1]
        if self.charts is not None:
            size = (self.order + 1) * n
            whole = np.zeros((len(at), size, size))
            whole[:, :n, :n] = at
            _, found = self.charts.expand(self._jets(slopes), whole)
            hessian[self.sums.numbers] += self.sums.by_interval(found)
            return
        both = (T[:, :, None] * T[:, None]).reshape(len(T), -1)
        ends = [*self.sums.begin[1:].tolist(), len(T)]
        for k, first, end in zip(self.sums.numbers, self.sums.begin, ends, strict=True):
            here = slice(first, end)
            product = both[here].T @ at[here].reshape(end - first, -1)
            hessian[k] += product.reshape(T.shape[1], T.shape[1], n, n)
