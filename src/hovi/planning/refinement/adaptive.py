"""Adaptive solve to a tolerance: estimate the error and refine the grid until it is reached."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import field
from functools import partial

import numpy as np

from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.trajectory import Trajectory
from hovi.optimize.criteria import MAX_ITERATIONS
from hovi.optimize.start import Start
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Accuracy, Round, Tolerance
from hovi.planning.refinement.candidate import Candidate
from hovi.planning.refinement.error_estimate import (
    estimate_against,
    with_estimate,
)
from hovi.planning.refinement.hp_refinement import galerkin_with_more_points
from hovi.planning.refinement.next_grid import interpolated_to, next_grid
from hovi.planning.refinement.spinning import solved_on_halves
from hovi.planning.solver.central_path import CentralPath
from hovi.planning.solver.solver import Solution, solved_on_grid
from hovi.planning.solver.status import Status
from hovi.system.blas_threads import one_blas_thread
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError
from hovi.system.interruption import (
    interrupted,
    interruptible,
    raise_if_interrupted,
    record_interrupt,
)

OnRound = Callable[[Round], None]
"""Called after every round of a refinement."""

MAX_FIRST_INTERVALS = 60
"""Maximum number of intervals of the first grid."""
FIRST_MODES = 4
"""Inner modes of the intervals of the first grid of a smooth motion."""
SMOOTH_INTERVALS = 2, 3
"""Quotient of the intervals of the first grid of a smooth motion and those of another one."""
MAX_ROUNDS = 14
"""Maximum number of grids."""
MAX_STALLED_ROUNDS = 2
"""Consecutive rounds without an error smaller by half after which the refinement ends."""
LEVEL = 1e-3
"""Barrier parameter at which a solve on another grid begins among obstacles, relative to the mean
density of the cost."""
MAX_POINTS = 400_000
"""Number of quadrature points of a grid above which no finer one is tried."""


def first_grid(duration: float, intervals: int, smooth: bool = True, order: int = 2) -> Grid:
    """The first grid: galerkin-2x8 on the intervals, or galerkin-4x10 on two thirds of them.

    More points leave the torque no room to hide between them. With more modes the errors of smooth
    motions are smaller, and the decay of the modes can be estimated.
    duration: T, in [s]. intervals: at most MAX_FIRST_INTERVALS are used. smooth: whether the
        motion has no kinks, which limits and via points cause. order: k of the Lagrangian.
    Raises InputError as Grid.uniform does.
    """
    number = min(intervals, MAX_FIRST_INTERVALS)
    if not smooth:
        return Grid.uniform(duration, number, galerkin_with_more_points(2, order))
    few, many = SMOOTH_INTERVALS
    table = galerkin_with_more_points(FIRST_MODES, order)
    return Grid.uniform(duration, max(few * number // many, 1), table)


@one_blas_thread
@interruptible
def solve_to_tolerance(
    problem: TrajectoryProblem,
    tolerance: Tolerance,
    guess: str | Trajectory | DiscretePath = "cubic",
    *,
    max_iterations: int = MAX_ITERATIONS,
    time_limit: float | None = None,
    on_round: OnRound | None = None,
) -> Solution:
    """A minimum whose estimated error is within a tolerance, on a grid just fine enough.

    problem: on the first grid. guess, max_iterations: as for `solve`.
    time_limit: in total, in [s]. on_round: called after every grid.
    The solution's `accuracy` reports the estimated error, and why the tolerance was not reached.
    """
    deadline = Deadline(time_limit)
    first = solved_on_grid(
        problem,
        guess,
        max_iterations=max_iterations,
        time_limit=time_limit,
        barrier=tolerance.barrier,
    )
    return Refinement(tolerance, max_iterations, deadline, on_round).run(first)


@dataclass(eq=False)
class Refinement:
    """The rounds of a refinement to a tolerance, with their common limits on steps and time.

    max_iterations, on_round: as for `solve_to_tolerance`. deadline: of all rounds.
    """

    tolerance: Tolerance
    max_iterations: int
    deadline: Deadline
    on_round: OnRound | None = None
    rounds: list[Round] = field(default_factory=list)
    best: Candidate = field(init=False)

    def run(self, solution: Solution) -> Solution:
        """A solution refined until its error is within the tolerance, or nothing more helps.

        Within limits alone a solve at its iteration limit is continued once.
        """
        self.best = Candidate(solution, self.tolerance)
        try:
            self.best = self._evaluated(solution)  # also without time for another grid
            with self.deadline.in_force():
                reason = self._refine(self.best)
        except OutOfTimeError as late:
            reason = str(late)
        except KeyboardInterrupt:
            record_interrupt()
            reason = "it was interrupted"
        return self._finished(self.best, reason)

    def _refine(self, candidate: Candidate) -> str:
        """Run the rounds after the first; returns why they ended early, or ""."""
        stalled = 0
        while not candidate.within_tolerance:
            reason = self._stop_reason(candidate, stalled)
            if reason:
                return reason
            previous, candidate = candidate, self._next(candidate)
            if self.best is previous and candidate.contradicts(previous):
                self.best = previous.corrected(candidate)
            else:
                self.best = self.best.compared_with(candidate)
            smaller = candidate.larger_error < 0.5 * self.best.larger_error
            stalled = 0 if smaller or np.isnan(self.best.error) else stalled + 1
            if candidate.better_than(self.best):
                self.best = candidate
        self.best = candidate
        return ""

    def _evaluated(
        self, solution: Solution, asked_by: str = "", previous_decrease: float | None = None
    ) -> Candidate:
        """A solution with its estimated error, recorded as a round.

        asked_by: see Round. previous_decrease: see FinerSolution.
        """
        raise_if_interrupted()
        began = time.perf_counter()
        left = self.deadline.seconds_left
        candidate = Candidate.of(solution, self.tolerance, left, previous_decrease)
        candidate, more = _confirmed(candidate)
        grid = solution.trajectory.grid
        points = sum(len(scheme.points) * len(index) for scheme, index in grid.groups)
        seconds = solution.solve_seconds + time.perf_counter() - began
        error, steps = candidate.error, solution.nit + more
        done = Round(grid.intervals, points, solution.cost, error, steps, seconds, asked_by)
        self.rounds.append(done)
        if self.on_round is not None:
            self.on_round(done)
        return candidate

    def _stop_reason(self, candidate: Candidate, stalled: int) -> str:
        """Why no finer grid is tried; "" if one is."""
        raise_if_interrupted()
        solution = candidate.solution
        if not solution.success:
            return f"the last solve ended in {solution.status}"
        if self.deadline.passed:
            return "the time limit was reached"
        assert solution.problem is not None
        if candidate.is_at_floor:
            bound = "the tolerance of limits" if solution.problem.limited else "rounding"
            return f"{bound} allows no smaller error"
        if stalled >= MAX_STALLED_ROUNDS:
            return f"the last {MAX_STALLED_ROUNDS} grids did not reduce the error"
        if len(self.rounds) >= MAX_ROUNDS:
            return f"the maximum of {MAX_ROUNDS} grids was reached"
        if self.rounds[-1].points > MAX_POINTS:
            return f"a grid has {self.rounds[-1].points:,} points"
        return ""

    def _next(self, candidate: Candidate) -> Candidate:
        """The solution on the next grid, which may be that of the finer solution."""
        problem, finer = candidate.solution.problem, candidate.finer
        assert problem is not None
        grid = next_grid(candidate)
        previous = None
        if finer is None:
            fine, known = problem.on(grid), candidate.solution
            along = _along(known.central, problem, fine)
            return self._evaluated(self._solved(fine, known.trajectory, along), candidate.asks)
        if grid is finer.problem.grid:
            solution = finer.finish()
            fine = finer.problem
            previous = None if solution is None else finer.cost_decrease(solution)
        else:
            fine, solution = problem.on(grid), None
        if solution is None:
            along = _along(finer.central, finer.problem, fine)
            solution = self._solved(fine, interpolated_to(finer, fine), along)
        return self._evaluated(solution, candidate.asks, previous)

    def _solved(
        self,
        problem: TrajectoryProblem,
        guess: Trajectory | DiscretePath,
        along: CentralPath | None,
    ) -> Solution:
        """Solve with the remaining time, from a motion on another grid.

        along: central path of that motion on the grid of the problem; None for none.
        """
        taken, seconds = 0, 0.0
        # A motion would be moved out of its obstacles once more, were it not for `near`. Within
        # limits alone a solve from the guess takes fewer steps, where it ends well.
        guessed = isinstance(guess, Trajectory)
        for near in (True,) if problem.distances is not None else (guessed, True):
            solution = solved_on_grid(
                problem,
                Start(guess, along, None if along is None else LEVEL, near),
                max_iterations=self.max_iterations,
                time_limit=self.deadline.seconds_left,
                barrier=self.tolerance.barrier,
            )
            taken, seconds = taken + solution.nit, seconds + solution.solve_seconds
            if solution.status is Status.ITERATION_LIMIT and problem.limited:
                # continued from there, where intervals may have been halved
                problem, guess = solution.problem or problem, solution.trajectory.path
            elif solution.status is not Status.INFEASIBLE:  # the last grid has a motion
                break
        return dataclasses.replace(solution, nit=taken, solve_seconds=seconds)

    def _finished(self, chosen: Candidate, reason: str) -> Solution:
        """The chosen solution with its accuracy."""
        solution, finer, known = chosen.solution, chosen.finer, chosen.error_of_cost
        if finer is None and not reason:
            reason = "no nearby solution was found on a finer grid"
        if chosen.contradicted > 0:
            finer = None
            reason = f"{reason}, and on a finer grid the solver reached another minimum"
        reached = (
            bool(chosen.error <= self.tolerance.size) and chosen.is_carried and chosen.is_trusted
        )
        solution = with_estimate(solution, known)
        accuracy = Accuracy(
            self.tolerance,
            chosen.error,
            reached,
            "" if reached else reason,
            tuple(self.rounds),
            None if finer is None else partial(estimate_against, solution, finer, self._frame),
            chosen.along,
            solution.problem is not None and solution.problem.time_weight > 0.0,
        )
        steps = sum(done.nit for done in self.rounds) or solution.nit
        message = solution.message
        if solution.success:
            message = f"a minimum of cost {solution.cost:.10g} after {steps} steps"
            message += f" on {len(self.rounds)} grids" if len(self.rounds) > 1 else ""
        if interrupted() and not reached:
            if solution.success:
                message = (
                    f"interrupted; the motion is the best so far, of cost {solution.cost:.10g}"
                )
            solution = dataclasses.replace(solution, success=False, status=Status.INTERRUPTED)
        return dataclasses.replace(
            solution,
            message=f"{message.removesuffix('.')}; {accuracy}",
            nit=steps,
            accuracy=accuracy,
        )

    @property
    def _frame(self) -> str | None:
        return self.tolerance.frame


def _confirmed(candidate: Candidate) -> tuple[Candidate, int]:
    """A candidate within the tolerance, compared with halves of the intervals in a flat valley.

    And the number of steps that this took.
    """
    if candidate.finer is None or not candidate.within_tolerance:
        return candidate, 0
    halves = solved_on_halves(candidate.solution, candidate.finer)
    if halves is None:
        return candidate, 0
    return candidate.compared_with(Candidate(halves, candidate.tolerance)), halves.nit


def _along(
    central: CentralPath | None, known: TrajectoryProblem, problem: TrajectoryProblem
) -> CentralPath | None:
    """A central path on another grid; None without a path or obstacles.

    In a solution some pairs are at their least distance, so that steps from it are short; where the
    barrier was larger, there is room.
    known: the problem that the path belongs to. problem: the one on the other grid.
    """
    if central is None or problem.distances is None:
        return None
    return central.resampled(known, problem)
