"""A diagram as a table, as CSV and as JSON."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence

from hovi.accuracy.diagram import Diagram
from hovi.accuracy.measures import MEASURES, shown_size
from hovi.accuracy.run import Run
from hovi.system.files import finite

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
"""Errors of the cost for which the table has a row."""
COLUMNS = (
    "cost error",
    "method",
    "intervals",
    "cost",
    "joints [rad]",
    "tip [mm]",
    "setup [ms]",
    "first [ms]",
    "warm [ms]",
    "steps",
)


def cheapest_rows(
    diagram: Diagram, tolerances: Sequence[float] = TOLERANCES
) -> list[tuple[str, ...]]:
    """The fastest run per tolerance of the relative cost error, in COLUMNS, and plan's default.

    Tolerances below the error of the resolved motion have no row.
    """
    rows = []
    for tolerance in tolerances:
        if tolerance < diagram.resolved.uncertainty.cost:
            break
        run = diagram.cheapest(tolerance)
        if run is None:
            rows.append((f"{tolerance:.0e}", "none so accurate", *[""] * (len(COLUMNS) - 2)))
        else:
            rows.append((f"{tolerance:.0e}", *_cells(run)))
    return [*rows, *_default_row(diagram)]


def _default_row(diagram: Diagram) -> list[tuple[str, ...]]:
    """What `plan` does by default, in COLUMNS; none if it found another motion."""
    choice = diagram.default
    if choice is None or not choice.counts:
        return []
    errors = (f"{shown_size(choice.error, measure):.0e}" for measure in MEASURES)
    times = ("", f"{1e3 * choice.repeats[0]:.3g}", f"{1e3 * choice.seconds:.3g}")
    return [("default", f"plan: {choice.scheme}", str(choice.intervals), *errors, *times, "")]


def _cells(run: Run) -> tuple[str, ...]:
    return (
        run.method,
        str(run.intervals),
        *(f"{shown_size(run.error, measure):.0e}" for measure in MEASURES),
        *(f"{1e3 * x:.3g}" for x in (run.setup_seconds, run.first_seconds, run.seconds)),
        str(run.steps),
    )


def as_csv(diagram: Diagram) -> str:
    """One line per run below a header, with times in [s] by the clock of the last column."""
    rows = [run.to_dict() | {"clock": diagram.clock} for run in diagram.runs]
    stream = io.StringIO()
    writer = csv.DictWriter(stream, [name for name in rows[0] if name != "repeats"])
    writer.writeheader()
    for row in rows:
        writer.writerow({name: row[name] for name in row if name != "repeats"})
    return stream.getvalue()


def as_json(diagram: Diagram) -> str:
    """The diagram as one JSON object; non-finite numbers become null."""
    return json.dumps(finite(diagram.to_dict()), allow_nan=False)
