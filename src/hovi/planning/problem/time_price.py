"""TimePrice: the price of time, and the bounds of what is free of it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.planning.problem.clock import Clock
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class TimePrice:
    """The price of time, and the bounds of the lengths of the free parts of a motion.

    weight: w, in cost per [s]. lower, upper: in [s], shape (p,). clock: which parts.
    """

    weight: float
    lower: Array
    upper: Array
    clock: Clock

    def with_given(self, lengths: Array, given: Mask) -> TimePrice:
        """The price where some of the lengths are given, (p,) each."""
        clock, free = self.clock.with_given(lengths, given), ~given
        return TimePrice(self.weight, self.lower[free], self.upper[free], clock)

    def of(self, lengths: Array) -> float:
        """w times the sum of the lengths."""
        return self.weight * float(lengths.sum())

    def room(self, lengths: Array) -> tuple[Array, Array]:
        """The least and the largest steps of log L at lengths within the bounds, (p,) each."""
        low, high = np.log(self.lower / lengths), np.log(self.upper / lengths)
        return np.minimum(low, 0.0), np.maximum(high, 0.0)

    def after(self, lengths: Array, step: Array) -> Array:
        """The lengths after a step of their logarithms, in [s]; exactly bounds where it ends."""
        low, high = self.room(lengths)
        moved = np.where(step <= low, self.lower, lengths * np.exp(step))
        return np.where(step >= high, self.upper, moved)
