"""Cells: pieces of the intervals of a grid, which are split where something changes in them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

CHANGE = 1.0
"""Largest change of the argument of a function in a cell of time, as in exp(x) or sin(x)."""
FIRST_CELLS = 4
"""Least number of cells of an interval."""
INSTANTS = 2000
"""Least number of instants at which what has no bounds is looked at."""
LEAST_FRACTION = 2.0**-34
"""Shortest cell, relative to the duration."""
SPLIT = 4
"""Pieces into which a cell is split. Most of the time is spent per instruction, not per cell."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of intervals. interval: their numbers. begin, end: in [0, 1], all of shape (P,)."""

    interval: Index
    begin: Array
    end: Array

    @classmethod
    def of(cls, intervals: int, number: int) -> Cells:
        """Equal cells of every interval."""
        k, s = np.repeat(np.arange(intervals), number), np.arange(number) / number
        return cls(k, np.tile(s, intervals), np.tile(s + 1 / number, intervals))

    @classmethod
    def none(cls) -> Cells:
        """No cells."""
        return cls(np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0))

    def lengths(self, steps: Array) -> Array:
        """Their lengths; steps: of all intervals."""
        return np.asarray(steps[self.interval] * (self.end - self.begin))

    def __len__(self) -> int:
        return len(self.begin)

    def chosen(self, which: npt.NDArray[np.bool_] | Index) -> Cells:
        """Some of them."""
        return Cells(self.interval[which], self.begin[which], self.end[which])

    def split(self) -> Cells:
        """SPLIT equal pieces of each."""
        s = np.arange(SPLIT + 1) / SPLIT
        ends = self.begin[:, None] + (self.end - self.begin)[:, None] * s
        k = np.repeat(self.interval, SPLIT)
        return Cells(k, ends[:, :-1].ravel(), ends[:, 1:].ravel())

    def joined(self, others: Cells) -> Cells:
        """These and others."""
        pairs = zip(*((x.interval, x.begin, x.end) for x in (self, others)), strict=True)
        k, begin, end = (np.concatenate(pair) for pair in pairs)
        return Cells(k, begin, end)

    def inside(self, s: Array) -> Array:
        """Positions s in [0, 1] of each cell, as those of its interval, one cell after another."""
        positions = self.begin[:, None] + (self.end - self.begin)[:, None] * s
        return np.clip(positions, 0.0, 1.0).ravel()

    def position(self, cell: Index, s: Array) -> Array:
        """Relative positions s in cells, by their numbers, as those of their intervals."""
        begin, end = self.begin[cell], self.end[cell]
        return np.minimum(begin + s * (end - begin), 1.0)


def between(x: Array) -> tuple[Array, Array]:
    """Bounds of a smooth curve from its ends and its middle, (P, 3, n), with a margin.

    A parabola leaves them by at most a quarter of the middle's distance from the line.
    """
    bend = np.abs(x[:, 1] - 0.5 * (x[:, 0] + x[:, 2]))
    return x.min(axis=1) - bend, x.max(axis=1) + bend
