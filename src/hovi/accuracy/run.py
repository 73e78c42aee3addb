"""A run: one method on one grid, its error and its times."""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from typing import Any

from hovi.accuracy.measures import shown_size, size
from hovi.discrete.motion_error import MotionError

ASTRAY = 0.1
"""[rad] or [m] beyond which a motion is taken for another one than that which was looked for."""


@dataclass(frozen=True)
class Run:
    """What one method made of the scene on one grid.

    method, family, order: see Method. intervals: N.
    success, message: what the method said. cost: as it computes it. steps: iterations.
    error: against the resolved motion.
    setup_seconds: building. first_seconds: the first solve. repeats: later solves, one by one.
    """

    method: str
    family: str
    order: int | None
    intervals: int
    success: bool
    message: str
    cost: float
    steps: int
    error: MotionError
    setup_seconds: float
    first_seconds: float
    repeats: tuple[float, ...] = ()

    @property
    def counts(self) -> bool:
        """Whether it found the motion that was looked for: a minimum, and not another one."""
        return self.success and size(self.error, "joints") <= ASTRAY

    @property
    def seconds(self) -> float:
        """A solve when warm: the median of the repeats, or the first where there are none."""
        return statistics.median(self.repeats) if self.repeats else self.first_seconds

    @property
    def best_seconds(self) -> float:
        """The fastest solve: what the machine does when nobody else uses it."""
        return min((*self.repeats, self.first_seconds))

    @property
    def cold_seconds(self) -> float:
        """Building and the first solve."""
        return self.setup_seconds + self.first_seconds

    def to_dict(self) -> dict[str, Any]:
        """As JSON holds it, times in [s]."""
        return {
            "method": self.method,
            "family": self.family,
            "order": self.order,
            "intervals": self.intervals,
            "success": self.success,
            "counts": self.counts,
            "cost": self.cost,
            "cost_error": size(self.error, "cost"),
            "joints_error": size(self.error, "joints"),
            "tip_error_mm": shown_size(self.error, "tip"),
            "steps": self.steps,
            "setup_seconds": self.setup_seconds,
            "first_seconds": self.first_seconds,
            "seconds": self.seconds,
            "best_seconds": self.best_seconds,
            "repeats": list(self.repeats),
            "message": self.message,
        }
