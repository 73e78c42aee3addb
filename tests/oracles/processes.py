"""Processes as the kernel's /proc tells of them."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

PROC = Path("/proc")
SECONDS = 60.0


def is_running(pid: int) -> bool:
    """Whether a process exists and is no zombie."""
    try:
        return _fields(pid)[0] != "Z"
    except OSError:
        return False


def processor_seconds(pid: int) -> float:
    """Processor time of a process so far, in [s]; 0 for one that has ended."""
    try:
        fields = _fields(pid)
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def children(pid: int) -> list[int]:
    """The running children of a process."""
    found = []
    for folder in PROC.iterdir():
        if folder.name.isdigit() and is_running(int(folder.name)):
            try:
                parent = int(_fields(int(folder.name))[1])
            except OSError:
                continue
            if parent == pid:
                found.append(int(folder.name))
    return found


def wait_until(condition: Callable[[], bool], seconds: float = SECONDS) -> None:
    """Wait until a condition holds. Raises TimeoutError."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"the condition did not hold within {seconds:g} s")
        time.sleep(0.02)


def _fields(pid: int) -> list[str]:
    """The fields of /proc/PID/stat after the name, beginning with the state and the parent."""
    return (PROC / str(pid) / "stat").read_text().rpartition(")")[2].split()
