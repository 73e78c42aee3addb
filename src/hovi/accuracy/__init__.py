"""Work-precision diagrams: what each further digit costs in time, scheme by scheme."""

from __future__ import annotations

from hovi.accuracy.diagram import MEASURES, Diagram
from hovi.accuracy.reference_motion import MotionError
from hovi.accuracy.resolved_motion import ResolvedMotion
from hovi.accuracy.run import Run
from hovi.accuracy.tolerance_method import Choice
from hovi.accuracy.variational_method import SCHEMES
from hovi.accuracy.work_precision import Peer, Setting, work_precision

__all__ = [
    "MEASURES",
    "SCHEMES",
    "Choice",
    "Diagram",
    "MotionError",
    "Peer",
    "ResolvedMotion",
    "Run",
    "Setting",
    "work_precision",
]
