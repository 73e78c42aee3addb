"""The block-tridiagonal model as a band matrix, inner modes included in the band.

Unknowns are ordered node, inner modes, node, ...: H + shift D is then one band matrix whose
Cholesky factorisation gives the step and decides definiteness at once.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi._native import band as native
from hovi.optimize.quadratic_model import Factor, IntervalSum, QuadraticModel
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

PANEL: int = native.panel_columns
"""Columns of the band that are factored together."""
_FIXED = np.zeros(1)
"""Change of a fixed column: the entry appended to a step, at index -1."""


@dataclass(frozen=True, eq=False)
class Runs:
    """Consecutive entries of the intervals' Hessians that are consecutive in the band as well.

    starts, positions: where each run begins in the Hessians and in the band, both laid out flat.
    lengths: number of entries in each. scales: factor of each; one when None.
    """

    starts: Index
    positions: Index
    lengths: Index
    scales: Array | None

    @classmethod
    def of(cls, entries: Index, positions: Index, scales: Array | None) -> Runs:
        """Runs of the given entries; a run never mixes different scales."""
        cut = (np.diff(entries) != 1) | (np.diff(positions) != 1)
        if scales is not None:
            cut |= np.diff(scales) != 0
        first = np.flatnonzero(np.concatenate([[True], cut]))[: len(entries)]
        lengths = np.diff(np.append(first, len(entries)))
        return cls(
            entries[first], positions[first], lengths, None if scales is None else scales[first]
        )

    def unrolled(self) -> tuple[Index, Index, Array | None]:
        """The entries, their positions, and the factor of each; None where all are one."""
        first = np.cumsum(self.lengths) - self.lengths
        inside = np.arange(int(self.lengths.sum())) - np.repeat(first, self.lengths)
        entries = np.repeat(self.starts, self.lengths) + inside
        positions = np.repeat(self.positions, self.lengths) + inside
        scales = None if self.scales is None else np.repeat(self.scales, self.lengths)
        return entries, positions, scales


@dataclass(frozen=True, eq=False)
class BandLayout:
    """The map from the columns of the intervals to the unknowns, and from Hessians to the band.

    unknowns: index of the unknown of every interval's column, shape (N, m, n); -1 where a
        column is fixed.
    size: number of unknowns.
    rows: number of rows of every panel of the band, from the diagonal of its first column to the
        last row that it or an earlier panel reaches, shape (panels,).
    runs: which entries of the intervals' Hessians enter the band, and where.
    scales: column = scale * unknown, shape (N, m), so that adjacent intervals of different length
        fraction an unknown; None where every scale is one.
    """

    unknowns: Index
    size: int
    rows: Index
    runs: Runs
    scales: Array | None

    @classmethod
    def of(cls, unknowns: Index, scales: Array | None = None) -> BandLayout:
        """The layout of given unknowns."""
        N, m, n = unknowns.shape
        flat = unknowns.reshape(N, m * n)
        size = int(flat.max()) + 1
        j, i = flat[:, :, None], flat[:, None, :]
        lower = (i >= j) & (j >= 0)
        rows = panel_rows(flat, size)
        stride = max(rows, default=0)
        positions = (j * stride + i - (j - j % PANEL))[lower]
        # where (m, n, m, n), a column and its rows, is stored as (m, m, n, n)
        stored = np.arange((m * n) ** 2).reshape(m, m, n, n).transpose(0, 2, 1, 3)
        offset = np.arange(N)[:, None, None] * (m * n) ** 2
        entries = (offset + stored.reshape(m * n, m * n))[lower]
        products = None
        if scales is not None:
            columns = np.repeat(scales, n, axis=1)
            products = (columns[:, :, None] * columns[:, None, :])[lower]
        runs = Runs.of(entries, positions, products)
        return cls(unknowns, size, rows, runs, scales)

    @cached_property
    def flat_runs(self) -> Runs:
        """As `runs`, for Hessians of shape (N, m, n, m, n)."""
        _, m, n = self.unknowns.shape
        entries, positions, scales = self.runs.unrolled()
        # where (m, m, n, n) is stored as (m, n, m, n)
        moved = np.arange((m * n) ** 2).reshape(m, n, m, n).transpose(0, 2, 1, 3).ravel()
        interval, inside = np.divmod(entries, (m * n) ** 2)
        entries = interval * (m * n) ** 2 + moved[inside]
        order = np.argsort(entries)
        return Runs.of(entries[order], positions[order], None if scales is None else scales[order])

    @cached_property
    def slots(self) -> Index:
        """1 + the unknown of every column of an interval, flat; 0 where it is fixed."""
        return self.unknowns.ravel() + 1

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Of the band: columns, with those that pad the last panel, and most rows of a panel."""
        return PANEL * len(self.rows), max(self.rows, default=0)

    def assemble(self, hessian: Array) -> Array:
        """The band of a sum over intervals, one column of the lower triangle per row.

        Entry (i, j) is stored at [j, i - i0], with i0 = j - j % 4 the first column of its panel;
        the last panel is padded. Shape (4 panels, maximum rows of a panel).
        hessian: symmetric, shape (N, m, m, n, n).
        """
        return self._assembled(hessian, self.runs)

    def assemble_flat(self, hessian: Array) -> Array:
        """As `assemble`, for shape (N, m, n, m, n)."""
        return self._assembled(hessian, self.flat_runs)

    def _assembled(self, hessian: Array, runs: Runs) -> Array:
        band = np.empty(self.shape)
        native.assemble(hessian, runs.starts, runs.positions, runs.lengths, runs.scales, band)
        return band


