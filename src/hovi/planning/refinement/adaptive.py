"""Solve to a tolerance: start coarse, estimate the error, refine where it is, and stop in time."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Accuracy, Quantity, Round, Tolerance
from hovi.planning.refinement.candidate import Candidate, least_error
from hovi.planning.refinement.error_estimate import FinerSolution, estimate_against
from hovi.planning.refinement.interpolated_outputs import interpolated_slopes
from hovi.planning.refinement.nearby_minimum import nearby_minimum
from hovi.planning.refinement.next_grid import moved_to, next_grid
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.solver import Solution, solve
from hovi.planning.solver.status import Status
from hovi.schemes import galerkin
from hovi.system.deadline import Deadline
from hovi.system.interruption import (
    interrupted,
    interruptible,
    raise_if_interrupted,
    record_interrupt,
)

Told = Callable[[Round], None]
"""What is told how far a search is."""

FIRST_INTERVALS = 60
"""The most that a search begins with."""
ROUNDS = 14
"""Grids that are tried."""
STALLED = 2
"""Rounds without a smaller error after which rounding, or the motion, sets the limit."""
MOST_POINTS = 400_000
"""Quadrature points of the finest grid."""


def first_grid(duration: float, intervals: int, smooth: bool = True) -> Grid:
    """The grid to begin with: galerkin-2 on the intervals, or two thirds of them with more modes.

    These have as many quadrature points, and smaller errors where the motion is smooth; and their
    modes tell how fast they decay.
    duration: T, in [s]. intervals: those beyond FIRST_INTERVALS do not count. smooth: whether
        nothing is known that makes kinks, as limits and via points do.
    Raises InputError as Grid.uniform does.
    """
    number = min(intervals, FIRST_INTERVALS)
    if not smooth:
        return Grid.uniform(duration, number, galerkin(2))
    return Grid.uniform(duration, max(2 * number // 3, 1), galerkin(4))


@interruptible
def solve_to_tolerance(
    problem: TrajectoryProblem,
    tolerance: Tolerance,
    guess: str | Trajectory | DiscretePath = "cubic",
    *,
    max_iterations: int = 500,
    time_limit: float | None = None,
    told: Told | None = None,
) -> Solution:
    """A minimum whose estimated error is within a tolerance, on a grid that is just fine enough.

    problem: on the grid to begin with. guess, max_iterations: as for `solve`.
    time_limit: of everything, in [s]. told: called with every grid that was solved on.
    The solution's `accuracy` says what was reached, and why not more where it was not.
    """
    deadline = Deadline(time_limit)
    first = solve(problem, guess, max_iterations=max_iterations, time_limit=time_limit)
    return refine_to_tolerance(
        first,
        tolerance,
        max_iterations=max_iterations,
        time_limit=deadline.seconds_left,
        told=told,
    )


@interruptible
def refine_to_tolerance(
    solution: Solution,
    tolerance: Tolerance,
    *,
    max_iterations: int = 500,
    time_limit: float | None = None,
    told: Told | None = None,
) -> Solution:
    """The same motion within a tolerance; arguments as for `solve_to_tolerance`."""
    return _Search(tolerance, max_iterations, Deadline(time_limit), told).run(solution)


@dataclass(eq=False)
class _Search:
    """The rounds of a search, which share budgets."""

    tolerance: Tolerance
    max_iterations: int
    deadline: Deadline
    told: Told | None
    rounds: list[Round] = field(default_factory=list)
    best: Candidate = field(init=False)

    def run(self, solution: Solution) -> Solution:
        """Refine until the error is small enough, or something ends it."""
        self.best = Candidate(solution, self.tolerance)
        try:
            reason = self._refine(solution)
        except KeyboardInterrupt:
            record_interrupt()
            reason = "it was interrupted"
        return self._finished(self.best, reason)

    def _refine(self, solution: Solution) -> str:
        """The rounds; returns why they ended early, or ""."""
        candidate = self.best = self._judged(solution)
        stalled = 0
        while not candidate.enough:
            reason = self._ended(candidate, stalled)
            if reason:
                return reason
            previous, candidate = candidate, self._next(candidate)
            if self.best is previous and candidate.contradicts(previous):
                self.best = previous.corrected(candidate)
            smaller = candidate.error < 0.5 * self.best.error
            stalled = 0 if smaller or np.isnan(self.best.error) else stalled + 1
            if candidate.better_than(self.best):
                self.best = candidate
        self.best = candidate
        return ""

    def _judged(self, solution: Solution) -> Candidate:
        """A solution with what is known of its error, as a round of its own."""
        raise_if_interrupted()
        began = time.perf_counter()
        candidate = Candidate.of(solution, self.tolerance)
        grid = solution.trajectory.grid
        points = sum(len(scheme.points) * len(index) for scheme, index in grid.groups)
        seconds = solution.solve_seconds + time.perf_counter() - began
        error, steps = candidate.error, solution.nit
        done = Round(grid.intervals, points, solution.cost, error, steps, seconds)
        self.rounds.append(done)
        if self.told is not None:
            self.told(done)
        return candidate

    def _ended(self, candidate: Candidate, stalled: int) -> str:
        """Why no finer grid is tried, or ""."""
        raise_if_interrupted()
        solution = candidate.solution
        if not solution.success:
            return f"the last solve ended in {solution.status}"
        if self.deadline.passed:
            return "the time limit was reached"
        cost = self.tolerance.quantity is Quantity.COST
        assert solution.problem is not None
        if cost and candidate.error <= least_error(solution.problem):
            limited = solution.problem.limited
            what = "the limits' tolerance leaves" if limited else "rounding leaves"
            return f"{what} no smaller error"
        if stalled >= STALLED:
            return f"the last {STALLED} grids brought no smaller error"
        if len(self.rounds) >= ROUNDS:
            return f"{ROUNDS} grids were tried"
        if self.rounds[-1].points > MOST_POINTS:
            return f"a grid has {self.rounds[-1].points:,} points"
        return ""

    def _next(self, candidate: Candidate) -> Candidate:
        """The next grid, from the finer solution, or that itself."""
        problem, finer = candidate.solution.problem, candidate.finer
        assert problem is not None
        grid = next_grid(candidate)
        if finer is None:
            return self._judged(self._solved(problem.on(grid), candidate.solution.trajectory))
        if grid is finer.problem.grid:
            solution = finer.finish()
            fine = finer.problem
        else:
            fine = problem.on(grid)
            solution = _near(finer, fine)
        return self._judged(solution or self._solved(fine, moved_to(finer, fine)))

    def _solved(self, problem: TrajectoryProblem, guess: Trajectory | DiscretePath) -> Solution:
        """By the optimiser."""
        steps = self.max_iterations
        left = self.deadline.seconds_left
        return solve(problem, guess, max_iterations=steps, time_limit=left)

    def _finished(self, chosen: Candidate, reason: str) -> Solution:
        """The solution with what is known of its accuracy."""
        solution, finer, known = chosen.solution, chosen.finer, chosen.error_of_cost
        if finer is None and not reason:
            reason = "no finer solution was found nearby"
        if chosen.contradicted > 0:
            finer = None
            reason = f"{reason}, and the minimum moves when the grid becomes finer"
        reached = bool(chosen.error <= self.tolerance.size)
        accuracy = Accuracy(
            self.tolerance,
            chosen.error,
            reached,
            "" if reached else reason,
            tuple(self.rounds),
            None if finer is None else partial(estimate_against, solution, finer, self._frame),
        )
        steps = sum(done.nit for done in self.rounds) or solution.nit
        message = solution.message
        if solution.success:
            message = f"a minimum of cost {solution.cost:.10g} after {steps} steps"
            message += f" on {len(self.rounds)} grids" if len(self.rounds) > 1 else ""
        told = {**solution.trajectory.metadata, "error_estimate": known}
        if interrupted() and not reached:
            solution = dataclasses.replace(solution, success=False, status=Status.INTERRUPTED)
        return dataclasses.replace(
            solution,
            trajectory=dataclasses.replace(solution.trajectory, metadata=told),
            message=f"{message.removesuffix('.')}; {accuracy}",
            nit=steps,
            error_estimate=known,
            accuracy=accuracy,
        )

    @property
    def _frame(self) -> str | None:
        return self.tolerance.frame


def _near(finer: FinerSolution, problem: TrajectoryProblem) -> Solution | None:
    """A solution next to a finer one on another grid; None where it takes the optimiser."""
    if problem.limited or problem.constrained:
        return None
    efforts = interpolated_slopes(finer.problem.ld, finer.path, problem.ld)
    objective, start = ActionObjective(problem), moved_to(finer, problem)
    found = nearby_minimum(objective, start, objective.model_with(start, efforts, None))
    return None if found is None else found.solution()
