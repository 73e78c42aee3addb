"""What a plan came to: one JSON object for programs, tables for people."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from hovi.plan import Solution
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from hovi.cli.peaks import Peaks, peaks
from hovi.task_file import Task


def as_json(solution: Solution, task: Task, out: Path | None) -> str:
    """The one JSON object of `hovi plan --json`; numbers are finite or null."""
    extremes = None if solution.trajectory is None else peaks(solution.trajectory)
    fields = {
        "success": bool(solution.success),
        "status": str(solution.status),
        "message": solution.message,
        "cost": solution.cost,
        "error_estimate": solution.error_estimate,
        "scheme": task.scheme,
        "intervals": task.intervals,
        "nit": solution.nit,
        "n_neg": solution.n_neg,
        "setup_seconds": solution.setup_seconds,
        "solve_seconds": solution.solve_seconds,
        "starts": task.starts,
        "seed": task.seed,
        "minima": [minimum.cost for minimum in solution.minima],
        "peaks": None if extremes is None else _peaks_json(extremes),
        "limits_exceeded": [] if extremes is None else extremes.exceeded(),
        "out": None if out is None else str(out),
    }
    return json.dumps(_finite(fields), allow_nan=False)


def print_report(solution: Solution, task: Task, out: Path | None) -> None:
    """A summary, the peaks of the motion, and where it was written, on stdout."""
    console = Console(highlight=False)
    summary = Table(show_header=False, box=None, pad_edge=False)
    for label, text in _summary(solution, task):
        summary.add_row(label, text)
    console.print(summary, markup=False)
    if solution.trajectory is not None:
        extremes = peaks(solution.trajectory)
        console.print(_peaks_table(extremes), markup=False)
        for phrase in extremes.exceeded():
            console.print(f"note: {phrase}", markup=False, soft_wrap=True)
        if extremes.exceeded():
            console.print("note: limits are not enforced yet.", markup=False)
    if out is not None:
        console.print(f"wrote {out}", markup=False, soft_wrap=True)


def _summary(solution: Solution, task: Task) -> list[tuple[str, str]]:
    rows = [
        ("status", str(solution.status)),
        ("message", solution.message),
        ("cost", f"{solution.cost:.10g}"),
        ("n_neg", f"{solution.n_neg}"),
        ("nit", f"{solution.nit}"),
        ("scheme", f"{task.scheme} on {task.intervals} intervals"),
        ("time", f"{solution.setup_seconds:.2f} s setup, {solution.solve_seconds:.2f} s solving"),
    ]
    if len(solution.minima) > 1:
        costs = [f"{minimum.cost:.6g}" for minimum in solution.minima]
        more = f" and {len(costs) - 6} more" if len(costs) > 6 else ""
        rows.append(("minima", f"{len(costs)}: {', '.join(costs[:6])}{more}"))
    return rows


def _peaks_table(extremes: Peaks) -> Table:
    table = Table(title="peaks [limits of the URDF]", title_justify="left")
    table.add_column("joint", overflow="fold")
    for column in ("q", "|v|", "|tau|"):
        table.add_column(column, justify="right")
    for i, name in enumerate(extremes.names):
        q = f"{_short(extremes.q_low[i])} .. {_short(extremes.q_high[i])}"
        q_limit = f"{_short(extremes.lower[i])} .. {_short(extremes.upper[i])}"
        v = f"{_short(extremes.v[i])} [{_short(extremes.v_limit[i])}]"
        tau = f"{_short(extremes.tau[i])} [{_short(extremes.tau_limit[i])}]"
        table.add_row(escape(name), escape(f"{q} [{q_limit}]"), escape(v), escape(tau))
    return table


def _peaks_json(extremes: Peaks) -> dict[str, dict[str, Any]]:
    return {
        name: {
            "q": [float(extremes.q_low[i]), float(extremes.q_high[i])],
            "v": float(extremes.v[i]),
            "tau": float(extremes.tau[i]),
        }
        for i, name in enumerate(extremes.names)
    }


def _finite(value: Any) -> Any:
    """The value with null for every number that JSON cannot hold."""
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_finite(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _short(number: float) -> str:
    if math.isnan(number):
        return "-"
    return "none" if math.isinf(number) else f"{number:.4g}"
