"""Parts of intervals, on each of which a limited coordinate has its control points."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class LimitedParts:
    """Parts [left, left + width] of intervals, each of one limited coordinate.

    k: numbers of the intervals. coordinate: numbers of the coordinates. Both of shape (L,).
    left, width: relative to the interval, shape (L,).
    """

    k: Index
    coordinate: Index
    left: Array
    width: Array

    @classmethod
    def halved(cls, intervals: int, depth: Index) -> LimitedParts:
        """All intervals, halved so many times for each coordinate. depth: shape (C,)."""
        none, empty = np.zeros(0, dtype=np.intp), np.zeros(0)
        parts = cls(none, none, empty, empty)
        for c, halvings in enumerate(depth):
            count = 2**halvings
            k = np.repeat(np.arange(intervals), count)
            left = np.tile(np.arange(count) / count, intervals)
            own = cls(k, np.full_like(k, c), left, np.full_like(left, 1.0 / count))
            parts = parts.followed_by(own)
        return parts

    def __len__(self) -> int:
        return len(self.k)

    def at(self, chosen: npt.NDArray[Any]) -> LimitedParts:
        """Some of them."""
        return LimitedParts(*(each[chosen] for each in self._arrays))

    def followed_by(self, others: LimitedParts) -> LimitedParts:
        """These, then others."""
        pairs = zip(self._arrays, others._arrays, strict=True)
        return LimitedParts(*(np.concatenate(pair) for pair in pairs))

    def halves(self) -> LimitedParts:
        """Both halves of each."""
        k, coordinate, left, width = (np.repeat(each, 2) for each in self._arrays)
        second = np.arange(len(k)) % 2 == 1
        return LimitedParts(k, coordinate, left + np.where(second, width / 2, 0.0), width / 2)

    @property
    def unique(self) -> tuple[Array, Array, Index]:
        """The different pairs of left and width, and the number of the pair of every part."""
        number = np.rint((1.0 + self.left) / self.width)  # in a tree of halves, 1 at its root
        _, first, which = np.unique(number, return_index=True, return_inverse=True)
        return self.left[first], self.width[first], which

    @property
    def _arrays(self) -> tuple[Any, ...]:
        return self.k, self.coordinate, self.left, self.width
