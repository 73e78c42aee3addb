"""By how much a motion misses equations that hold at all times, between the nodes, too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.planning.conditions.condition import EquationAlong, near
from hovi.planning.conditions.excess import in_words, largest_excess

Array = npt.NDArray[np.float64]


class MissedAlong(NamedTuple):
    """By how much a motion misses an equation.

    by_interval: the largest |y - value| of each interval, relative to the tolerance, shape (N,).
    entry: of y, with the largest of all. size: |y - value| there. time: when, in [s].
    """

    given: EquationAlong
    by_interval: Array
    entry: int
    size: float
    time: float

    @property
    def subject(self) -> str:
        """The entry, in a sentence."""
        return in_words(self.given, self.entry)

    @property
    def clause(self) -> str:
        """What the motion misses; "" if it is within the tolerance."""
        if self.by_interval.max() <= 1.0:
            return ""
        unit = self.given.unit and f" {self.given.unit}"
        return f"it is missed by {self.size:.3g}{unit} at t = {self.time:.4g} s"


def missed_along(along: Sequence[EquationAlong], motion: Trajectory) -> list[MissedAlong]:
    """What a motion misses of each equation."""
    return [_missed(each, motion) for each in along]


def worst_along(along: Sequence[EquationAlong], motion: Trajectory) -> MissedAlong:
    """The equation, of one or more, that is missed most, relative to its tolerance."""
    return max(missed_along(along, motion), key=lambda each: float(each.by_interval.max()))


def _missed(given: EquationAlong, motion: Trajectory) -> MissedAlong:
    excess, at = largest_excess(motion, near(given))
    beyond = excess.max(axis=0) + 1.0  # the excess over what is accepted
    k, entry = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
    side = int(np.argmax(excess[:, k, entry]))
    time = float(motion.t[k] + at[side, k, entry] * motion.grid.steps[k])
    size = given.tolerance * float(beyond[k, entry])
    return MissedAlong(given, beyond.max(axis=1), int(entry), size, time)
