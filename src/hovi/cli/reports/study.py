"""What a running study reports on stderr, and how it ended."""

from __future__ import annotations

import dataclasses
import json
import sys
from contextlib import ExitStack, suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from hovi.cli.reports.terminal_table import print_table
from hovi.study.running.progress import duration_text
from hovi.system.files import finite
from hovi.system.progress import progress

if TYPE_CHECKING:
    from hovi.study.running.progress import StudyProgress
    from hovi.study.showing.state import StudyState
    from hovi.study.study import StudyReport
    from hovi.system.progress import Progress

INTERRUPTED = 130
"""Exit code after Ctrl-C."""
WIDTH = 150
"""Characters of a failure's reason that are printed; the table has all of them."""


class Reported:
    """A progress bar with rates and the time left, and a line for each failure."""

    def __init__(self) -> None:
        self._stack = ExitStack()
        self._report: Progress | None = None

    def __enter__(self) -> Self:
        self._report = self._stack.enter_context(progress(quiet=False, doing="starting workers"))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stack.close()

    def take(self, state: StudyProgress) -> None:
        """Show the state of a run."""
        if state.failed is not None:
            failed = state.failed
            reason = failed.reason if len(failed.reason) <= WIDTH else failed.reason[:WIDTH] + "..."
            line = f"cell {failed.number}, {failed.status}: {reason}"
            with suppress(OSError):  # stderr may be closed
                print(line, file=sys.stderr, flush=True)
        elif self._report is not None:
            self._report(state.text(), state.fraction)


def print_ending(report: StudyReport, out: Path) -> int:
    """Print what a run has done; returns the exit code."""
    if report.folder != out.absolute():
        print(f"folder   {out} holds another study, so this one is in {report.folder}")
    print(f"plans    {report.done:,} of {report.count:,} done, {report.new:,} of them now")
    for status, number in report.failures.items():
        print(f"failed   {number:,} {status}")
    for reason in dict.fromkeys(report.lost):
        print(f"given up {report.lost.count(reason):,}: {reason}; start again to try them again")
    print(f"wrote    {report.folder / 'plans.parquet'}")
    if report.interrupted:
        print("interrupted: start it again to do the rest")
        return INTERRUPTED
    return 1 if report.lost else 0


def print_state(state: StudyState, as_json: bool) -> None:
    """Print how far a study is, as one JSON object or in lines."""
    if as_json:
        last = None if state.last is None else state.last.isoformat()
        found = dataclasses.asdict(state) | {"last": last, "seconds_left": state.seconds_left}
        print(json.dumps(finite(found), allow_nan=False))
        return
    print(f"plans    {state.text()}")
    for status, number in state.status.items():
        print(f"{'':9s}{number:,} {status}")
    if state.last is not None:
        print(f"last     {state.last.isoformat(' ', 'seconds')}")


def print_summary(found: dict[str, Any], as_json: bool) -> None:
    """Print the summary of a study, as one JSON object or as a table."""
    if as_json:
        print(json.dumps(finite(found), allow_nan=False))
        return
    print(f"plans    {found['plans']:,}, of which {found['success']:,} are minima")
    if not found["finished"]:
        print(f"{'':9s}so far: the run goes on, or was ended; start it again for the rest")
    for status, number in found["status"].items():
        print(f"{'':9s}{number:,} {status}")
    for word, number in found["cautions"].items():
        print(f"caution  {number:,} minima: {word}")
    if found["irreproducible"]:
        print(f"{'':9s}{found['irreproducible']:,} may depend on a time limit")
    print(f"time     {duration_text(found['seconds'])} in all workers together")
    columns = ("minima", "least", "quarter", "median", "three quarters", "largest")
    quantiles = found["quantiles"].items()
    print_table(columns, [(name, *(f"{x:.4g}" for x in values)) for name, values in quantiles])
    for each in found["worst"][:3]:
        given = "".join(f", {k} = {_shown(v)}" for k, v in each["parameters"].items())
        which = f"key {each['key']}" if each["cell"] is None else f"cell {each['cell']}"
        print(f"worst    {which}: cost {each['cost']:.6g}{given[:WIDTH]}")


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
