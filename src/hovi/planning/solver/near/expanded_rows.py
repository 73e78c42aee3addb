"""Rows of distances with their derivatives at a path."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

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
    """

    sums: RowSums
    table: Array
    jacobian: Array
    curvature: Array

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
        dq = np.matmul(self.table[:, None], columns[self.sums.intervals])[:, 0]
        return np.asarray(np.vecdot(self.jacobian, dq[self.sums.instant]))

    def pull(self, forces: Array, gradient: Array) -> None:
        """Add the forces on rows, (E,), to a covector in the intervals' columns, (N, m, n)."""
        at = self.sums.by_instant(forces[:, None] * self.jacobian)
        gradient[self.sums.numbers] += self.sums.by_interval(self.table[:, :, None] * at[:, None])

    def add_squares(self, weights: Array, hessian: Array) -> None:
        """Add the weighted squares of rows' changes, and the curvature, to (N, m, m, n, n)."""
        J = self.jacobian
        squares = (weights[:, None] * J)[:, :, None] * J[:, None]
        self.add_at_instants(self.sums.by_instant(squares) + self.curvature, hessian)

    def add_at_instants(self, at: Array, hessian: Array) -> None:
        """Add second derivatives at the instants, (M, nv, nv), to the intervals' Hessians."""
        T, n = self.table, self.jacobian.shape[1]
        both = (T[:, :, None] * T[:, None]).reshape(len(T), -1)
        ends = [*self.sums.begin[1:].tolist(), len(T)]
        for k, first, end in zip(self.sums.numbers, self.sums.begin, ends, strict=True):
            here = slice(first, end)
            product = both[here].T @ at[here].reshape(end - first, -1)
            hessian[k] += product.reshape(T.shape[1], T.shape[1], n, n)
