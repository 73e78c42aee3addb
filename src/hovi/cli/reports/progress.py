"""Progress reports: a bar on a terminal, occasional plain lines elsewhere."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hovi.planning.search.job import Progress

BAR_DELAY = 1.0
"""Time in [s] before the bar appears."""
LINE_PERIOD = 5.0
"""Time in [s] between plain lines."""


@contextmanager
def progress(quiet: bool, doing: str = "planning") -> Iterator[Progress | None]:
    """The `progress` argument of `hovi.plan`; None when quiet.

    What was reported last is shown with the time since the beginning, also while nothing new is.
    doing: what is shown until something is reported.
    """
    if quiet:
        yield None
        return
    shown = _progress_bar(doing) if sys.stderr.isatty() else _plain_lines(doing)
    with shown as report:
        yield _harmless(report)


def _harmless(report: Progress) -> Progress:
    """A report that ends nothing where stderr cannot be written, as when its reader has gone."""

    def reporting(text: str, fraction: float) -> None:
        with suppress(OSError):
            report(text, fraction)

    return reporting


@contextmanager
def _progress_bar(doing: str) -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    bar = Bar(*columns, console=Console(stderr=True), transient=True)
    line = bar.add_task(doing, total=1.0)

    def report(text: str, fraction: float) -> None:
        bar.update(line, description=text.replace("[", r"\["), completed=fraction)

    with _every(BAR_DELAY, bar.start):  # again and again, which does nothing
        try:
            yield report
        finally:
            with suppress(OSError):
                bar.stop()


@contextmanager
def _plain_lines(doing: str) -> Iterator[Progress]:
    began, last = time.monotonic(), (doing, 0.0)

    def report(text: str, fraction: float) -> None:
        nonlocal last
        last = text, fraction

    def show() -> None:
        text, fraction = last
        seconds = time.monotonic() - began
        print(f"{100 * fraction:3.0f} % {text} ({seconds:.0f} s)", file=sys.stderr, flush=True)

    with _every(LINE_PERIOD, show):
        yield report


@contextmanager
def _every(seconds: float, action: Callable[[], None]) -> Iterator[None]:
    """Call an action in a thread of its own, again and again until the context ends."""
    ended = threading.Event()

    def repeat() -> None:
        while not ended.wait(seconds):
            with suppress(OSError):  # stderr may be closed
                action()

    thread = threading.Thread(target=repeat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
