"""The moment at which work has to end."""

from __future__ import annotations

import time


class Deadline:
    """So many seconds from now by the monotonic clock; never when None.

    seconds: from now, in [s].
    """

    def __init__(self, seconds: float | None = None) -> None:
        self._end = None if seconds is None else time.monotonic() + seconds

    @property
    def seconds_left(self) -> float | None:
        """Seconds left, 0 where time is up; None where there is no end."""
        return None if self._end is None else max(self._end - time.monotonic(), 0.0)

    @property
    def passed(self) -> bool:
        """Whether time is up."""
        return self._end is not None and time.monotonic() > self._end

    def part(self, share: float) -> Deadline:
        """The deadline of work that may take a share of what is left."""
        left = self.seconds_left
        return Deadline(None if left is None else share * left)
