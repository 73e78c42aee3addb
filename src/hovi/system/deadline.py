"""Time limits."""

from __future__ import annotations

import time


class Deadline:
    """A time limit that starts now, by the monotonic clock.

    seconds: the limit, in [s]; no limit when None.
    """

    def __init__(self, seconds: float | None = None) -> None:
        self._end = None if seconds is None else time.monotonic() + seconds

    @property
    def seconds_left(self) -> float | None:
        """Time left in [s], 0 once the deadline has passed; None without a limit."""
        return None if self._end is None else max(self._end - time.monotonic(), 0.0)

    @property
    def passed(self) -> bool:
        """Whether the time limit is exceeded."""
        return self._end is not None and time.monotonic() > self._end

    def part(self, share: float) -> Deadline:
        """A deadline after a share, in [0, 1], of the time left."""
        left = self.seconds_left
        return Deadline(None if left is None else share * left)
