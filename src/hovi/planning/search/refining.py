"""From the minima of a search to what was asked for: the grid, the tolerance, the best duration."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

from hovi.discrete.grid import Grid
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Round, Tolerance
from hovi.planning.refinement.adaptive import refine_to_tolerance
from hovi.planning.refinement.inactive_limits import (
    far_from_limits,
    with_limits_again,
    without_limits,
)
from hovi.planning.search.free_duration import (
    FreeDuration,
    SolveFor,
    free_to_tolerance,
    solve_duration,
)
from hovi.planning.search.job import Job, Progress, with_room
from hovi.planning.search.multistart import Pool, default_processes, distinct
from hovi.planning.solver.solver import Solution, guess_path, solve
from hovi.system.deadline import Deadline
from hovi.system.interruption import interrupted

CHART_ROUNDS = 4
"""How often intervals are halved in which an orientation turns too far."""
REFINED = 6
"""Coarse minima that are refined and ranked on the grid that was asked for."""
_Each = TypeVar("_Each")


@dataclass(frozen=True, eq=False)
class Refinement:
    """What is done to the minima of a search.

    fine: what was asked for. deadline: of the whole search.
    """

    fine: Job
    deadline: Deadline
    progress: Progress

    def on_the_grid(self, found: list[Solution]) -> list[Solution]:
        """The best minima on the grid that was asked for, ranked there."""
        problem = self.fine.problem()
        guesses = [guess_path(problem, s.trajectory) for s in found[:REFINED]]
        self.progress(f"refining {len(guesses)} of {len(found)} minima", 0.9)
        processes = self.fine.options.processes or default_processes()
        pool = Pool(self.fine, processes if len(guesses) > 1 else 1, self.deadline)
        return distinct(pool.solve_all(guesses))

    def to_tolerance(self, tolerance: Tolerance, found: list[Solution]) -> list[Solution]:
        """The best minima to a tolerance, each on a grid of its own."""
        problem, refined = self.fine.problem(), []
        for i, solution in enumerate(self._in_time(found[:REFINED])):
            which = f"minimum {i + 1} of {min(len(found), REFINED)}: " if len(found) > 1 else ""
            known = dataclasses.replace(solution, problem=on_grid_of(problem, solution))
            refined.append(self._refined(tolerance, which, known))
        return distinct(refined)

    def in_best_time(self, free: FreeDuration, found: list[Solution]) -> list[Solution]:
        """The best minima, each with the duration that is best for it, the cheapest first."""
        freed: list[Solution] = []
        best = found[:REFINED]
        for i, solution in enumerate(self._in_time(best)):
            which = f"{i + 1} of {len(best)} motions"
            self.progress(f"best duration of {which}", 0.9)
            freed.append(self._freed(free, solution, which))
        return distinct(freed)

    def in_charts(self, best: Solution) -> Solution:
        """The solution where no orientation turns by half a turn within an interval.

        Intervals in which one does are halved, at most CHART_ROUNDS times.
        """
        if self.fine.scene.robot.space.flat:
            return best
        for _ in range(CHART_ROUNDS):
            if interrupted():
                break
            on_its_grid = self.fine.on(best.trajectory.grid)
            wide = on_its_grid.problem().ld.turns(best.trajectory.path) > np.pi
            if not wide.any() or self.deadline.passed:
                break
            finer = self.fine.on(on_its_grid.grid.halved(wide))
            best = self._solve(with_room(finer, best.trajectory), best.trajectory)
        return best

    def _in_time(self, found: Sequence[_Each]) -> Iterator[_Each]:
        """Each of them until time is up or a person asks for an end, the first in any case."""
        for i, each in enumerate(found):
            late = self.deadline.passed
            if i > 0 and (late or interrupted()):
                break
            yield each

    def _refined(self, tolerance: Tolerance, which: str, known: Solution) -> Solution:
        """A minimum that knows its problem to a tolerance; limits that are far do not limit it."""
        refine = partial(
            refine_to_tolerance,
            tolerance=tolerance,
            max_iterations=self.fine.options.max_iterations,
            on_round=partial(self._report_round, which),
        )
        better = None
        if far_from_limits(known):
            free = refine(without_limits(known), time_limit=self.deadline.seconds_left)
            better = with_limits_again(free, known)
        return refine(known, time_limit=self.deadline.seconds_left) if better is None else better

    def _report_round(self, which: str, done: Round) -> None:
        text = f"{which}{done.intervals} intervals, estimated error {done.error:.1e}"
        self.progress(text, 0.9)

    def _freed(self, free: FreeDuration, solution: Solution, which: str) -> Solution:
        """A minimum with its best duration, to the tolerance where there is one."""
        solve_for = self._stretched(self.fine.grid)
        first = solve_for(free.first, solution.trajectory)
        if self.fine.tolerance is None:
            return solve_duration(free, solve_for, first)
        refine = partial(self._refined, self.fine.tolerance, f"{which}: ")
        return free_to_tolerance(free, self._stretched, refine, first)

    def _stretched(self, grid: Grid) -> SolveFor:
        """What solves on a grid that is stretched to a duration."""

        def solve_for(T: float, guess: Trajectory) -> Solution:
            stretched = Grid(grid.steps * (T / grid.duration), grid.schemes)
            return self._solve(self.fine.on(stretched), guess)

        return solve_for

    def _solve(self, job: Job, guess: Trajectory) -> Solution:
        left, most = self.deadline.seconds_left, job.options.max_iterations
        return solve(job.problem(), guess, max_iterations=most, time_limit=left)


def on_grid_of(problem: TrajectoryProblem, solution: Solution) -> TrajectoryProblem:
    """The problem on the grid that the solution needed, where limits split its intervals."""
    grid = solution.trajectory.grid
    same = np.array_equal(grid.steps, problem.grid.steps)
    return problem if same else problem.on(grid)
