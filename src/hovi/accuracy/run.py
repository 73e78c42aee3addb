"""A run: the error and the times of one method on one grid."""

from __future__ import annotations

import statistics
from typing import Any

from hovi.accuracy.measures import shown_size, size
from hovi.discrete.measures.motion_error import MotionError
from hovi.system.dataclass import dataclass

MAX_JOINT_ERROR = 0.1
"""Joint error in [rad] or [m] beyond which the run found another motion."""


@dataclass(frozen=True)
class Run:
    """The result of one method on one grid.

    method, family, order: see Method. intervals: of the final grid.
    success, message, cost: as reported by the method. steps: iterations.
    error: against the resolved motion.
    setup_seconds: setup. first_seconds: first solve. repeats: each later solve. All in
        [s], by the clock of the diagram.
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
        """Whether the run is valid: it ended in a minimum, close to the resolved motion."""
        return self.success and size(self.error, "joints") <= MAX_JOINT_ERROR

    @property
    def seconds(self) -> float:
        """Time of a warm solve: the median of the repeats, or the first if there are none."""
        return statistics.median(self.repeats) if self.repeats else self.first_seconds

    @property
    def best_seconds(self) -> float:
        """Time of the fastest solve, which depends least on other load."""
        return min((*self.repeats, self.first_seconds))

    @property
    def cold_seconds(self) -> float:
        """Time of setup and first solve."""
        return self.setup_seconds + self.first_seconds

    def to_dict(self) -> dict[str, Any]:
        """The JSON form, with times in [s]."""
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
