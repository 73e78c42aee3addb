"""A sampling profiler of hovi's own functions.

A timer interrupts the program every millisecond and charges the innermost frame that belongs to
hovi, so that NumPy, LAPACK and the kernel count for the function that called them. Python handles
an interrupt when such a call returns; the call is then charged with all missed periods.
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
ASSEMBLY_FUNCTIONS = {"assemble", "scatter", "gather"}
"""Functions of the factorisation modules that only copy numbers."""


def shares(work: Callable[[], Any], seconds: float = 2.0) -> dict[str, float]:
    """Fraction of each part in the time of many runs of `work`; they sum to 1."""
    charged: Counter[str] = Counter()
    began, handled = time.perf_counter(), 0

    def tick(number: int, frame: FrameType | None) -> None:
        nonlocal handled
        due = int((time.perf_counter() - began) / PERIOD)
        charged[_part(frame)] += due - handled
        handled = due

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
    if frame.f_code.co_name in ASSEMBLY_FUNCTIONS:
        return "assembly"
    return next((part for part, names in PARTS.items() if module.startswith(names)), "Python")
