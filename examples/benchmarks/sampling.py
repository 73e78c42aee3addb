"""Where the time of a call goes, by hovi's own functions, without slowing them down.

A timer interrupts the work every millisecond; the time since the last interrupt is charged to
the innermost frame that belongs to hovi, so that NumPy, LAPACK and the kernel count for the
function that called them.
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
    "kernel": ("rigid_body/", "point_function"),
    "assembly": ("discrete_lagrangian", "lagrangian", "torque_model", "trajectory_objective"),
    "factorisation": ("optimize/band", "optimize/merge_tree"),
}
"""Modules of each part; the rest is Python."""
ASSEMBLING = {"assemble", "scatter", "gather"}
"""Functions of the factorising modules that only move numbers."""


def shares(work: Callable[[], Any], seconds: float = 2.0) -> dict[str, float]:
    """Share of each part in the time of many runs of `work`: they sum to 1."""
    spent: Counter[str] = Counter()
    last = time.perf_counter()

    def tick(number: int, frame: FrameType | None) -> None:
        nonlocal last
        now = time.perf_counter()
        spent[_part(frame)] += now - last  # type: ignore[assignment]
        last = now

    before = signal.signal(signal.SIGALRM, tick)
    signal.setitimer(signal.ITIMER_REAL, PERIOD, PERIOD)
    try:
        ends = last + seconds
        while time.perf_counter() < ends:
            work()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    total = sum(spent.values())
    return {part: spent[part] / total for part in (*PARTS, "Python")}


def _part(frame: FrameType | None) -> str:
    while frame is not None and not frame.f_code.co_filename.startswith(PACKAGE):
        frame = frame.f_back
    if frame is None:
        return "Python"
    module = frame.f_code.co_filename.removeprefix(f"{PACKAGE}/").removesuffix(".py")
    if frame.f_code.co_name in ASSEMBLING:
        return "assembly"
    return next((part for part, names in PARTS.items() if module.startswith(names)), "Python")
