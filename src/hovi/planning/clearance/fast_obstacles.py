"""Obstacles that move so fast that samples of a motion may miss them.

A distance changes by no more than shapes travel: between samples d0 and d1 it is at least
(d0 + d1 - L) / 2, with L a bound of the way between them. Where that is too little, the middle is
looked at, which is conservative advancement [MirtichCanny1995].
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from hovi.planning.clearance.distances import Distances
from hovi.planning.clearance.within_reach import ball_of, reach_of
from hovi.planning.obstacles.obstacle import Body
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

STEP = 0.01
"""Way between samples in which a distance may dip by half of it, in [m]."""
EXACT = 5e-7
"""Accuracy of the least distance of a pair, in [m]."""
MAX_SAMPLES = 200_000
"""Maximum number of samples in the gaps between given ones."""


@dataclass(frozen=True, eq=False)
class Between:
    """Distances between samples.

    t: times, in [s]. column: of the pair. value: in [m]. way: until then, in [m]. All (C,).
    """

    t: Array
    column: Index
    value: Array
    way: Array

    def apart(self, below: float) -> Between:
        """Those below a distance, in [m], the least ones first, with a STEP between them."""
        kept: list[int] = []
        for i in np.argsort(self.value):
            if self.value[i] >= below:
                break
            others = [j for j in kept if self.column[j] == self.column[i]]
            if not others or np.abs(self.way[others] - self.way[i]).min() >= STEP:
                kept.append(int(i))
        return Between(self.t[kept], self.column[kept], self.value[kept], self.way[kept])


@dataclass(frozen=True, eq=False)
class _Gaps:
    """Times between samples of pairs.

    first, last: times, in [s]. column: of the pair. begin, end: distances there, in [m]. All (C,).
    """

    first: Array
    last: Array
    column: Index
    begin: Array
    end: Array

    @property
    def middle(self) -> Array:
        """The times in their middles."""
        return 0.5 * (self.first + self.last)

    def lowest(self, way: Array) -> Array:
        """What the distances are at least. way: of the shapes, in [m]."""
        return 0.5 * (self.begin + self.end - way)

    def chosen(self, which: npt.NDArray[np.bool_]) -> _Gaps:
        """Some of them."""
        ends = self.begin[which], self.end[which]
        return _Gaps(self.first[which], self.last[which], self.column[which], *ends)

    def halves(self, value: Array) -> _Gaps:
        """Both halves of each. value: the distances in the middles."""
        first, last = np.append(self.first, self.middle), np.append(self.middle, self.last)
        ends = np.append(self.begin, value), np.append(value, self.end)
        return _Gaps(first, last, np.tile(self.column, 2), *ends)


def _columns(d: Array) -> tuple[Array, Array]:
    """Distances at the begin and the end of each gap, pair by pair. d: at the samples, (M, K)."""
    return d[:-1].T.ravel(), d[1:].T.ravel()


@dataclass(frozen=True, eq=False)
class FastPairs:
    """Pairs with an obstacle that moves by more than STEP between samples.

    numbers: of the pairs. ends: of their obstacles. t: of the samples, ascending, (M,), in [s].
    robot_way: what any point of the robot has travelled at most until each, (M,), in [m].
    """

    distances: Distances
    numbers: Index
    ends: Index
    t: Array
    robot_way: Array

    @classmethod
    def of(cls, distances: Distances, t: Array, q: Array) -> FastPairs | None:
        """Those of some distances; None without any. q: configurations at t, (M, nq)."""
        ends = np.array([end for _, end in distances.ends])
        if not distances.paths:
            return None
        fast = [
            end
            for end in np.unique(ends).tolist()
            if end in distances.moving and np.diff(_way(distances, end, t)).max(initial=0.0) > STEP
        ]
        numbers = np.flatnonzero(np.isin(ends, fast))
        if len(numbers) == 0:
            return None
        return cls(distances, numbers, ends[numbers], t, _way_of_robot(distances, q))

    def between(self, d: Array, least: float, measure: Callable[[Array, Index], Array]) -> Between:
        """Distances at times between samples at which these pairs may be nearer than `least`.

        The least one of each pair is found to EXACT, if it is below that.
        d: at the samples, (M, K), in [m]. measure: distances at times (C,) of pairs by their places
        among these, (C,).
        """
        K = len(self.numbers)
        ends = np.tile(self.t[:-1], K), np.tile(self.t[1:], K)
        gaps = _Gaps(*ends, np.repeat(np.arange(K), len(self.t) - 1), *_columns(d))
        gaps = gaps.chosen(self._way_in(gaps) > STEP)
        best, number = d.min(axis=0), 0
        seen = [(np.zeros(0), np.zeros(0, dtype=np.intp), np.zeros(0))]
        while number < MAX_SAMPLES:
            way, near = self._way_in(gaps), best[gaps.column] < least
            target = np.where(near, best[gaps.column] - EXACT, least)
            gaps = gaps.chosen((gaps.lowest(way) < target) & ((way > STEP) | near))
            if len(gaps.first) == 0:
                break
            value = measure(gaps.middle, gaps.column)
            seen.append((gaps.middle, gaps.column, value))
            np.minimum.at(best, gaps.column, value)
            gaps, number = gaps.halves(value), number + len(value)
        t, column, value = (np.concatenate(each) for each in zip(*seen, strict=True))
        return Between(t, column, value, self._way(t, column))

    def _way_in(self, gaps: _Gaps) -> Array:
        """What shapes travel in gaps at most, in [m]."""
        return self._way(gaps.last, gaps.column) - self._way(gaps.first, gaps.column)

    def _way(self, t: Array, column: Index) -> Array:
        """What the shapes of pairs have travelled at most until times, (C,) each, in [m]."""
        way, of = np.interp(t, self.t, self.robot_way), self.ends[column]
        for end in np.unique(of).tolist():
            way[of == end] += _way(self.distances, end, t[of == end])
        return np.asarray(way)


def _way(distances: Distances, end: int, t: Array) -> Array:
    """What any point of an obstacle has travelled at most until times, (M,), in [m]."""
    item = distances.geometry.geometryObjects[end]
    center, radius = ball_of(Body(item.geometry, item.placement))
    way, angle = distances.paths[distances.moving[end]].travelled(t)
    lever = float(np.linalg.norm(center)) + radius
    return np.asarray(way + (lever if np.isfinite(lever) else 0.0) * angle)


def _way_of_robot(distances: Distances, q: Array) -> Array:
    """That of any point of the robot until each configuration.

    0 where it is not bounded: its links move little between samples.
    """
    reach = reach_of(distances.robot)
    if not np.isfinite(reach):
        return np.zeros(len(q))
    steps = np.abs(distances.robot.difference(q[:-1], q[1:])).sum(axis=1)
    return np.asarray(reach * np.concatenate([[0.0], np.cumsum(steps)]))
