"""The result of a plan: one JSON object, or a summary with tables."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from hovi.cli.reports.accuracy import accuracy_json, scheme_text, steps_text
from hovi.cli.reports.arm_limits import limit_set_json, limit_set_of, limit_set_text
from hovi.cli.reports.certificate import certificate_json, certificate_lines
from hovi.cli.reports.extremes import extremes_json, extremes_lines
from hovi.cli.reports.limit_margins import KnownMargins, is_guess
from hovi.cli.reports.peaks import Peaks, peaks
from hovi.cli.reports.segments import segment_lines, segments_json
from hovi.cli.reports.terminal_table import print_table
from hovi.discrete.measures.motion_extremes import extremes
from hovi.discrete.output.caution import STATUS, WARNED, cautions_of
from hovi.errors import some_of
from hovi.planning.problem.goal_region import ANGLE
from hovi.planning.refinement.certificate import Certificate
from hovi.planning.solver.outcome.limit_margins import LimitMargins
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status
from hovi.planning.task_file.task import Task
from hovi.system.files import finite


def as_json(
    solution: Solution,
    task: Task,
    out: Path | None,
    margins: KnownMargins,
    certificate: Certificate | None = None,
) -> str:
    """The one JSON object of `hovi plan --json`; numbers are finite or null."""
    trajectory = solution.trajectory
    limits = margins.limits
    fields = {
        "success": bool(solution.success),
        "status": str(solution.status),
        "message": solution.message,
        "cautions": [str(each) for each in cautions_of(trajectory.metadata)],
        "cost": solution.cost,
        "effort": solution.effort,
        "error_estimate": _estimate(solution, certificate),
        "scheme": scheme_text(task, trajectory.grid),
        "intervals": trajectory.grid.intervals,
        "nit": solution.nit,
        "n_neg": solution.n_neg,
        "setup_seconds": solution.setup_seconds,
        "solve_seconds": solution.solve_seconds,
        "starts": task.options.starts,
        "seed": task.options.seed,
        "minima": list(solution.minima),
        "peaks": _peaks_json(peaks(trajectory)),
        **extremes_json(extremes(trajectory)),
        "limit_set": limit_set_json(limit_set_of(task), trajectory.grid.order),
        "limits": None if limits is None else limits.by_kind(),
        "excess": None if limits is None else limits.excess,
        "excused": [
            {"limit": each.limit, "joint": each.joint, "excess": each.excess, "until": each.until}
            for each in solution.excused
        ],
        "usable": None if margins.violation is None else not margins.violation,
        "violation": margins.violation or None,
        "least_distance": margins.distance,
        "nearest_pair": margins.nearest_pair,
        "conditions": dict(margins.conditions),
        "missed": dict(margins.missed),
        "condition_times": dict(margins.times),
        "regions": dict(margins.regions),
        "out": None if out is None else str(out),
        **segments_json(solution, margins.segments),
        **accuracy_json(solution, task),
        "certificate": None if certificate is None else certificate_json(certificate),
    }
    return json.dumps(finite(fields), allow_nan=False)


def print_report(
    solution: Solution,
    task: Task,
    out: Path | None,
    margins: KnownMargins,
    certificate: Certificate | None = None,
    verbose: bool = False,
) -> None:
    """Print a summary, the peaks of the motion, its accuracy and the output file.

    verbose: whether to print the numbers of the solver and the whole certificate, too.
    """
    _print_lines(_summary(solution, task, margins, verbose))
    if is_guess(solution):
        return
    arm = limit_set_of(task)
    if arm is not None:
        print(f"limits   {limit_set_text(arm, solution.trajectory.grid.order)}")
    largest = peaks(solution.trajectory)
    if margins.limits is not None:
        _print_margins(largest, margins.limits)
        print(_margins_note(margins.limits))
    else:
        _print_peaks(largest)
    _print_lines(extremes_lines(extremes(solution.trajectory), verbose))
    if margins.missing:
        print(f"margins  none: {margins.missing}")
    _print_conditions(solution, margins)
    if margins.distance is not None:
        kept = task.options.clearance.margin
        print(
            f"distance {margins.distance:.4g} m at the nearest approach, of "
            f"{margins.nearest_pair}; the margin is {kept:g} m"
        )
    if certificate is not None:
        _print_lines(certificate_lines(certificate, verbose))
    _print_lines(_cautions(solution))
    _print_file(out, solution)


def _print_conditions(solution: Solution, margins: KnownMargins) -> None:
    """Print what is known of each condition and region, and when it is so."""
    asked = () if solution.problem is None else solution.problem.conditions
    units = {each.name: each.unit and f" {each.unit}" for each in asked}
    for name, margin in margins.conditions.items():
        when = f" at t = {margins.times[name]:.4g} s"
        print(f"{name:8} condition with a margin of {100 * margin:.3g} % of its scale{when}")
    for name, size in margins.missed.items():
        most = f"{size:.2g}{units.get(name, '')} at t = {margins.times[name]:.4g} s"
        print(f"{name:8} condition that is missed by at most {most}")
    for name, left in margins.regions.items():
        unit = "rad" if name.split(" at ")[0].endswith(ANGLE) else "m"
        print(f"region   {name}: {left:.3g} {unit} left of its room")


def _cautions(solution: Solution) -> list[tuple[str, str]]:
    """Labels and text of the cautions that neither the message nor a warning has said."""
    found = cautions_of(solution.trajectory.metadata)
    return [
        (f"! {each.word}", each.sentence)
        for each in found
        if each.word not in (STATUS, WARNED) and each.sentence not in solution.message
    ]


def _print_lines(lines: list[tuple[str, str]]) -> None:
    for label, text in lines:
        print(f"{label:8s} {text}")


def _print_file(out: Path | None, solution: Solution) -> None:
    """Print where the motion was written, if it was."""
    if out is not None:
        print(f"wrote {out}" + ("" if solution.success else ", which is not a minimum"))


def _estimate(solution: Solution, certificate: Certificate | None) -> float | None:
    """Estimated error of the cost, from the solution or from the certificate."""
    if solution.error_estimate is not None or certificate is None:
        return solution.error_estimate
    return None if certificate.errors is None else certificate.errors.cost


def _summary(
    solution: Solution, task: Task, margins: KnownMargins, verbose: bool
) -> list[tuple[str, str]]:
    """Labels and their text."""
    rows = [("status", str(solution.status)), ("message", solution.message)]
    if is_guess(solution):
        return rows
    grid = solution.trajectory.grid
    rows.append(("cost", f"{solution.cost:.10g}{_infeasible_note(solution)}"))
    if verbose or (solution.effort is not None and not _equal(solution.effort, solution.cost)):
        rows.append(("effort", "none" if solution.effort is None else f"{solution.effort:.10g}"))
    if verbose:
        unknown = solution.n_neg < 0
        rows.append(("n_neg", "not determined" if unknown else f"{solution.n_neg}"))
        rows.append(("nit", f"{solution.nit}"))
    fixed_by = "" if solution.accuracy is None else solution.accuracy.fixed_by
    if fixed_by and (verbose or task.keeps):
        rows.append(("grid", f"last refined for {fixed_by}"))
    rows += [
        ("scheme", f"{scheme_text(task, grid)} on {_intervals(solution, task)}"),
        ("time", f"{solution.setup_seconds:.2f} s setup, {solution.solve_seconds:.2f} s solving"),
    ]
    if margins.violation is not None and not solution.success:
        rows.insert(2, ("usable", _usable(margins.violation)))
    if solution.excused:
        rows.append(("excused", "; ".join(map(str, solution.excused))))
    rows += segment_lines(solution, margins.segments)
    if len(solution.minima) > 1:
        costs = [f"{cost:.6g}" for cost in solution.minima]
        rows.append(("minima", f"{len(costs)}: {some_of(costs, 6)}"))
    return rows


def _equal(effort: float, cost: float) -> bool:
    """Whether a cost is nothing but the effort, up to rounding."""
    return math.isclose(effort, cost, rel_tol=1e-9)


def _usable(violation: str) -> str:
    """Whether a motion that is no minimum can be used, and why not."""
    return f"no: {violation}" if violation else "yes: its ends and limits hold"


def _infeasible_note(solution: Solution) -> str:
    """A note on the cost of an infeasible problem; "" otherwise."""
    unfit = solution.status == Status.INFEASIBLE
    return " of the motion below, which violates the constraints" if unfit else ""


def _intervals(solution: Solution, task: Task) -> str:
    taken = solution.trajectory.grid.intervals
    if not task.options.names_grid:
        return f"{taken} intervals{steps_text(solution.trajectory.grid)}"
    wanted = task.options.interval_count
    asked = "" if taken == wanted else f" ({wanted} asked for)"
    return f"{taken} intervals{asked}"


def _print_margins(extremes: Peaks, margins: LimitMargins) -> None:
    """Print the extremes of each limited output, with the margin to its limit."""
    values = {
        "q": [_range(*ends) for ends in zip(extremes.q_low, extremes.q_high, strict=True)],
        "v": [_short(each) for each in extremes.v],
        "a": [_short(each) for each in extremes.a],
        "tau": [_short(each) for each in extremes.tau],
    }
    shown = [kind for kind in values if kind != "a" or margins.is_limited("a")]
    rows = [[name] for name in extremes.shown]
    for i, row in enumerate(rows):
        for kind in shown:
            row += [values[kind][i], margins.text(kind, i)]
    titles = [(kind if kind == "q" else f"|{kind}|", "margin") for kind in shown]
    print_table(["joint", *(each for pair in titles for each in pair)], rows)


def _margins_note(margins: LimitMargins) -> str:
    near = ", in the segment that comes nearest" if margins.limits.parts else ""
    note = f"margin: distance to the nearest limit{near}, in percent of the range; * at a limit"
    return note + (", ! beyond one." if margins.exceeded else ".")


def _print_peaks(extremes: Peaks) -> None:
    """Print the extremes of each joint next to the limits of the URDF."""
    beyond = {
        key: ["!" if each else "" for each in flags] for key, flags in extremes.beyond().items()
    }
    rows = [
        (
            name,
            beyond["q"][i] + _range(extremes.q_low[i], extremes.q_high[i]),
            _range(extremes.lower[i], extremes.upper[i]),
            beyond["v"][i] + _short(extremes.v[i]),
            _short(extremes.v_limit[i]),
            beyond["tau"][i] + _short(extremes.tau[i]),
            _short(extremes.tau_limit[i]),
        )
        for i, name in enumerate(extremes.shown)
    ]
    print_table(("joint", "q", "limits", "|v|", "limit", "|tau|", "limit"), rows)


def _peaks_json(extremes: Peaks) -> dict[str, dict[str, Any]]:
    beyond = extremes.beyond()
    return {
        name: {
            "q": [float(extremes.q_low[i]), float(extremes.q_high[i])],
            "v": float(extremes.v[i]),
            "tau": float(extremes.tau[i]),
            "beyond": [key for key, flags in beyond.items() if flags[i]],
        }
        for i, name in enumerate(extremes.names)
    }


def _range(low: float, high: float) -> str:
    """A short form of a range; - where neither end is known."""
    if math.isinf(low) and math.isinf(high):
        return "-"
    if low == -high:
        return f"+-{_short(high)}"
    return f"{_short(low)} .. {_short(high)}"


def _short(number: float) -> str:
    if not math.isfinite(number):
        return "-"
    return f"{number:.3g}" if abs(number) < 100 else f"{number:.4g}"
