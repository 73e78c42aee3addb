"""The numbers by which a work-precision diagram judges a motion, and thresholds for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from hovi.discrete.motion_error import MotionError

_SIZES: dict[str, Callable[[MotionError], float]] = {
    "cost": lambda error: error.cost,
    "joints": lambda error: error.largest_q,
    "tip": lambda error: error.largest_tip,
}
MEASURES = tuple(_SIZES)
"""Relative in the cost; of all joints, in [rad] or [m]; of the tip, in [m]."""
_SHOWN = {"cost": 1.0, "joints": 1.0, "tip": 1e3}


def size(error: MotionError, measure: str) -> float:
    """The largest error over the whole motion. measure: in MEASURES, with their units."""
    return _SIZES[measure](error)


def shown_size(error: MotionError, measure: str) -> float:
    """The same as people and files are shown it: of the tip in [mm]."""
    return _SHOWN[measure] * size(error, measure)


def shown_sizes(error: MotionError) -> dict[str, float]:
    """All of them as JSON holds them, by MEASURES: of the tip in [mm]."""
    return {measure: shown_size(error, measure) for measure in MEASURES}


@dataclass(frozen=True)
class Thresholds:
    """Errors that are small enough.

    cost: relative. joints: of every joint, in [rad] or [m]. tip: of the tip frame, in [m].
    """

    cost: float
    joints: float
    tip: float

    def met_by(self, error: MotionError) -> bool:
        """Whether none of the errors is larger."""
        return all(size(error, measure) <= getattr(self, measure) for measure in MEASURES)
