"""Refinement of the minima of a search: to the requested grid, tolerance or best duration."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.trajectory import Trajectory
from hovi.optimize.start import Start
from hovi.planning.problem.clock import Clock
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.time_price import TimePrice
from hovi.planning.problem.tolerance import Round, Tolerance
from hovi.planning.refinement.adaptive import Refinement
from hovi.planning.refinement.faults.narrow_features import features_of
from hovi.planning.refinement.inactive_limits import (
    far_from_limits,
    with_limits_again,
    without_limits,
)
from hovi.planning.search.free_duration import FreeDuration, SolveFor
from hovi.planning.search.job import Job, split_for_charts
from hovi.planning.search.multistart import Pool, default_processes, distinct
from hovi.planning.solver.initial_path import guess_path
from hovi.planning.solver.solver import Solution, solved_on_grid
from hovi.planning.solver.status import Status
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline
from hovi.system.interruption import interrupted
from hovi.system.progress import Progress

if TYPE_CHECKING:
    from hovi.planning.search.free_segments import FreeSegments
    from hovi.planning.search.joint_duration import OnGrid

Array = npt.NDArray[np.float64]

MAX_CHART_ROUNDS = 4
"""Maximum number of rounds that halve intervals in which an orientation turns too far."""
MAX_REFINED = 6
"""Maximum number of coarse minima that are refined and ranked."""
MAX_FEATURE_ROUNDS, MAX_FEATURE_INTERVALS = 6, 600
"""Maximum number of grids with nodes where a minimum has narrow features, and of their intervals.
"""
REFINING = 0.9
"""Progress from which minima are refined, between 0 and 1."""
LEAST_STEPS = 2
"""Number of steps on the requested grid without time for which it is not tried."""
_Each = TypeVar("_Each")


@dataclass(frozen=True, eq=False)
class FinalStages:
    """The refinement of the minima of a search.

    fine: the requested job. deadline: of the whole search.
    """

    fine: Job
    deadline: Deadline
    progress: Progress

    def to_requested_grid(
        self, found: list[Solution], clock: Clock | None = None
    ) -> list[Solution]:
        """The best minima on the requested grid, ranked there.

        clock: of motions with durations of their own, whose order is kept.

        If the time left is too short for a few steps there, the best motion so far.
        """
        if not self.deadline.allows(LEAST_STEPS * self._step_seconds(found[0])):
            reached = f"the requested grid of {self.fine.grid.intervals:,} intervals was reached"
            why = f"the time limit leaves too little time for a solve before {reached}"
            return [ended_early(found[0], Status.TIME_LIMIT, why)]
        if clock is not None:
            return self._with_their_durations(clock, found[:MAX_REFINED])
        problem = self.fine.problem()
        guesses = [guess_path(problem, s.trajectory) for s in found[:MAX_REFINED]]
        self.progress(f"refining {len(guesses)} of {len(found)} minima", REFINING)
        processes = self.fine.options.processes or default_processes()
        pool = Pool(self.fine, processes if len(guesses) > 1 else 1, self.deadline)
        solved = pool.solve_all(guesses)
        if not solved.solutions:
            why = f"the requested grid was not reached, since {solved.lost[0]}"
            return [ended_early(found[0], Status.INTERRUPTED, why)]
        return distinct(solved.solutions)

    def _with_their_durations(self, clock: Clock, found: list[Solution]) -> list[Solution]:
        """Each on the requested grid, stretched to its duration; minima come first."""
        self.progress(f"refining {len(found)} motions", REFINING)
        solve_for = self._lasting(clock, self.fine.grid)
        refined = [
            solve_for(clock.length(each.trajectory.grid), each.trajectory)
            for each in self._until_deadline(found)
        ]
        return sorted(refined, key=lambda each: not each.success)

    def _step_seconds(self, coarse: Solution) -> float:
        """Estimated time of a step on the requested grid, from that on a coarser one, in [s]."""
        step = coarse.solve_seconds / max(coarse.nit, 1)
        return step * self.fine.grid.intervals / coarse.trajectory.grid.intervals

    def to_tolerance(self, tolerance: Tolerance, found: list[Solution]) -> list[Solution]:
        """The best minima to a tolerance, each on its own grid."""
        problem, refined = self.fine.problem(), []
        for i, solution in enumerate(self._until_deadline(found[:MAX_REFINED])):
            which = f"minimum {i + 1} of {min(len(found), MAX_REFINED)}: " if len(found) > 1 else ""
            known = dataclasses.replace(solution, problem=on_grid_of(problem, solution))
            refined.append(self.refined(tolerance, which, known))
        return distinct(refined)

    def with_best_durations(self, free: FreeDuration, found: list[Solution]) -> list[Solution]:
        """The best minima, each with its best duration, the cheapest first."""
        results: list[Solution] = []
        best = found[:MAX_REFINED]
        for i, solution in enumerate(self._until_deadline(best)):
            which = f"{i + 1} of {len(best)} motions"
            self.progress(f"best duration of {which}", REFINING)
            results.append(self._with_best_duration(free, solution, which))
        return distinct(results)

    def with_best_segments(self, free: FreeSegments, found: Solution) -> Solution:
        """A minimum with the best durations of its segments, to the tolerance if there is one."""
        # Here, as for `_with_best_duration`: most plans start without these modules.
        from hovi.planning.search.free_segments import best_segments, lengths_in_words
        from hovi.planning.search.free_to_tolerance import MAX_GRIDS

        job, steps, tolerance = self.fine, 0, self.fine.tolerance
        best, rounds = found, _rounds(found)
        for _ in range(MAX_GRIDS):
            best = dataclasses.replace(best, problem=on_grid_of(job.problem(), best))
            job, best, edges = best_segments(free, job, best, self._solver_of, self._solve_jointly)
            steps += best.nit
            if tolerance is None or not best.success:
                break
            refined = dataclasses.replace(self, fine=job).refined(tolerance, "", best)
            settled = refined.trajectory.grid is best.trajectory.grid
            best, rounds = refined, (*rounds, *_rounds(refined))
            if settled or not refined.success:
                break
        said = best.message
        if best.success and tolerance is None:
            said = f"a minimum of cost {best.cost:.10g} after {steps} steps."
        message, accuracy = f"{said} {lengths_in_words(job)}{edges}", best.accuracy
        if accuracy is not None:
            accuracy = dataclasses.replace(accuracy, rounds=rounds)
        return dataclasses.replace(best, nit=steps, message=message, accuracy=accuracy)

    def _solver_of(self, job: Job, clock: Clock) -> OnGrid:
        return partial(dataclasses.replace(self, fine=job)._lasting, clock)

    def in_charts(self, best: Solution) -> Solution:
        """The solution on a grid on which no orientation turns by more than pi in an interval.

        Intervals in which one does are halved, at most MAX_CHART_ROUNDS times.
        """
        if self.fine.scene.robot.space.flat:
            return best
        for _ in range(MAX_CHART_ROUNDS):
            if interrupted():
                break
            on_its_grid = self.fine.on(best.trajectory.grid)
            wide = on_its_grid.problem().ld.turns(best.trajectory.path) > np.pi
            if not wide.any() or self.deadline.passed:
                break
            finer = self.fine.on(on_its_grid.grid.halved(wide))
            best = self._solve(split_for_charts(finer, best.trajectory), best.trajectory)
        return best

    def _until_deadline(self, found: Sequence[_Each]) -> Iterator[_Each]:
        """Each of them until the deadline or an interrupt; the first one in any case."""
        for i, each in enumerate(found):
            late = self.deadline.passed
            if i > 0 and (late or interrupted()):
                break
            yield each

    def refined(self, tolerance: Tolerance, which: str, known: Solution) -> Solution:
        """A minimum to a tolerance, refined without its limits if it is far from them."""
        refinement = partial(
            Refinement,
            tolerance,
            self.fine.options.max_iterations,
            self.deadline,
            partial(self._report_round, which),
        )
        if far_from_limits(known):
            better = with_limits_again(refinement().run(without_limits(known)), known)
            if better is not None:
                return better
        return refinement().run(known)

    def seeing_features(self, tolerance: Tolerance, best: Solution) -> Solution:
        """The minimum on grids with nodes where its points miss a narrow feature of an effect.

        A wall in q that a motion crosses, for instance, at most MAX_FEATURE_ROUNDS times: what is
        missed after that is left to the last check.
        """
        for _ in range(MAX_FEATURE_ROUNDS):
            known = best.success and not interrupted() and not self.deadline.passed
            features = features_of(best) if known else None
            if features is None or not features.fault or features.along.fault:
                break
            grid = features.seen_by(best.trajectory.grid)
            if grid.intervals > MAX_FEATURE_INTERVALS:
                break
            self.progress("looking at narrow features again", REFINING)
            job = split_for_charts(self.fine.on(grid), best.trajectory)
            again = self._solve(job, best.trajectory)
            if not again.success:
                break
            again = dataclasses.replace(again, problem=again.problem or job.problem())
            refined = self.refined(tolerance, "", again)
            best = refined if refined.success else best
        return best

    def _report_round(self, which: str, done: Round) -> None:
        text = f"{which}{done.intervals} intervals, estimated error {done.error:.1e}"
        self.progress(text, REFINING)

    def _with_best_duration(self, free: FreeDuration, solution: Solution, which: str) -> Solution:
        """A minimum with its best duration, to the tolerance if there is one."""
        # Here, since most plans have a given duration, and start without these modules.
        from hovi.planning.search.free_to_tolerance import free_to_tolerance
        from hovi.planning.search.joint_duration import best_on_its_grid

        on_grid = partial(self._lasting, free.clock)
        first = dataclasses.replace(solution, problem=on_grid_of(self.fine.problem(), solution))
        if not solution.success and solution.status is not Status.INFEASIBLE:
            length = free.clock.length(self.fine.grid)
            first = on_grid(self.fine.grid)(length, solution.trajectory)

        def jointly(first: Solution) -> Solution | None:
            return self._solve_jointly(free.price, np.array([free.length(first)]), first)

        if self.fine.tolerance is None:
            return best_on_its_grid(free, on_grid, first, jointly=jointly).with_time()
        refine = partial(self.refined, self.fine.tolerance, f"{which}: ")
        return free_to_tolerance(free, on_grid, refine, first, jointly)

    def _solve_jointly(self, price: TimePrice, now: Array, first: Solution) -> Solution | None:
        """A minimum in the motion and lengths of parts from a motion; None where not supported."""
        from hovi.planning.search.joint_duration import joint_minimum

        if first.problem is None:
            return None
        return joint_minimum(
            first.problem,
            first.trajectory.path,
            price,
            now,
            max_iterations=self.fine.options.max_iterations,
            time_limit=self.deadline.seconds_left,
            near=True,
            barrier=self.fine.barrier,
        )

    def _lasting(self, clock: Clock, grid: Grid) -> SolveFor:
        """A solver on a grid whose free part is stretched to each length."""

        def solve_for(length: float, guess: Trajectory) -> Solution:
            stretched = clock.grid(grid, clock.length(grid), length)
            job = self.fine.lasting(clock, length, grid=stretched)
            if clock.whole:
                return self._solve(job, guess)
            order, now = job.grid.order, clock.length(guess.grid)
            own = partial(guess.jet, order=max(order, 2))
            path = job.problem().path(clock.curve(own, now, length, order))
            return self._solve(job, Start(path, near=True))

        return solve_for

    def _solve(self, job: Job, guess: Trajectory | Start[DiscretePath, None]) -> Solution:
        left, most = self.deadline.seconds_left, job.options.max_iterations
        return solved_on_grid(job.problem(), guess, max_iterations=most, time_limit=left)


def _rounds(found: Solution) -> tuple[Round, ...]:
    """The grids on which a solution was refined."""
    return () if found.accuracy is None else found.accuracy.rounds


def ended_early(best: Solution, status: Status, why: str) -> Solution:
    """The best motion so far, without success. why: a clause."""
    message = (
        f"{why}; the motion is the best so far, on {best.trajectory.grid.intervals} intervals of "
        f"{best.trajectory.duration:.10g} s, of cost {best.cost:.10g}."
    )
    return dataclasses.replace(best, success=False, status=status, message=message)


def with_tolerance(found: Solution, tolerance: Tolerance) -> Solution:
    """A solution that was refined to a finer tolerance, as one for the tolerance that was given."""
    known = found.accuracy
    assert known is not None
    accuracy = dataclasses.replace(known, tolerance=tolerance)
    message = found.message.replace(str(known), str(accuracy))
    return dataclasses.replace(found, accuracy=accuracy, message=message)


def on_grid_of(problem: TrajectoryProblem, solution: Solution) -> TrajectoryProblem:
    """The problem on the solution's grid: intervals may have been split, or have more points."""
    grid = solution.trajectory.grid
    return problem if grid.equals(problem.grid) else problem.on(grid)
