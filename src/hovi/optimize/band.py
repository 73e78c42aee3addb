"""The block-tridiagonal model in LAPACK's banded storage, inner modes included in the band.

Unknowns are ordered node, inner modes, node, ...: H + shift D is then one banded matrix whose
Cholesky factorisation (`pbtrf`) gives the step and decides definiteness at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg.lapack import dpbtrf, dpbtrs

from hovi.optimize.quadratic_model import Factor, IntervalSum, QuadraticModel

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class BandLayout:
    """Where the columns of the intervals stand among the unknowns, and the band's entries.

    unknowns: index of the unknown of every interval's column, shape (N, m, n); -1 where a
        column is fixed.
    size: number of unknowns. bandwidth: of the lower triangle, the diagonal not counted.
    entries: which entries of the intervals' Hessians, laid out flat, the band takes.
    positions: where each of them goes in the band, laid out flat.
    scales: column = scale * unknown, shape (N, m), so that neighbours of different length share
        an unknown; None where every scale is one.
    """

    unknowns: Index
    size: int
    bandwidth: int
    entries: Index
    positions: Index
    scales: Array | None

    @classmethod
    def of(cls, unknowns: Index, scales: Array | None = None) -> BandLayout:
        """The layout of given unknowns.

        Entry (i, j), i >= j, stands at j (bandwidth + 1) + i - j.
        """
        N = len(unknowns)
        flat = unknowns.reshape(N, -1)
        size = int(flat.max()) + 1
        i, j = flat[:, :, None], flat[:, None, :]
        lower = (i >= j) & (j >= 0)
        bandwidth = int(np.max(np.where(lower, i - j, 0)))
        position = (j * (bandwidth + 1) + i - j)[lower]
        # columns (m, n, m, n) of a flat interval Hessian, which is stored as (m, m, n, n)
        m, n = unknowns.shape[1:]
        stored = np.arange(m * m * n * n).reshape(m, m, n, n).transpose(0, 2, 1, 3)
        offset = np.arange(N)[:, None, None] * (m * m * n * n)
        entries = (offset + stored.reshape(m * n, m * n))[lower]
        return cls(unknowns, size, bandwidth, entries, position, scales)

    def assemble(self, hessian: Array) -> Array:
        """The band of a sum over intervals, shape (size, bandwidth + 1): column j at row j."""
        if self.scales is not None:
            pairs = self.scales[:, :, None] * self.scales[:, None, :]
            hessian = hessian * pairs[..., None, None]
        length = self.size * (self.bandwidth + 1)
        band = np.bincount(self.positions, hessian.reshape(-1)[self.entries], minlength=length)
        return np.asarray(band.reshape(self.size, self.bandwidth + 1), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class BandFactor:
    """A banded Cholesky factor."""

    factor: Array

    def solve(self, rhs: Array) -> Array:
        """(H + shift D)^-1 rhs."""
        return np.asarray(dpbtrs(self.factor, rhs, lower=1)[0])


class BandModel(QuadraticModel):
    """A quadratic model whose unknowns are the nodes and the inner modes."""

    def __init__(self, intervals: IntervalSum, layout: BandLayout, metric_band: Array) -> None:
        self.layout = layout
        self._band: Array | None = None
        self._metric_band = metric_band
        super().__init__(intervals)

    def scatter(self, local: Array) -> Array:
        """Sum of the intervals' covectors per unknown, shape (size,)."""
        if self.layout.scales is not None:
            local = local * self.layout.scales[..., None]
        index = self.layout.unknowns.ravel()
        sums = np.bincount(index + 1, local.ravel(), minlength=self.layout.size + 1)
        return np.asarray(sums[1:], dtype=np.float64)

    def gather(self, s: Array) -> Array:
        """Columns of every interval, zero where they are fixed."""
        local = np.append(s, 0.0)[self.layout.unknowns]
        scales = self.layout.scales
        return local if scales is None else np.asarray(local * scales[..., None])

    def factor(self, shift: float) -> Factor | None:
        """Banded Cholesky of H + shift D; None where it fails."""
        if self._band is None:
            self._band = self.layout.assemble(self.intervals.hessian)
        band = self._band if shift == 0.0 else self._band + shift * self._metric_band
        factor, info = dpbtrf(band.T, lower=1, overwrite_ab=int(shift != 0.0))
        return BandFactor(factor) if info == 0 else None

    def negative_eigenvalues(self) -> int:
        """Number of negative eigenvalues of H, by elimination of blocks of the bandwidth's size.

        Each pivot block adds its own count, as Sylvester's law of inertia says (Haynsworth's
        additivity for Schur complements).
        """
        bands = self.layout.assemble(self.intervals.hessian)
        size, block = self.layout.size, max(self.layout.bandwidth, 1)
        count = 0
        schur = np.zeros((0, 0))
        coupling = np.zeros((0, 0))
        for first in range(0, size, block):
            last = min(first + block, size)
            pivot = _dense(bands, range(first, last), range(first, last))
            pivot += np.tril(pivot, -1).T
            if first:
                coupling = _dense(bands, range(first, last), range(first - block, first))
                pivot -= coupling @ np.linalg.solve(schur, coupling.T)
            schur = (pivot + pivot.T) / 2
            count += int(np.sum(np.linalg.eigvalsh(schur) < 0))
        return count


def _dense(bands: Array, rows: range, columns: range) -> Array:
    """The lower triangle's entries of a block, shape (len(rows), len(columns))."""
    i, j = np.array(rows)[:, None], np.array(columns)[None]
    offset = i - j
    inside = (offset >= 0) & (offset < bands.shape[1])
    return np.asarray(np.where(inside, bands[j, np.where(inside, offset, 0)], 0.0))
