"""Progress reports: a bar on a terminal, a line in a notebook, occasional plain lines elsewhere."""

from __future__ import annotations

import functools
import inspect
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import copy_context
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar, cast

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
Progress = Callable[[str, float], None]
"""Called with a line of text and the completed fraction, in [0, 1]."""
BAR_DELAY = 1.0
"""Time in [s] before the bar, or the line of a notebook, appears; the period of the latter."""
LINE_PERIOD = 5.0
"""Time in [s] between plain lines."""
WIDTH = 120
"""Characters of a line in a notebook."""


@contextmanager
def progress(quiet: bool, doing: str = "planning") -> Iterator[Progress | None]:
    """The `progress` argument of `hovi.plan`, shown on stderr; None when quiet.

    What was reported last is shown with the time since the beginning, also while nothing new is.
    doing: what is shown until something is reported.
    """
    if quiet:
        yield None
        return
    shown = _progress_bar(doing) if sys.stderr.isatty() else _plain_lines(doing)
    with shown as report:
        yield _harmless(report)


def shows_progress(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A decorator for a function with an argument `progress`, which may be None.

    In a notebook it is then a line under the cell, which appears when the function takes longer
    than a second, and goes when it ends. Elsewhere nothing is shown.
    """

    @functools.wraps(function)
    def showing(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        if not _in_notebook():
            return function(*args, **kwargs)
        given = inspect.signature(function).bind(*args, **kwargs)
        with reported(given.arguments.get("progress")) as report:
            given.arguments["progress"] = report
            return function(*given.args, **given.kwargs)

    return showing


@contextmanager
def reported(given: Progress | None, doing: str = "planning") -> Iterator[Progress]:
    """What was given, else a line in a notebook, else nothing; as `shows_progress`."""
    if given is not None:
        yield given
    elif _in_notebook():
        with _notebook_line(doing) as report:
            yield report
    else:
        yield silent


def silent(text: str, fraction: float) -> None:
    """Report nothing."""


def _in_notebook() -> bool:
    """Whether the cell of a notebook runs; an IPython in a terminal is none."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return shell is not None and hasattr(shell, "kernel")


def _harmless(report: Progress) -> Progress:
    """A report that ends nothing where stderr cannot be written, as when its reader has gone."""

    def reporting(text: str, fraction: float) -> None:
        with suppress(OSError):
            report(text, fraction)

    return reporting


@contextmanager
def _progress_bar(doing: str) -> Iterator[Progress]:
    last = _Last(doing)
    shown: list[Bar] = []

    def show() -> None:
        if not shown:
            shown.append(_bar(last.began))  # before it shows anything, as reports may come
            report(*last.report)
            shown[0].start()

    def report(text: str, fraction: float) -> None:
        last.take(text, fraction)
        for bar in shown:
            described = text.replace("[", r"\[")  # brackets are markup
            bar.update(bar.task_ids[0], description=described, completed=fraction)

    try:
        with _every(BAR_DELAY, show):
            yield report
    finally:
        for bar in shown:
            with suppress(OSError):
                bar.stop()


def _bar(began: float) -> Bar:
    """A bar that began at a time; rich takes longer to import than a small plan."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    bar = Bar(*columns, console=Console(stderr=True), transient=True, get_time=time.monotonic)
    bar.add_task("", total=1.0)
    bar.tasks[0].start_time = began
    return bar


@contextmanager
def _plain_lines(doing: str) -> Iterator[Progress]:
    last = _Last(doing)

    def show() -> None:
        print(last.line(), file=sys.stderr, flush=True)

    with _every(LINE_PERIOD, show):
        yield last.take


@contextmanager
def _notebook_line(doing: str) -> Iterator[Progress]:
    from IPython import display

    last, make_line = _Last(doing), cast(Callable[[], Any], display.DisplayHandle)
    shown: list[Any] = []

    def show() -> None:
        text = {"text/plain": last.line()[:WIDTH]}
        if shown:
            shown[0].update(text, raw=True)
        else:
            shown.append(make_line())
            shown[0].display(text, raw=True)

    try:
        with _every(BAR_DELAY, show):
            yield last.take
    finally:
        for line in shown:
            line.update({"text/plain": "", "text/html": ""}, raw=True)


class _Last:
    """What was reported last."""

    def __init__(self, doing: str) -> None:
        self.began, self._text, self._fraction = time.monotonic(), doing, 0.0

    def take(self, text: str, fraction: float) -> None:
        """A report."""
        self._text, self._fraction = text, fraction

    @property
    def report(self) -> tuple[str, float]:
        """What was reported."""
        return self._text, self._fraction

    def line(self) -> str:
        """With the time since the beginning."""
        seconds = time.monotonic() - self.began
        return f"{100 * self._fraction:3.0f} % {self._text} ({seconds:.0f} s)"


@contextmanager
def _every(seconds: float, action: Callable[[], None]) -> Iterator[None]:
    """Call an action in a thread of its own, again and again until the context ends."""
    ended = threading.Event()

    def repeat() -> None:
        while not ended.wait(seconds):
            with suppress(OSError):  # stderr may be closed
                action()

    thread = threading.Thread(target=copy_context().run, args=(repeat,), daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
