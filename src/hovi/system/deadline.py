"""What is left of a solve's time."""

from __future__ import annotations

import time


class TimeLeft:
    """The seconds that are left of a limit, which counts from now; None where there is none."""

    def __init__(self, limit: float | None) -> None:
        self._ends = None if limit is None else time.monotonic() + limit

    def __call__(self) -> float | None:
        """Seconds left, 0 where time is up."""
        return None if self._ends is None else max(self._ends - time.monotonic(), 0.0)
