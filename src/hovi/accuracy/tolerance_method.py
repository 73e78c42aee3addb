"""Runs of `plan`, by default and to a tolerance, measured like those of other methods."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from hovi.accuracy.budget import Budget
from hovi.accuracy.measures import shown_sizes, size
from hovi.accuracy.method import Stopwatch
from hovi.accuracy.reference_motion import ReferenceMotion
from hovi.accuracy.run import MAX_JOINT_ERROR
from hovi.accuracy.variational_method import on_grid
from hovi.discrete.guess import Curve
from hovi.discrete.measures.motion_error import MotionError
from hovi.discrete.state import Periodic
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Tolerance
from hovi.planning.refinement.adaptive import first_grid, solve_to_tolerance
from hovi.planning.search.options import DEFAULT_INTERVALS, DEFAULT_TOLERANCE, PlanOptions
from hovi.planning.search.planner import plan
from hovi.planning.solver.solver import Solution
from hovi.system.dataclass import dataclass

TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9)
"""Relative tolerances of the cost."""
LIMITED_TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)
"""The same within limits, as far as the tolerance of the limits allows."""
MAX_TIME_RATIO = 3.0
"""Ratio of times that is assumed from one tolerance to the next smaller one."""


@dataclass(frozen=True)
class Choice:
    """The scheme and grid chosen by `plan(tolerance=)`, its time and its error.

    tolerance: relative, of the cost. scheme, intervals: of the final grid. cost: of the motion.
    estimate: estimated relative error of the cost. error: true errors, against the reference.
    success: whether the tolerance is reported as reached. repeats: time of each run, with coarser
    grids and error estimates, in [s].
    minimum: whether a minimum is reported. message: as reported.
    """

    tolerance: float
    scheme: str
    intervals: int
    cost: float
    estimate: float | None
    error: MotionError
    success: bool
    repeats: tuple[float, ...]
    minimum: bool = True
    message: str = ""

    @property
    def counts(self) -> bool:
        """Whether it is valid: a minimum close to the resolved motion, or as cheap.

        At a loose tolerance a light wrist may be far away in a motion of the same cost.
        """
        close = size(self.error, "joints") <= MAX_JOINT_ERROR
        return self.minimum and (close or self.error.cost <= self.tolerance)

    @property
    def found(self) -> str:
        """What was found if it is not valid."""
        return "another motion" if self.minimum else "no minimum"

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
        shown = {"error": shown_sizes(self.error), "seconds": self.seconds, "counts": self.counts}
        return vars(self) | shown


@dataclass(frozen=True, eq=False)
class TimedChoice:
    """A choice and the solve that made it, for repeats."""

    choice: Choice
    solve: Callable[[], Solution]


@dataclass(frozen=True, eq=False)
class ChoiceTimer:
    """Measures choices: their times, and their errors against the reference motion.

    repeats: of every solve after the first. clock: in CLOCKS.
    """

    reference: ReferenceMotion
    budget: Budget
    repeats: int
    clock: str = "processor"

    @property
    def left(self) -> float:
        """Remaining time, positive, in [s]."""
        return max(self.budget.left_of(1.0), 1e-3)

    def first(self, tolerance: float, solve: Callable[[], Solution]) -> TimedChoice:
        """The choice of a tolerance, solved once."""
        watch = Stopwatch(self.clock)
        solution = solve()
        seconds = watch.seconds
        grid, accuracy, cost = solution.trajectory.grid, solution.accuracy, solution.cost
        choice = Choice(
            tolerance=tolerance,
            scheme=grid.scheme_range,
            intervals=grid.intervals,
            cost=cost,
            estimate=solution.error_estimate,
            error=self.reference.error(cost, solution.trajectory.configurations),
            success=solution.success and accuracy is not None and accuracy.reached,
            repeats=(seconds,),
            minimum=solution.success,
            message=solution.message,
        )
        return TimedChoice(choice, solve)

    def repeated(self, timed: Sequence[TimedChoice]) -> list[Choice]:
        """The choices with their repeats, in rounds, as far as the budget allows them."""
        choices = [each.choice for each in timed]
        for _ in range(self.repeats):
            for i, (choice, each) in enumerate(zip(choices, timed, strict=True)):
                if self.budget.allows(max(choice.repeats)):
                    watch = Stopwatch(self.clock)
                    each.solve()
                    choices[i] = replace(choice, repeats=(*choice.repeats, watch.seconds))
        return choices


def choices_to_tolerances(
    problem: TrajectoryProblem,
    guess: Curve,
    intervals: int,
    timer: ChoiceTimer,
    least: float = 0.0,
) -> list[TimedChoice]:
    """One choice per tolerance in TOLERANCES or LIMITED_TOLERANCES, as the budget allows.

    problem: on any grid. intervals: those of the scene, see `first_grid`.
    least: smallest tolerance that can be reached.
    """
    coarse = _on_first_grid(problem, intervals)
    path = coarse.path(guess)

    def solve(tolerance: float) -> Solution:
        return solve_to_tolerance(coarse, Tolerance(tolerance), path, time_limit=timer.left)

    found: list[TimedChoice] = []
    for tolerance in LIMITED_TOLERANCES if problem.limited else TOLERANCES:
        expected = MAX_TIME_RATIO * found[-1].choice.seconds if found else 0.0
        if tolerance < least or not timer.budget.allows(expected):
            break
        found.append(timer.first(tolerance, partial(solve, tolerance)))
    return found


def default_choice(
    options: PlanOptions, problem: TrajectoryProblem, guess: Curve, timer: ChoiceTimer
) -> TimedChoice:
    """What `plan` does from the guess if neither scheme, intervals nor tolerance are named.

    If it does not find the motion, as its first grid need not resolve the guess, from the guess of
    the task. Each may take a third of the time that is left.

    options: of the task. problem: on any grid; its ends and duration are those of the plan.
    """
    unnamed = options.with_changes(scheme=None, intervals=None, tolerance=None, time_weight=0.0)
    unnamed = unnamed.with_changes(smooth=False)  # the problem has its cost on the jerk already
    first = _on_first_grid(problem, DEFAULT_INTERVALS)
    assert not isinstance(problem.goal, Periodic)  # that of a task
    ends = problem.start, problem.goal, problem.grid.duration

    def solve(**changes: Any) -> Solution:
        left = timer.left / 3
        return plan(problem.scene, *ends, options=unnamed, time_limit=left, **changes)

    near = partial(solve, guess=first.trajectory(first.path(guess)), starts=1)
    timed = timer.first(DEFAULT_TOLERANCE, near)
    if not timed.choice.counts:
        own = timer.first(DEFAULT_TOLERANCE, solve)
        timed = own if own.choice.counts else timed
    return timed


def _on_first_grid(problem: TrajectoryProblem, intervals: int) -> TrajectoryProblem:
    """The problem on the first grid of a refinement."""
    T, k = problem.grid.duration, problem.ld.k
    grid = first_grid(T, intervals, smooth=not problem.limited, order=k)
    return on_grid(problem, grid)
