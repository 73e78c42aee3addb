"""Intervals of one scheme, evaluated together: (q, v, a) at their quadrature points."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.interval_paths import interpolate, interpolate_any
from hovi.schemes import Scheme
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Jet = tuple[Array, ...]
"""(q, v, a) at points, each of shape (P, n); (q, q', ..., q^(k)) for order k."""
Coordinates = Literal["nodal", "regular"]
COORDINATES: tuple[Coordinates, ...] = ("nodal", "regular")

CHUNK = 4096
"""Maximum number of intervals per batch, which bounds the memory."""


@dataclass(frozen=True, eq=False)
class IntervalBatch:
    """Intervals of one scheme, evaluated together.

    numbers: of the intervals, shape (B,). index: the same, as a slice if they are consecutive.
    h: their lengths, shape (B,), in [s]. t: times of the points, shape (B Q,), in [s].
    """

    scheme: Scheme
    numbers: Index
    index: Index | slice
    h: Array
    t: Array

    @property
    def points(self) -> int:
        """Q, the number of quadrature points of an interval."""
        return len(self.scheme.weights)

    @property
    def modes(self) -> int:
        """r, the number of inner modes of an interval."""
        return self.scheme.inner_modes

    @property
    def contraction_weights(self) -> Array:
        """w_j, shape (Q,)."""
        return self.scheme.weights

    def add(self, parts: Array, sums: Array) -> None:
        """Write what belongs to these intervals into what belongs to all, which is zero there."""
        sums[self.index] = parts

    @cached_property
    def tables(self) -> dict[Coordinates, Array]:
        """The scheme's table for both kinds of coordinates, (Q, k + 1, m)."""
        return {"nodal": self.scheme.nodal_table, "regular": self.scheme.regular_table}

    @cached_property
    def row_weights(self) -> Array:
        """h w_j / (1, h, ..., h^k) per point and derivative, (B, Q, k + 1)."""
        powers = self.h[:, None] ** -np.arange(self._rows)  # (B, k + 1)
        return self.h[:, None, None] * self.scheme.weights[:, None] * powers[:, None, :]

    @cached_property
    def weights(self) -> Array:
        """h w_j per point, (B, Q)."""
        return self.h[:, None] * self.scheme.weights

    def sums(self, values: Array) -> Array:
        """h sum_j w_j L_j of every interval from L at the points, (B,)."""
        return np.asarray(np.vecdot(values.reshape(self.weights.shape), self.weights))

    @cached_property
    def step_tables(self) -> dict[Coordinates, Array]:
        """(q, v, a) at the points over the columns of both coordinates, (B or 1, 3 Q, m)."""
        h = self.h[:1] if np.ptp(self.h) == 0 else self.h
        powers = h[:, None, None, None] ** -np.arange(float(self._rows))[:, None]
        rows = self._rows * len(self.scheme.weights)
        return {
            name: (table * powers).reshape(len(powers), rows, -1)
            for name, table in self.tables.items()
        }

    def jet(self, path: DiscretePath) -> Jet:
        """(q, v, a) at the quadrature points, each of shape (B * Q, n).

        The chart of an interval is the identity: q = q0 + x.
        """
        if self.scheme.derivatives != 2:
            return interpolate_any(self.scheme.table, self.h, self.numbers, path)
        q, v, a = interpolate(self.scheme.table, self.h, self.numbers, path.arrays)
        return q, v, a

    @property
    def _rows(self) -> int:
        """k + 1 derivatives."""
        return self.scheme.derivatives + 1

    def local(self, path: DiscretePath) -> Array:
        """(x, x', x'') of q = q0 (+) x at the quadrature points, shape (3, B Q, n).

        For any order k max(k, 2) derivatives, where x'' = 0 for k = 1.
        """
        still = np.zeros_like(path.v)
        if self.scheme.derivatives != 2:
            moving = DiscretePath(still, path.v, path.z, path.inner, path.higher)
            x = np.stack(interpolate_any(self.scheme.table, self.h, self.numbers, moving))
            return x if len(x) > 2 else np.append(x, np.zeros_like(x[:1]), axis=0)
        local = still, path.v, path.z, path.inner
        return interpolate(self.scheme.table, self.h, self.numbers, local)

    def contracted(self, gradient: Array, coordinates: Coordinates) -> Array:
        """Gradient of L_d in the columns of the coordinates from that of L, shape (B, m, n)."""
        Q, _, m = self.tables[coordinates].shape
        rows = self._rows
        weighted = gradient.reshape(len(self.h), Q, rows, -1) * self.row_weights[..., None]
        table = self.tables[coordinates].reshape(Q * rows, m)
        return np.asarray(np.matmul(table.T, weighted.reshape(len(self.h), Q * rows, -1)))


def interval_batches(grid: Grid, segments: Index | None = None) -> Iterator[IntervalBatch]:
    """Batches of at most CHUNK intervals, each of one scheme.

    segments: number of the segment of every interval, (N,): a batch is in one of them.
    """
    t0, groups = grid.t, grid.groups
    if segments is not None:
        parts = ((scheme, index, segments[index]) for scheme, index in groups)
        groups = tuple((s, i[of == part]) for s, i, of in parts for part in np.unique(of))
    for scheme, index in groups:
        for first in range(0, len(index), CHUNK):
            numbers = index[first : first + CHUNK]
            alone = len(groups) == 1
            chosen = slice(first, first + len(numbers)) if alone else numbers
            h = grid.steps[chosen]
            t = t0[:-1][chosen][:, None] + h[:, None] * scheme.points
            yield IntervalBatch(scheme, numbers, chosen, h, t.ravel())
