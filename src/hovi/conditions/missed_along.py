"""By how much a motion misses equations that hold at all times, between the nodes, too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import EVERYWHERE, Condition, EquationAlong
from hovi.conditions.excess import in_words, largest_excess
from hovi.conditions.function import Function, Points, Slopes
from hovi.conditions.sets import Near
from hovi.discrete.trajectory import Trajectory

Array = npt.NDArray[np.float64]


class MissedAlong(NamedTuple):
    """By how much a motion misses an equation.

    given: the equation. by_interval: the largest |y - value| of each interval, relative to the
        tolerance, shape (N,): of one entry of y where these have names, else of all together.
    entry: of y, the named one that is missed most. size: |y - value|, in the unit of y. time: when,
        in [s].
    """

    given: EquationAlong
    by_interval: Array
    entry: int
    size: float
    time: float

    @property
    def subject(self) -> str:
        """What is missed, in a sentence."""
        given = self.given
        return in_words(given, self.entry) if given.of else f"condition {given.name!r}"

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


class _SquaredDistance(Function):
    """|y - value|^2 of an equation, relative to its tolerance."""

    def __init__(self, given: EquationAlong) -> None:
        self.given = given

    @property
    def needs(self) -> frozenset[str]:
        """See Function."""
        return self.given.y.needs

    @property
    def size(self) -> int:
        """See Function."""
        return 1

    def values(self, at: Points) -> Array:
        """See Function."""
        beyond = self._beyond(at)
        return np.asarray(np.vecdot(beyond, beyond)[:, None])

    def slopes(self, at: Points) -> Slopes:
        """See Function."""
        weights = 2.0 / self.given.tolerance * self._beyond(at)[:, None]
        return {x: np.matmul(weights, J) for x, J in self.given.y.slopes(at).items()}

    def _beyond(self, at: Points) -> Array:
        return self.given.on.missed(self.given.y.values(at)) / self.given.tolerance


def _missed(given: EquationAlong, motion: Trajectory) -> MissedAlong:
    y, room, scale = given.y, Near(given.on.value, given.tolerance), given.tolerance
    if not given.of:
        y, room, scale = _SquaredDistance(given), Near(0.0, 1.0), 1.0
    more: dict[str, Any] = {"scale": scale, "of": given.of, "during": given.during}
    accepted = Condition(y, room, EVERYWHERE, given.name, given.unit, **more)
    excess, at = largest_excess(motion, accepted)
    side, k, entry = np.unravel_index(int(np.argmax(excess)), excess.shape)
    time = float(motion.t[k] + at[side, k, entry] * motion.grid.steps[k])
    beyond = np.maximum(excess.max(axis=(0, 2)) + 1.0, 0.0)  # the excess is that over the room
    beyond = beyond if given.of else np.sqrt(beyond)
    return MissedAlong(given, beyond, int(entry), given.tolerance * float(beyond[k]), time)
