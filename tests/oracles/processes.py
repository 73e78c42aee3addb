"""Processes as the kernel's /proc tells of them."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

PROC = Path("/proc")
SECONDS = 60.0
_LISTEN = "0A"


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


def descendants(pid: int) -> list[int]:
    """The running children of a process, theirs, and so on."""
    found = children(pid)
    return [*found, *(each for child in found for each in descendants(child))]


def arguments(pid: int) -> list[str]:
    """The command line of a process; empty for one that has ended."""
    try:
        return (PROC / str(pid) / "cmdline").read_text().split("\0")
    except OSError:
        return []


def listening_addresses(pids: Iterable[int]) -> list[str]:
    """Addresses of TCP on which processes listen, in hexadecimal digits as in /proc/net/tcp."""
    sockets = {f"socket:[{row[9]}]": row[1] for row in _tcp_rows() if row[3] == _LISTEN}
    return [sockets[link] for pid in pids for link in _links(pid) if link in sockets]


def _tcp_rows() -> list[list[str]]:
    tables = [PROC / "net" / name for name in ("tcp", "tcp6")]
    return [line.split() for path in tables for line in path.read_text().splitlines()[1:]]


def _links(pid: int) -> list[str]:
    """What the open descriptors of a process are."""
    found = []
    with suppress(OSError):
        for each in (PROC / str(pid) / "fd").iterdir():
            with suppress(OSError):
                found.append(str(each.readlink()))
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
