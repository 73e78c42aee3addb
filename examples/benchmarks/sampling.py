"""Where the time of a call goes, by hovi's own functions, without slowing them down.

A timer interrupts the work every millisecond, and the innermost frame that belongs to hovi is
charged with it, so that NumPy, LAPACK and the kernel count for the function that called them.
Python hears of an interrupt when such a call returns: it is then charged with all that were due.
"""

from __future__ import annotations

import signal
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import hovi

PERIOD = 1e-3  # [s]
PACKAGE = str(Path(hovi.__file__).parent)

PARTS = {
    "kernel": ("dynamics/inverse_dynamics_kernel", "dynamics/point_function"),
    "assembly": (
        "discrete/discrete_lagrangian",
        "scene/lagrangian",
        "dynamics/torque_model",
        "planning/solver/action_objective",
        "discrete/contraction",
    ),
    "factorisation": ("optimize/banded_model", "optimize/merge_tree"),
}
"""Modules of each part; the rest is Python."""
ASSEMBLING = {"assemble", "scatter", "gather"}
"""Functions of the factorising modules that only move numbers."""


def shares(work: Callable[[], Any], seconds: float = 2.0) -> dict[str, float]:
    """Share of each part in the time of many runs of `work`: they sum to 1."""
    charged: Counter[str] = Counter()
    began, heard = time.perf_counter(), 0

    def tick(number: int, frame: FrameType | None) -> None:
        nonlocal heard
        due = int((time.perf_counter() - began) / PERIOD)
        charged[_part(frame)] += due - heard
        heard = due

    before = signal.signal(signal.SIGALRM, tick)
    signal.setitimer(signal.ITIMER_REAL, PERIOD, PERIOD)
    try:
        while time.perf_counter() < began + seconds:
            work()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    return {part: charged[part] / charged.total() for part in (*PARTS, "Python")}


def _part(frame: FrameType | None) -> str:
    while frame is not None and not frame.f_code.co_filename.startswith(PACKAGE):
        frame = frame.f_back
    if frame is None:
        return "Python"
    module = frame.f_code.co_filename.removeprefix(f"{PACKAGE}/").removesuffix(".py")
    if frame.f_code.co_name in ASSEMBLING:
        return "assembly"
    return next((part for part, names in PARTS.items() if module.startswith(names)), "Python")
