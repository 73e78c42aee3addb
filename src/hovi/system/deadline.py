"""Time limits, which loops and long computations look at while one is in force.

A computation that may take longer than a second calls `raise_if_late` now and then. Whoever has
something to show for the time so far catches OutOfTimeError and returns it.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from hovi.system.interruption import raise_if_cancelled

_end: ContextVar[float | None] = ContextVar("hovi_deadline", default=None)
"""The end of the deadline in force, by the monotonic clock."""


class OutOfTimeError(Exception):
    """The deadline in force passed in the middle of a computation."""

    def __init__(self) -> None:
        super().__init__("the time limit was reached")


class Deadline:
    """A time limit that starts now, by the monotonic clock.

    seconds: the limit, in [s]; no limit when None.
    """

    def __init__(self, seconds: float | None = None) -> None:
        self._began = time.monotonic()
        self._end = None if seconds is None else self._began + seconds

    @property
    def spent(self) -> float:
        """Time since it was created, in [s]."""
        return time.monotonic() - self._began

    @property
    def seconds_left(self) -> float | None:
        """Time left in [s], 0 once the deadline has passed; None without a limit."""
        return None if self._end is None else max(self._end - time.monotonic(), 0.0)

    @property
    def passed(self) -> bool:
        """Whether the time limit is exceeded."""
        return self._end is not None and time.monotonic() > self._end

    def allows(self, seconds: float) -> bool:
        """Whether work of this length, in [s], would end before the deadline."""
        return self._end is None or time.monotonic() + seconds <= self._end

    def part(self, fraction: float) -> Deadline:
        """A deadline after a fraction, in [0, 1], of the time left."""
        left = self.seconds_left
        return Deadline(None if left is None else fraction * left)

    @contextmanager
    def in_force(self) -> Iterator[None]:
        """`raise_if_late` raises once this deadline has passed, or an outer one in force."""
        ends = [end for end in (self._end, _end.get()) if end is not None]
        token = _end.set(min(ends, default=None))
        try:
            yield
        finally:
            _end.reset(token)


def time_left() -> float | None:
    """Time until the deadline in force in [s], 0 once it has passed; None without one."""
    end = _end.get()
    return None if end is None else max(end - time.monotonic(), 0.0)


def is_late() -> bool:
    """Whether the deadline in force has passed."""
    end = _end.get()
    return end is not None and time.monotonic() > end


def raise_if_late() -> None:
    """Raise OutOfTimeError if the deadline in force has passed, KeyboardInterrupt if cancelled."""
    raise_if_cancelled()
    if is_late():
        raise OutOfTimeError
