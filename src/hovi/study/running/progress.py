"""How far a study is: rates, failures by reason, and the time that is left."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import field

from hovi.study.running.work import Receipt
from hovi.system.dataclass import dataclass
from hovi.system.progress import reported

RATE_SECONDS = 30.0
"""Time over which the rate is taken, in [s]."""


@dataclass(eq=False)
class StudyProgress:
    """The state of a run.

    count: of all cells. before: how many were done when it began. done: how many are done now.
    failures: of this run, by status. failed: the receipt of the failure that was reported last.
    """

    count: int
    before: int = 0
    done: int = 0
    failures: Counter[str] = field(default_factory=Counter)
    lost: int = 0
    failed: Receipt | None = None
    _times: deque[tuple[float, int]] = field(default_factory=deque)

    def take(self, receipts: int) -> None:
        """Some more plans are done."""
        self.done += receipts
        now = time.monotonic()
        self._times.append((now, self.done))
        while len(self._times) > 2 and now - self._times[0][0] > RATE_SECONDS:
            self._times.popleft()

    @property
    def rate(self) -> float | None:
        """Plans per second over the last time; None as long as that is not known."""
        if len(self._times) < 2:
            return None
        (began, first), (ended, last) = self._times[0], self._times[-1]
        return (last - first) / (ended - began) if ended > began else None

    @property
    def seconds_left(self) -> float | None:
        """Time that the rest takes at this rate, in [s]."""
        rate = self.rate
        return None if not rate else (self.count - self.done) / rate

    @property
    def fraction(self) -> float:
        """The fraction of the cells that is done, in [0, 1]."""
        return self.done / max(self.count, 1)

    def text(self) -> str:
        """In a line."""
        parts = [f"{self.done:,} of {self.count:,} plans"]
        rate, left = self.rate, self.seconds_left
        if rate is not None:
            parts.append(f"{rate:.3g} per second")
        if left is not None:
            parts.append(f"{duration_text(left)} left")
        parts += [f"{number} {status}" for status, number in sorted(self.failures.items())]
        if self.lost:
            parts.append(f"{self.lost} lost with their worker")
        return ", ".join(parts)


OnProgress = Callable[[StudyProgress], None]


@contextmanager
def run_reported(given: OnProgress | None) -> Iterator[OnProgress]:
    """Who a run's state is reported to: what was given, else a line in a notebook, else nobody."""
    if given is not None:
        yield given
        return
    with reported(None, "starting workers") as report:
        yield lambda state: report(state.text(), state.fraction)


def duration_text(seconds: float) -> str:
    """A length of time in words: 12 s, 3 min, 2.5 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
