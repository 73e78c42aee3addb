"""A deadline of known length: work that is expected to end after it is not started."""

from __future__ import annotations

import math

from hovi.errors import InputError
from hovi.system.deadline import Deadline
from hovi.system.interruption import raise_if_interrupted


class Budget(Deadline):
    """A deadline of which parts of the work may take a fraction.

    seconds: its length, positive, in [s]. Raises InputError otherwise.
    """

    def __init__(self, seconds: float) -> None:
        if not (math.isfinite(seconds) and seconds > 0):
            raise InputError(f"the budget must be a positive number of seconds, not {seconds}.")
        super().__init__(seconds)
        self.seconds = seconds

    @property
    def fraction(self) -> float:
        """Fraction of the budget that is spent, at most 1."""
        return min(self.spent / self.seconds, 1.0)

    def left_of(self, fraction: float) -> float:
        """Remaining time of a fraction of the budget, at least 0, in [s]."""
        return max(fraction * self.seconds - self.spent, 0.0)

    def allows(self, seconds: float, fraction: float = 1.0) -> bool:
        """Whether work of this length, in [s], ends within `fraction` of the budget.

        Raises KeyboardInterrupt after an interrupt.
        """
        raise_if_interrupted()
        return super().allows(seconds + (1.0 - fraction) * self.seconds)
