"""Progress reports: a bar on a terminal, occasional plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hovi.planning.search.job import Progress

BAR_DELAY = 1.0  # [s] before the bar appears
LINE_PERIOD = 10.0  # [s] between plain lines


@contextmanager
def progress(quiet: bool) -> Iterator[Progress | None]:
    """The `progress` argument of `hovi.plan`; None when quiet."""
    if quiet:
        yield None
    elif sys.stderr.isatty():
        with _progress_bar() as report:
            yield _harmless(report)
    else:
        yield _harmless(_plain_lines())


def _harmless(report: Progress) -> Progress:
    """A report that ends nothing where stderr cannot be written, as when its reader has gone."""

    def reporting(text: str, fraction: float) -> None:
        with suppress(OSError):
            report(text, fraction)

    return reporting


@contextmanager
def _progress_bar() -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    bar = Bar(*columns, console=Console(stderr=True), transient=True)
    line = bar.add_task("", total=1.0)
    began = time.monotonic()

    def report(text: str, fraction: float) -> None:
        if time.monotonic() - began >= BAR_DELAY:
            bar.start()
        bar.update(line, description=text.replace("[", r"\["), completed=fraction)

    try:
        yield report
    finally:
        with suppress(OSError):
            bar.stop()


def _plain_lines() -> Progress:
    last = time.monotonic()

    def report(text: str, fraction: float) -> None:
        nonlocal last
        if time.monotonic() - last >= LINE_PERIOD:
            last = time.monotonic()
            print(f"{100 * fraction:3.0f} % {text}", file=sys.stderr, flush=True)

    return report
