"""The accuracy of a plan, as text and as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from hovi.discrete.grid import Grid
from hovi.discrete.measures.motion_error import MotionError
from hovi.planning.problem.tolerance import as_number_or_text
from hovi.planning.solver.solver import Solution
from hovi.planning.task_file.task import Task


def scheme_text(task: Task, grid: Grid) -> str:
    """The scheme of the task, or those chosen for its tolerance."""
    return task.options.scheme_name if task.options.names_grid else grid.scheme_range


def accuracy_json(solution: Solution, task: Task) -> dict[str, Any]:
    """The tolerance, the result and the grids on the way; {} without a tolerance."""
    accuracy = solution.accuracy
    if accuracy is None:
        return {}
    rounds = [
        {
            "intervals": grid_round.intervals,
            "points": grid_round.points,
            "cost": grid_round.cost,
            "error": grid_round.error,
            "nit": grid_round.nit,
            "seconds": grid_round.seconds,
            "asked_by": grid_round.asked_by or None,
        }
        for grid_round in accuracy.rounds
    ]
    return {
        "tolerance": as_number_or_text(task.options.effective_tolerance),
        "tolerance_reached": accuracy.reached,
        "tolerance_reason": accuracy.reason or None,
        "grid_fixed_by": accuracy.fixed_by or None,
        "errors": None if accuracy.estimate is None else errors_json(accuracy.estimate),
        "grids": rounds,
    }


def errors_json(error: MotionError) -> dict[str, Any]:
    """The largest errors over the whole motion."""
    return {
        "cost": error.cost,
        "q_rad": error.angle,
        "q_m": error.slide if error.sliding.any() else None,
        "v": error.largest_v,
        "tau": error.largest_tau,
        "tip_mm": 1e3 * error.largest_tip,
        "frame": error.frame,
    }


def errors_text(error: MotionError) -> str:
    """The largest errors over the whole motion, on one line."""
    parts = [f"cost {error.cost:.1e}"]
    if not error.sliding.all():
        parts.append(f"q {error.angle:.1e} rad")
    if error.sliding.any():
        parts.append(f"q {1e3 * error.slide:.1e} mm")
    parts += [f"v {error.largest_v:.1e}", f"tau {error.largest_tau:.1e}"]
    parts.append(f"{error.frame} {1e3 * error.largest_tip:.1e} mm")
    return ", ".join(parts)


def steps_text(grid: Grid) -> str:
    """The range of the interval lengths; "" on a uniform grid."""
    short, long = float(np.min(grid.steps)), float(np.max(grid.steps))
    return "" if long - short <= 1e-9 * long else f" of {short:.3g} to {long:.3g} s"
