"""Work-precision diagrams of hovi and the reference tools on the same scenes, in one run.

It prints the table of time ratios and plots the diagrams of the docs. Crocoddyl and Drake run in
environments of their own, whose Pythons are given by options or by HOVI_CROCODDYL_PYTHON and
HOVI_DRAKE_PYTHON:

    python -m venv crocoddyl && crocoddyl/bin/pip install crocoddyl==3.2.1 pin==4.0.0
    python -m venv drake && drake/bin/pip install drake

(Crocoddyl 3.2.1 with pin 4.1.0 silently ignores gravity; its worker checks for that.)
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from measuring import alone, print_machine, print_table

import hovi
from hovi.accuracy import Diagram, Run, Thresholds, work_precision
from hovi.accuracy.peers.ipopt_method import ipopt_peers
from hovi.accuracy.peers.tools import tool_peers
from hovi.accuracy.picture import plot_work_precision
from hovi.accuracy.tables import as_json

SCENES = ("two_link_reach", "ur5_reach", "panda_reach")
BUDGET_FACTORS = {"two_link_reach": 0.4}
IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9)
REPEATS = 4
SUFFICIENT_ERRORS = Thresholds(cost=1e-11, joints=1e-6, tip=1e-5)
INTERPRETED = ("hermite-simpson", "lg-3", "lg-5", "lgr-5")
INTRODUCTION = """\
Every solve starts near the motion (nine tenths of it, one tenth of the cubic). *Warm* is the
fastest of up to five solves, *cold* is building, compiling included, and the first solve, both in
processor time, since other work ran on the machine. A method has an accuracy when the error of the
cost stays below it on all finer grids too; - where none of its grids within the time had it."""


def measure(
    scene: str, budget: float, crocoddyl: str | None, drake: str | None, kernels: str | None
) -> Diagram:
    """The diagram of all methods on one scene; its figure is written to the docs."""
    folder = None if kernels is None else Path(kernels)
    peers = [*ipopt_peers(compiled=True, folder=folder)]
    peers += [*ipopt_peers(compiled=False, schemes=INTERPRETED)]
    peers += tool_peers("crocoddyl", Path(crocoddyl)) if crocoddyl else []
    peers += tool_peers("drake", Path(drake)) if drake else []

    def progress(text: str, fraction: float) -> None:
        print(f"{scene} {100 * fraction:3.0f} % {text}", file=sys.stderr, flush=True)

    task = hovi.load_task(hovi.example(scene))
    options = {
        "budget": budget,
        "clock": "processor",
        "repeats": REPEATS,
        "enough": SUFFICIENT_ERRORS,
    }
    diagram = work_precision(task, peers=peers, progress=progress, **options)
    plot_work_precision(diagram, IMAGES / f"work_precision_{scene}.png", fastest=True)
    return diagram


def warm(run: Run) -> float:
    return run.best_seconds


def cold(run: Run) -> float:
    return run.cold_seconds


def of_hovi(run: Run) -> bool:
    return run.family == "hovi"


def cheapest(diagram: Diagram, of: object, time: object) -> list[Run | None]:
    return [diagram.cheapest(tolerance, among=of, time=time) for tolerance in TOLERANCES]


def milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.3g}"


def print_ours(diagram: Diagram) -> None:
    """Print the fastest runs of hovi and the choices of `plan(tolerance=)`."""
    rows = []
    choices = {choice.tolerance: choice for choice in diagram.choices}
    runs = zip(cheapest(diagram, of_hovi, warm), cheapest(diagram, of_hovi, cold), strict=True)
    for tolerance, (run, first) in zip(TOLERANCES, runs, strict=True):
        row = [f"{tolerance:.0e}", "-", "-", "-", "-", "-"]
        if run and first:
            row[1:4] = f"`{run.method}`, {run.intervals}", milliseconds(warm(run)), ""
            row[3] = milliseconds(cold(first))
        choice = choices.get(tolerance)
        if choice and run:
            ratio = choice.best_seconds / warm(run)
            row[4] = f"{milliseconds(choice.best_seconds)} ({ratio:.1f} times)"
            row[5] = f"{choice.error.cost:.0e} ({choice.estimate:.0e})"
        rows.append(row)
    columns = ["relative error of the cost", "cheapest of hovi: scheme, intervals", "warm [ms]"]
    columns += ["cheapest cold [ms]", "chosen by `tolerance=`, warm [ms]", "its error (estimate)"]
    print_table(columns, rows)


def ratios(diagram: Diagram, method: str) -> list[float | None]:
    """Times of a method relative to hovi's, warm at each tolerance and then cold."""
    found = []
    for time in (warm, cold):
        ours = cheapest(diagram, of_hovi, time)
        theirs = cheapest(diagram, lambda run: run.method == method, time)
        for a, b in zip(ours, theirs, strict=True):
            found.append(time(b) / time(a) if a and b else None)
    return found


def print_ratios(diagram: Diagram) -> None:
    """Print one row per method of a reference tool."""
    others = [m for m in diagram.methods if not of_hovi(diagram.of(m)[0])]
    table = {method: ratios(diagram, method) for method in others}
    columns = ["time / hovi's"]
    columns += [f"{kind} {t:.0e}" for kind in ("warm", "cold") for t in TOLERANCES]
    cell = "{:.2g}".format
    rows = [
        [method, *("-" if x is None else f"**{cell(x)}**" if x < 1 else _plain(x) for x in row)]
        for method, row in table.items()
    ]
    print_table(columns, rows)
    for column, tolerance in enumerate(TOLERANCES):
        known = [(row[column], method) for method, row in table.items() if row[column] is not None]
        if known:
            ratio, method = min(known)
            print(f"- Closest at {tolerance:.0e}, warm: {method}, {ratio:.2g} times hovi's time.")
    print()
    won = [m for m, row in table.items() if any(x is not None and x < 1 for x in row)]
    if won:
        print(f"Faster than hovi somewhere, in bold: {', '.join(won)}.\n")
    else:
        print("None of them is faster than hovi at any of these accuracies.\n")


def _plain(ratio: float) -> str:
    return f"{ratio:.2g}" if ratio < 100 else f"{ratio:,.0f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--budget", type=float, default=400.0, help="seconds for each arm")
    parser.add_argument("--crocoddyl", default=os.environ.get("HOVI_CROCODDYL_PYTHON"))
    parser.add_argument("--drake", default=os.environ.get("HOVI_DRAKE_PYTHON"))
    parser.add_argument("--kernels", default=os.environ.get("HOVI_KERNELS"), help="cache folder")
    parser.add_argument("--out", help="folder for all runs as JSON")
    parser.add_argument("scenes", nargs="*", default=SCENES)
    given = parser.parse_args()
    print(f"{INTRODUCTION}\n")
    for scene in given.scenes:
        budget = given.budget * BUDGET_FACTORS.get(scene, 1.0)
        diagram = alone(measure, scene, budget, given.crocoddyl, given.drake, given.kernels)
        resolved = diagram.resolved
        print(
            f"**{scene}**: against {resolved.scheme} on {resolved.intervals} intervals, known to "
            f"{resolved.uncertainty.cost:.0e}; {len(diagram.runs)} runs in {diagram.seconds:.0f} "
            "s.\n"
        )
        if given.out:
            (Path(given.out) / f"{scene}.json").write_text(as_json(diagram))
        print_ours(diagram)
        print_ratios(diagram)
        for note in diagram.notes:
            print(f"{note}\n")
    print_machine(threads=1)


if __name__ == "__main__":
    main()