def panel_rows(unknowns: Index, size: int) -> Index:
    """Number of rows of every panel, a multiple of its width; the last rows do not decrease.

    unknowns: of every interval, shape (N, m n), -1 where fixed.
    """
    first = np.arange(0, size, PANEL)
    last = np.zeros(len(first), dtype=np.intp)
    lowest = np.broadcast_to(unknowns.max(axis=1, keepdims=True), unknowns.shape)
    free = unknowns >= 0
    np.maximum.at(last, unknowns[free] // PANEL, lowest[free])
    return PANEL * (np.maximum.accumulate(last) // PANEL + 1) - first


@dataclass(frozen=True, eq=False)
class BandFactor:
    """A banded Cholesky factor that stores the reciprocals of its diagonal entries."""

    factor: Array
    rows: Index

    def solve(self, rhs: Array) -> Array:
        """(H + shift D)^-1 rhs."""
        solution = np.empty(rhs.shape)
        native.solve(self.factor, self.rows, np.ascontiguousarray(rhs), solution)
        return solution


class BandModel(QuadraticModel):
    """A quadratic model whose unknowns are the nodes and the inner modes."""

    def __init__(self, intervals: IntervalSum, layout: BandLayout, metric_band: Array) -> None:
        self.layout = layout
        self._band: Array | None = None
        self._last: tuple[float, BandFactor | None] | None = None
        self._metric_band = metric_band
        super().__init__(intervals)

    def scatter(self, local: Array) -> Array:
        """Sum of the intervals' covectors per unknown, shape (size,)."""
        if self.layout.scales is not None:
            local = local * self.layout.scales[..., None]
        sums = np.bincount(self.layout.slots, local.ravel(), minlength=self.layout.size + 1)
        return np.asarray(sums[1:], dtype=np.float64)

    def gather(self, s: Array) -> Array:
        """The columns of every interval, zero where fixed."""
        local = np.concatenate([s, _FIXED])[self.layout.unknowns]
        scales = self.layout.scales
        return local if scales is None else np.asarray(local * scales[..., None])

    def metric_product(self, s: Array) -> Array:
        """D s."""
        product = np.empty(s.shape)
        native.product(self._metric_band, self.layout.rows, np.ascontiguousarray(s), product)
        return product

    def descend(self, factor: Factor, radius: float = math.inf) -> tuple[Array, float, float]:
        """The step, slope and squared length of `QuadraticModel.descend`, in one compiled pass."""
        if not isinstance(factor, BandFactor):
            return super().descend(factor)
        s = np.empty_like(self.gradient)
        slope, length = native.descend(
            factor.factor, factor.rows, self.gradient, self._metric_band, s
        )
        return s, slope, length

    def factor(self, shift: float) -> Factor | None:
        """Banded Cholesky of H + shift D; None where it fails. The last one is kept."""
        if self._last is not None and self._last[0] == shift:
            return self._last[1]
        if self._band is None:
            self._band = self.layout.assemble(self.intervals.hessian)
        factor = np.empty_like(self._band)
        rows = self.layout.rows
        definite = native.factor(
            self._band, self._metric_band, shift, rows, self.layout.size, factor
        )
        self._last = shift, BandFactor(factor, rows) if definite else None
        return self._last[1]

    def negative_eigenvalues(self, border: tuple[Array, Array] | None = None) -> int:
        """Number of negative eigenvalues of H, by elimination of blocks as wide as the band.

        The counts of the pivot blocks add up: Haynsworth's inertia additivity. -1 where one of them
        is singular.
        border: further columns B, (size, p), and their corner C; the count is that of
            [H B; B^T C].
        """
        try:
            return self._negative_pivots(border)
        except np.linalg.LinAlgError:
            return -1

    def _negative_pivots(self, border: tuple[Array, Array] | None) -> int:
        """See negative_eigenvalues. Raises LinAlgError for a singular block."""
        bands = self.layout.assemble(self.intervals.hessian)
        size, block = self.layout.size, max(bands.shape[1], 1)
        count = 0
        schur = np.zeros((0, 0))
        coupling = np.zeros((0, 0))
        columns, corner = np.zeros((size, 0)), np.zeros((0, 0))
        if border is not None:
            columns, corner = border[0].copy(), border[1].copy()
        solved = np.zeros((block, columns.shape[1]))
        for first in range(0, size, block):
            last = min(first + block, size)
            pivot = _dense(bands, range(first, last), range(first, last))
            pivot += np.tril(pivot, -1).T
            if first:
                coupling = _dense(bands, range(first, last), range(first - block, first))
                pivot -= coupling @ np.linalg.solve(schur, coupling.T)
                columns[first:last] -= coupling @ solved
            schur = (pivot + pivot.T) / 2
            if border is not None:
                solved = np.asarray(np.linalg.solve(schur, columns[first:last]), dtype=np.float64)
                corner -= columns[first:last].T @ solved
            count += int(np.sum(np.linalg.eigvalsh(schur) < 0))
        return count + int(np.sum(np.linalg.eigvalsh(corner) < 0))


def _dense(bands: Array, rows: range, columns: range) -> Array:
    """The entries of a block in the lower triangle, shape (len(rows), len(columns))."""
    i, j = np.array(rows)[:, None], np.array(columns)[None]
    offset = i - (j - j % PANEL)
    inside = (i >= j) & (offset < bands.shape[1])
    return np.asarray(np.where(inside, bands[j, np.where(inside, offset, 0)], 0.0))
