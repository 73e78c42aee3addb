"""Clock: the times of a motion as functions of the lengths of parts of it, which are free."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import Condition
from hovi.discrete.grid import Grid
from hovi.discrete.guess import Curve
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import Limits
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.segmented_lagrangian import SegmentedLagrangian
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]
Lengths = Array | float
"""Of the parts, in [s], shape (p,); a number for a single one."""

SAME_LENGTH = 1e-12
"""Relative difference up to which two lengths of time are one."""


@dataclass(frozen=True)
class Clock:
    """Times of a motion of which p parts have free lengths; the times between them are given.

    Times are linear in a part, whose intervals keep their proportions.
    given: how long the motion lasts before the first part, between any two, and after the last, in
        [s]; p + 1 numbers. The single part of the default is the whole motion.
    """

    given: tuple[float, ...] = (0.0, 0.0)

    @classmethod
    def of_parts(cls, count: int) -> Clock:
        """That of a motion in so many parts, with nothing between them."""
        return cls((0.0,) * (count + 1))

    @property
    def whole(self) -> bool:
        """Whether the whole motion is one part."""
        return self.given == (0.0, 0.0)

    @property
    def before(self) -> float:
        """How long the motion lasts before the first part, in [s]."""
        return self.given[0]

    def with_given(self, lengths: Array, given: Mask) -> Clock:
        """The clock with fewer free parts: some of the lengths are given, shape (p,) each."""
        times = [self.given[0]]
        for length, fixed, after in zip(lengths.tolist(), given, self.given[1:], strict=True):
            if fixed:
                times[-1] += length + after
            else:
                times.append(after)
        return Clock(tuple(times))

    def length(self, grid: Grid) -> float:
        """The length of a single part of a motion on a grid, in [s]."""
        before, after = self.given
        return grid.duration - before - after

    def duration(self, lengths: Lengths) -> float:
        """T of the motion, in [s]."""
        return float(self.knots(lengths)[-1])

    def knots(self, lengths: Lengths) -> Array:
        """0, the times at which each part begins and ends, and T, in [s], shape (2 p + 2,)."""
        between = np.zeros(2 * len(self.given))
        between[1::2], between[2::2] = self.given, lengths
        return np.cumsum(between)

    def times(self, t: Array, now: Lengths, lengths: Lengths) -> Array:
        """Where times of a motion with parts of some lengths are with others, in [s]."""
        knots, moved = self.knots(now), self.knots(lengths)
        distinct = np.append(np.diff(knots) > 0, True)
        return np.asarray(np.interp(t, knots[distinct], moved[distinct]))

    def nodes(self, grid: Grid, lengths: Lengths) -> Index:
        """The nodes at which each part of a motion begins and ends, shape (p, 2)."""
        if self.whole:
            return np.array([[0, grid.intervals]])
        ends = self.knots(lengths)[1:-1]
        nearest = np.abs(grid.t - ends[:, None]).argmin(axis=1)
        return np.asarray(nearest.reshape(-1, 2))

    def parts(self, grid: Grid, lengths: Lengths) -> Index:
        """The number of the part of every interval, -1 for none, shape (N,)."""
        parts = np.full(grid.intervals, -1)
        for i, (first, last) in enumerate(self.nodes(grid, lengths)):
            parts[first:last] = i
        return parts

    def ratios(self, grid: Grid, now: Lengths, lengths: Lengths) -> Array:
        """The steps of the grid for other lengths, relative to those of a grid, shape (N,)."""
        grown = np.append(np.atleast_1d(lengths) / np.atleast_1d(now), 1.0)  # 1 for part -1
        return grown[self.parts(grid, now)]

    def grid(self, grid: Grid, now: Lengths, lengths: Lengths) -> Grid:
        """A grid with nodes at both ends of the parts, for other lengths."""
        if self.whole:
            return grid.stretched(self.duration(lengths))
        return Grid(grid.steps * self.ratios(grid, now, lengths), grid.schemes)

    def rates(self, grid: Grid) -> Array:
        """dt/dL of the nodes of a grid, for the length L of a single part, shape (N + 1,)."""
        steps = np.where(self.parts(grid, self.length(grid)) == 0, grid.steps, 0.0)
        return np.asarray(np.append(0.0, np.cumsum(steps)) / steps.sum())

    def lagrangian(self, of: Lagrangian, now: Lengths, lengths: Lengths) -> Lagrangian:
        """The Lagrangian of a motion with other lengths: segments end at other times."""
        if not isinstance(of, SegmentedLagrangian):
            return of
        ends = self.times(np.array(of.ends), now, lengths)
        return dataclasses.replace(of, ends=tuple(ends.tolist()))

    def limits(self, limits: Limits, now: Lengths, lengths: Lengths) -> Limits:
        """Limits of a motion with other lengths: those of segments end at other times."""
        if not limits.parts:
            return limits
        ends = self.times(np.array(limits.ends), now, lengths)
        return dataclasses.replace(limits, ends=tuple(ends.tolist()))

    def via(self, via: Sequence[Via], now: Lengths, lengths: Lengths) -> tuple[Via, ...]:
        """Via points moved along with the parts."""
        times = self.times(np.array([each.time for each in via]), now, lengths).tolist()
        moved = zip(via, times, strict=True)
        return tuple(dataclasses.replace(each, time=t) for each, t in moved)

    def conditions(
        self, given: Sequence[Condition[Any, Any]], now: Lengths, lengths: Lengths
    ) -> tuple[Condition[Any, Any], ...]:
        """Conditions whose parts of the motion move along with the parts."""
        return tuple(self._moved(each, now, lengths) for each in given)

    def _moved(
        self, each: Condition[Any, Any], now: Lengths, lengths: Lengths
    ) -> Condition[Any, Any]:
        if each.during is None:
            return each
        begin, end = self.times(np.array(each.during), now, lengths).tolist()
        return dataclasses.replace(each, during=(begin, end))

    def clearance(self, of: Clearance, now: Lengths, lengths: Lengths) -> Clearance:
        """A clearance whose links are kept clear in parts that move along with the parts."""
        if not of.during:
            return of
        times = self.times(np.array([each[1:] for each in of.during]), now, lengths).tolist()
        names = [name for name, _, _ in of.during]
        moved = [(name, *both) for name, both in zip(names, times, strict=True)]
        return dataclasses.replace(of, during=moved)

    def curve(self, curve: Curve, now: float, length: float, order: int) -> Curve:
        """A motion as a curve with another length of a single part. now: its own, in [s].

        Derivatives up to q^(order); they jump where the part begins and ends.
        """

        def moved(t: Array) -> tuple[Array, ...]:
            t = np.asarray(t)
            part = (t > self.before) & (t < self.before + length)
            rate = np.where(part, now / length, 1.0)[:, None]
            jet = curve(np.clip(self.times(t, length, now), 0.0, self.duration(now)))
            return tuple(x * rate**j for j, x in enumerate(jet[: order + 1]))

        return moved
