"""Runs of `plan(tolerance=)`, measured like those of other methods."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hovi.accuracy.budget import Budget
from hovi.accuracy.measures import shown_sizes
from hovi.accuracy.method import Stopwatch
from hovi.accuracy.reference_motion import ReferenceMotion
from hovi.accuracy.variational_method import on_grid
from hovi.discrete.guess import Curve
from hovi.discrete.motion_error import MotionError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Tolerance
from hovi.planning.refinement.adaptive import first_grid, solve_to_tolerance
from hovi.planning.solver.solver import Solution

TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9)
"""Relative tolerances of the cost."""


@dataclass(frozen=True)
class Choice:
    """The scheme and grid chosen by `plan(tolerance=)`, its time and its error.

    tolerance: relative, of the cost. scheme, intervals: of the final grid.
    estimate: estimated relative error of the cost. error: true errors, against the reference.
    success: whether the tolerance is reported as met. repeats: time of each run, coarser grids and
    error estimates included, in [s].
    """

    tolerance: float
    scheme: str
    intervals: int
    estimate: float | None
    error: MotionError
    success: bool
    repeats: tuple[float, ...]

    @property
    def seconds(self) -> float:
        """The median of the repeats, in [s]."""
        return statistics.median(self.repeats)

    @property
    def best_seconds(self) -> float:
        """The fastest of the repeats, in [s]."""
        return min(self.repeats)

    def to_dict(self) -> dict[str, Any]:
        """The JSON form, with times in [s] and the tip error in [mm]."""
        return {**vars(self), "error": shown_sizes(self.error), "seconds": self.seconds}


def choices(
    problem: TrajectoryProblem,
    guess: Curve,
    reference: ReferenceMotion,
    budget: Budget,
    intervals: int,
    repeats: int,
    clock: str,
) -> tuple[Choice, ...]:
    """One choice per tolerance in TOLERANCES, as the budget allows.

    problem: on any grid. intervals: those of the scene, see `first_grid`.
    clock: in CLOCKS.
    """
    coarse = on_grid(problem, first_grid(problem.grid.duration, intervals))
    path = coarse.path(guess)
    found = []
    for size in TOLERANCES:
        tolerance = Tolerance(size)
        times: list[float] = []
        while len(times) <= repeats and budget.allows(max(times, default=0.0)):
            watch = Stopwatch(clock)
            solution = solve_to_tolerance(coarse, tolerance, path, time_limit=budget.seconds_left)
            times.append(watch.seconds)
        if times:
            found.append(_choice(size, solution, times, reference))
    return tuple(found)


def _choice(
    size: float, solution: Solution, times: Sequence[float], reference: ReferenceMotion
) -> Choice:
    grid = solution.trajectory.grid
    names = sorted({scheme.name for scheme, _ in grid.groups})
    accuracy = solution.accuracy
    return Choice(
        tolerance=size,
        scheme=" and ".join(names),
        intervals=grid.intervals,
        estimate=solution.error_estimate,
        error=reference.error(solution.cost, solution.trajectory.configurations),
        success=accuracy is not None and accuracy.reached,
        repeats=tuple(times),
    )
