"""The error measures of a work-precision diagram, and thresholds for them."""

from __future__ import annotations

from collections.abc import Callable

from hovi.discrete.measures.motion_error import MotionError
from hovi.system.dataclass import dataclass

_SIZES: dict[str, Callable[[MotionError], float]] = {
    "cost": lambda error: error.cost,
    "joints": lambda error: error.largest_q,
    "tip": lambda error: error.largest_tip,
}
MEASURES = tuple(_SIZES)
"""cost: relative; joints: of all joints, in [rad] or [m]; tip: of all tip_frames, in [m]."""
_DISPLAY_SCALE = {"cost": 1.0, "joints": 1.0, "tip": 1e3}


def size(error: MotionError, measure: str) -> float:
    """The largest error over the whole motion, in the unit of MEASURES."""
    return _SIZES[measure](error)


def shown_size(error: MotionError, measure: str) -> float:
    """The error as displayed and written to files: that of the tip in [mm]."""
    return _DISPLAY_SCALE[measure] * size(error, measure)


def shown_sizes(error: MotionError) -> dict[str, float]:
    """All errors by MEASURES as written to JSON: that of the tip in [mm]."""
    return {measure: shown_size(error, measure) for measure in MEASURES}


@dataclass(frozen=True)
class Thresholds:
    """Upper bounds of errors.

    cost: relative. joints: of every joint, in [rad] or [m]. tip: of all tip_frames, in [m].
    """

    cost: float
    joints: float
    tip: float

    def met_by(self, error: MotionError) -> bool:
        """Whether no error exceeds its threshold."""
        return all(size(error, measure) <= getattr(self, measure) for measure in MEASURES)
