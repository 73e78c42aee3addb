"""How far a plan is: a moving line on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

PATIENCE = 1.0  # [s] of silence before the first word
PLAIN_PERIOD = 10.0  # [s] between plain lines

Report = Callable[[str, float], None]


@contextmanager
def progress(quiet: bool) -> Iterator[Report | None]:
    """What `hovi.plan` should report to; None when quiet."""
    if quiet:
        yield None
    elif sys.stderr.isatty():
        with _moving_line() as report:
            yield report
    else:
        yield _plain_lines()


@contextmanager
def _moving_line() -> Iterator[Report]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    line = bar.add_task("", total=1.0)
    began = time.monotonic()

    def report(text: str, fraction: float) -> None:
        if time.monotonic() - began >= PATIENCE:
            bar.start()
        bar.update(line, description=text.replace("[", r"\["), completed=fraction)

    try:
        yield report
    finally:
        bar.stop()


def _plain_lines() -> Report:
    last = time.monotonic()

    def report(text: str, fraction: float) -> None:
        nonlocal last
        if time.monotonic() - last >= PLAIN_PERIOD:
            last = time.monotonic()
            print(f"{100 * fraction:3.0f} % {text}", file=sys.stderr, flush=True)

    return report
