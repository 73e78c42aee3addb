"""A budget of wall time, kept by starting nothing that is expected to overrun it."""

from __future__ import annotations

import math
import time

from hovi.errors import InputError
from hovi.system.interruption import raise_if_interrupted


class Budget:
    """Wall time from when it was made.

    seconds: all of it, positive. Raises InputError otherwise.
    """

    def __init__(self, seconds: float) -> None:
        if not (math.isfinite(seconds) and seconds > 0):
            raise InputError(f"the budget must be a positive number of seconds, not {seconds}.")
        self._began, self.seconds = time.monotonic(), seconds

    @property
    def spent(self) -> float:
        """Time since it began, in [s]."""
        return time.monotonic() - self._began

    @property
    def left(self) -> float:
        """Time until it ends, at least 0, in [s]."""
        return max(self.seconds - self.spent, 0.0)

    @property
    def fraction(self) -> float:
        """Share that is spent, at most 1."""
        return min(self.spent / self.seconds, 1.0)

    def allows(self, seconds: float, share: float = 1.0) -> bool:
        """Whether work of such a length ends before `share` of it is spent.

        Raises KeyboardInterrupt where a person ended the work before it.
        """
        raise_if_interrupted()
        return self.spent + seconds <= share * self.seconds
