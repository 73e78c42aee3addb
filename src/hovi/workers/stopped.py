"""Processes that are stopped, as by SIGSTOP, and distinguished from slow ones by their state."""

from __future__ import annotations

import signal
from pathlib import Path

from hovi.system.dataclass import dataclass

LOOK_SECONDS = 1.0
"""Time in [s] between two looks at the workers."""
STOPPED_LOOKS = 10
"""Looks in a row that have to find a worker stopped, before it is given up."""
STOPPED = f"a worker process was stopped, as by {signal.SIGSTOP.name}, for many seconds"


@dataclass()
class Watch:
    """Counts looks at a process that found it stopped.

    Looks and no seconds, so that a worker is not given up where the pool was stopped with it.
    """

    pid: int
    _looks: int = 0

    @property
    def is_stopped(self) -> bool:
        """Whether the process is stopped now."""
        return state_of(self.pid) == "T"

    def looks_stopped(self) -> bool:
        """Look once more: whether the process has been stopped for long."""
        self._looks = self._looks + 1 if self.is_stopped else 0
        return self._looks >= STOPPED_LOOKS


def state_of(pid: int) -> str:
    """The letter by which Linux reports the state of a process; "" where that is not known."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, IndexError):
        return ""
