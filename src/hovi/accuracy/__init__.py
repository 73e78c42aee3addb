"""Work-precision diagrams: error against computing time, scheme by scheme."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

from hovi.accuracy.diagram import Diagram
from hovi.accuracy.measures import MEASURES, Thresholds
from hovi.accuracy.resolved_motion import ResolvedMotion
from hovi.accuracy.run import Run
from hovi.accuracy.tolerance_method import Choice
from hovi.accuracy.variational_method import LIMITED_SCHEMES, SCHEMES
from hovi.accuracy.work_precision import Peer, Setting, work_precision

if TYPE_CHECKING:
    from hovi.discrete.measures.motion_error import MotionError as MotionError

__all__ = [
    "LIMITED_SCHEMES",
    "MEASURES",
    "SCHEMES",
    "Choice",
    "Diagram",
    "Peer",
    "ResolvedMotion",
    "Run",
    "Setting",
    "Thresholds",
    "work_precision",
]


def _deprecated(name: str) -> Any:
    """The deprecated name `MotionError`, to be removed in the next version."""
    if name != "MotionError":
        raise AttributeError(f"module 'hovi.accuracy' has no attribute {name!r}")
    from hovi.discrete.measures.motion_error import MotionError

    warnings.warn(
        "hovi.accuracy.MotionError is now hovi.MotionError, with the tip in metres; pass "
        "hovi.accuracy.Thresholds to work_precision(enough=).",
        DeprecationWarning,
        stacklevel=2,
    )
    return MotionError


if not TYPE_CHECKING:  # otherwise the type checker accepts every misspelt name
    __getattr__ = _deprecated
