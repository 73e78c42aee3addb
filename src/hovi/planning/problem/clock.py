"""Clock: the times of a motion as functions of the length of a part of it, which is free."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.discrete.guess import Curve
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Clock:
    """Times t(L) of a motion with a part of length L: before it they stay, after it they shift.

    The intervals of the part keep their proportions.
    before, after: how long the motion lasts before and after the part, in [s].
    """

    before: float = 0.0
    after: float = 0.0

    @property
    def whole(self) -> bool:
        """Whether the part is the whole motion."""
        return self.before == 0.0 and self.after == 0.0

    def length(self, grid: Grid) -> float:
        """L of a motion on a grid, in [s]."""
        return grid.duration - self.before - self.after

    def duration(self, length: float) -> float:
        """T of the motion, in [s]."""
        return self.before + length + self.after

    def times(self, t: Array, now: float, length: float) -> Array:
        """Where times of a motion with a part of one length are with another one, in [s]."""
        part = np.clip(t - self.before, 0.0, now)
        return np.asarray(t + part * (length / now - 1.0))

    def grid(self, grid: Grid, length: float) -> Grid:
        """A grid with nodes at both ends of the part, for another length."""
        if self.whole:
            return grid.stretched(length)
        first, last = self._nodes(grid)
        steps = grid.steps.copy()
        steps[first:last] *= length / float(steps[first:last].sum())
        return Grid(steps, grid.schemes)

    def rates(self, grid: Grid) -> Array:
        """dt/dL of the nodes of a grid, shape (N + 1,)."""
        first, last = self._nodes(grid)
        steps = np.zeros(grid.intervals)
        steps[first:last] = grid.steps[first:last]
        return np.asarray(np.append(0.0, np.cumsum(steps)) / steps.sum())

    def curve(self, curve: Curve, now: float, length: float, order: int) -> Curve:
        """A motion as a curve with another length of the part. now: its own length, in [s].

        Derivatives up to q^(order); they jump where the part begins and ends.
        """

        def moved(t: Array) -> tuple[Array, ...]:
            t = np.asarray(t)
            part = (t > self.before) & (t < self.before + length)
            rate = np.where(part, now / length, 1.0)[:, None]
            jet = curve(np.clip(self.times(t, length, now), 0.0, self.duration(now)))
            return tuple(x * rate**j for j, x in enumerate(jet[: order + 1]))

        return moved

    def _nodes(self, grid: Grid) -> tuple[int, int]:
        """The nodes at which the part begins and ends."""
        ends = self.before, grid.duration - self.after
        first, last = (int(np.argmin(np.abs(grid.t - end))) for end in ends)
        return first, last
