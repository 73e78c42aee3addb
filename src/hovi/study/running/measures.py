"""The row of a solution: its peaks, its margins, and what else plans.parquet has."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.conditions.excess import excess_along
from hovi.discrete.output.caution import caution_lines
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.limit_conditions import closeness
from hovi.planning.solver.outcome.margins import margins_to_obstacles
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status
from hovi.study.storage.rows import PlanRow
from hovi.version import __version__

Array = npt.NDArray[np.float64]

SAMPLES_PER_INTERVAL, MAX_SAMPLES = 20, 20_000
"""Samples at which peaks are looked for, of an interval and of a motion."""
UNTOUCHED_FRACTION = 0.05
"""Fraction of a time limit below which it changed nothing: all parts of a plan get more."""


def row_of(solution: Solution, warned: str, seconds: float, limit: float | None) -> PlanRow:
    """The row of a solution.

    seconds: that the plan took. limit: its time limit, in [s].
    """
    motion = solution.trajectory
    peaks = _peaks(motion)
    out_of_time = limit is not None and seconds > UNTOUCHED_FRACTION * limit
    return PlanRow(
        status=str(solution.status),
        success=bool(solution.success),
        reason=solution.message,
        warnings=warned,
        cautions=caution_lines([motion.metadata]),
        excused=[str(each) for each in solution.excused],
        cost=_finite(solution.cost),
        effort=_finite(solution.effort),
        error_estimate=_finite(solution.error_estimate),
        nit=int(solution.nit),
        n_neg=int(solution.n_neg),
        duration=float(motion.duration),
        intervals=int(motion.grid.intervals),
        peak_v=peaks["v"],
        peak_a=peaks["a"],
        peak_tau=peaks["tau"],
        margin=_margin(solution),
        least_distance=_least_distance(solution),
        q_start=_finite_list(motion.q[0]),
        q_goal=_finite_list(motion.q[-1]),
        reproducible=not out_of_time and solution.status is not Status.TIME_LIMIT,
        version=__version__,
    )


def _peaks(motion: Trajectory) -> dict[str, list[float] | None]:
    """Largest |v|, |a| and |tau| of each joint at samples."""
    N = motion.grid.intervals
    count = max(1, min(SAMPLES_PER_INTERVAL, MAX_SAMPLES // N))
    s = np.linspace(0.0, 1.0, count + 1)
    sampled = motion.sample_intervals(np.repeat(np.arange(N), len(s)), np.tile(s, N))
    return {
        name: _finite_list(np.abs(getattr(sampled, name)).max(axis=0)) for name in ("v", "a", "tau")
    }


def _margin(solution: Solution) -> float | None:
    """To the limits, those on the power included."""
    limits = None if solution.problem is None else solution.problem.limits
    if limits is None:
        return None
    motion = solution.trajectory
    of_power = [-float(excess_along(motion, each).max()) for each in limits.conditions]
    return _finite(min([float(closeness(motion, limits).min()), *of_power]))


def _least_distance(solution: Solution) -> float | None:
    if solution.problem is None:
        return None
    known = margins_to_obstacles(solution.problem, solution.trajectory)
    return _finite(known.get("distance"))


def _finite(number: Any) -> float | None:
    return None if number is None or not math.isfinite(number) else float(number)


def _finite_list(numbers: Array) -> list[float] | None:
    return [float(x) for x in numbers] if np.isfinite(numbers).all() else None
