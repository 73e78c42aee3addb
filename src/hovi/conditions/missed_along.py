"""By how much a motion misses equations that hold at all times, between the nodes, too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import EVERYWHERE, Condition, EquationAlong
from hovi.conditions.excess import in_words, largest_excess
from hovi.conditions.sets import Near
from hovi.discrete.trajectory import Trajectory

Array = npt.NDArray[np.float64]


class MissedAlong(NamedTuple):
    """By how much a motion misses an equation.

    given: the equation. by_interval: the largest |y - value| of each interval, relative to the
        tolerance, shape (N,).
    entry: of y, the one that is missed most. size: |y - value| there, in the unit of y. time: when,
        in [s].
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
    def missed(self) -> str:
        """By how much and when it is missed most, a clause."""
        unit = self.given.unit and f" {self.given.unit}"
        return f"it is missed by {self.size:.3g}{unit} at t = {self.time:.4g} s"

    @property
    def clause(self) -> str:
        """What is `missed`; "" within the tolerance."""
        return self.missed if self.by_interval.max() > 1.0 else ""


def missed_along(along: Sequence[EquationAlong], motion: Trajectory) -> list[MissedAlong]:
    """What a motion misses of each equation."""
    return [_missed(each, motion) for each in along]


def worst_along(along: Sequence[EquationAlong], motion: Trajectory) -> MissedAlong:
    """The equation, of one or more, that is missed most, relative to its tolerance."""
    return max(missed_along(along, motion), key=lambda each: float(each.by_interval.max()))


def _missed(given: EquationAlong, motion: Trajectory) -> MissedAlong:
    room, names = Near(given.on.value, given.tolerance), (given.name, given.unit)
    more: dict[str, Any] = {"scale": given.tolerance, "of": given.of, "during": given.during}
    accepted = Condition(given.y, room, EVERYWHERE, *names, **more)
    excess, at = largest_excess(motion, accepted)
    side, k, entry = np.unravel_index(int(np.argmax(excess)), excess.shape)
    time = float(motion.t[k] + at[side, k, entry] * motion.grid.steps[k])
    beyond = excess.max(axis=(0, 2)) + 1.0  # the excess is that over what is accepted
    return MissedAlong(given, beyond, int(entry), given.tolerance * float(beyond[k]), time)
