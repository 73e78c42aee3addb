"""How far a study is, read from its folder while it runs or after it ended."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from hovi.errors import StudyError
from hovi.study.running.progress import RATE_SECONDS, duration_text
from hovi.study.storage.folder import About, in_use
from hovi.study.storage.journal import FOLDER, LINES, entry_of
from hovi.system.dataclass import dataclass
from hovi.system.files import reason


@dataclass(frozen=True)
class StudyState:
    """How far a study is.

    running: whether a run is working on it now. done, count: plans that are done, and all; the
        count is None where an earlier version of hovi began it.
    status: of the plans that are done, how many ended with which.
    rate: plans per second over the last half minute of work; None for fewer than two plans.
    last: when the last plan was done; None for none.
    """

    running: bool
    done: int
    count: int | None
    status: dict[str, int]
    rate: float | None
    last: datetime | None

    @property
    def seconds_left(self) -> float | None:
        """Time that the rest takes at this rate, in [s]; None where that is not known."""
        if self.count is None or not self.rate:
            return None
        return max(self.count - self.done, 0) / self.rate

    @classmethod
    def read(cls, folder: Path) -> StudyState:
        """The state of a folder, which is only read. Raises StudyError if it holds no study."""
        about = About.read(folder)
        if about is None:
            raise StudyError(f"there is no study in {folder}: give the folder of --out.")
        status, ends = dict[str, str](), list[datetime]()
        for entry in _entries(folder):
            try:
                row, run = entry["row"], entry["run"]
                if row is not None:
                    status[str(entry["key"])] = str(row["status"])
                    began = datetime.fromisoformat(run["began"])
                    ends.append(began + timedelta(seconds=run["seconds"]))
            except (KeyError, TypeError, ValueError):
                continue  # of another version
        counts = dict(Counter(status.values()).most_common())
        last = max(ends, default=None)
        return cls(in_use(folder), len(status), about.count, counts, _rate(ends), last)

    def text(self) -> str:
        """In a line."""
        parts = [f"{self.done:,}" + ("" if self.count is None else f" of {self.count:,}") + " done"]
        if self.running and self.rate is not None:
            parts.append(f"{self.rate:.3g} per second")
            if self.seconds_left is not None:
                parts.append(f"{duration_text(self.seconds_left)} left")
        if not self.running:
            complete = self.done == self.count
            parts.append("complete" if complete else "no run is working on it")
        return ", ".join(parts)


def _entries(folder: Path) -> Iterator[dict[str, Any]]:
    try:
        for path in sorted((folder / FOLDER).glob(f"*{LINES}")):
            with path.open("rb") as stream:
                yield from filter(None, map(entry_of, stream))
    except OSError as refused:
        raise StudyError(f"the study in {folder} cannot be read: {reason(refused)}.") from None


def _rate(ends: list[datetime]) -> float | None:
    """Plans per second in the last time in which any ended."""
    if not ends:
        return None
    last = max(ends)
    recent = [each for each in ends if (last - each).total_seconds() <= RATE_SECONDS]
    span = (last - min(recent)).total_seconds()
    return (len(recent) - 1) / span if span > 0 else None
