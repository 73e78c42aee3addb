"""A wall-time budget: work that is expected to exceed it is not started."""

from __future__ import annotations

import math
import time

from hovi.errors import InputError
from hovi.system.interruption import raise_if_interrupted


class Budget:
    """A wall-time budget that starts at construction.

    seconds: its length, positive, in [s]. Raises InputError otherwise.
    """

    def __init__(self, seconds: float) -> None:
        if not (math.isfinite(seconds) and seconds > 0):
            raise InputError(f"the budget must be a positive number of seconds, not {seconds}.")
        self._began, self.seconds = time.monotonic(), seconds

    @property
    def spent(self) -> float:
        """Time since construction, in [s]."""
        return time.monotonic() - self._began

    @property
    def left(self) -> float:
        """Remaining time, at least 0, in [s]."""
        return max(self.seconds - self.spent, 0.0)

    @property
    def fraction(self) -> float:
        """Fraction of the budget that is spent, at most 1."""
        return min(self.spent / self.seconds, 1.0)

    def left_of(self, share: float) -> float:
        """Remaining time of a share of the budget, at least 0, in [s]."""
        return max(share * self.seconds - self.spent, 0.0)

    def allows(self, seconds: float, share: float = 1.0) -> bool:
        """Whether work of this length, in [s], ends within `share` of the budget.

        Raises KeyboardInterrupt after an interrupt.
        """
        raise_if_interrupted()
        return self.spent + seconds <= share * self.seconds
