"""The search for the best motion: explore coarsely, refine the best minima, then rank them."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Self

import numpy as np

from hovi.discrete.grid import Grid
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.clearance.clearance_violation import near_pairs
from hovi.planning.paths.first_guesses import FirstGuesses, first_guesses
from hovi.planning.problem.clock import Clock
from hovi.planning.problem.notation.supported import require_given_duration
from hovi.planning.problem.presolve.ramps import graded_to_ramps
from hovi.planning.refinement.error_estimate import with_metadata
from hovi.planning.refinement.faults.narrow_features import NARROW
from hovi.planning.refinement.hp_refinement import galerkin_with_more_points
from hovi.planning.refinement.resolution import Resolution, resolved
from hovi.planning.search.branch_choice import Ends
from hovi.planning.search.continuation import UNUSABLE, may_help, solve_by_continuation
from hovi.planning.search.final_stages import (
    MAX_REFINED,
    REFINING,
    FinalStages,
    ended_early,
    on_grid_of,
    with_tolerance,
)
from hovi.planning.search.free_duration import FreeDuration
from hovi.planning.search.job import Job, split_for_charts
from hovi.planning.search.multistart import Exploration, Pool, default_processes, explore
from hovi.planning.solver.initial_path import guess_path
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import STOPPED, Status
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError
from hovi.system.interruption import interrupted, raise_if_interrupted, record_interrupt
from hovi.system.progress import Progress

if TYPE_CHECKING:
    from hovi.planning.search.free_segments import FreeSegments

COARSE_INTERVALS = 80
"""Number of intervals of the coarse grid, used first for grids with more than twice as many."""
EXPLORATION_FRACTION = 0.7
"""Fraction of the time limit for the exploration, if its minima are refined afterwards."""
SOLVING_FRACTION = 0.9
"""Fraction of the time limit for solving, if a finer grid is compared afterwards."""
COMPARING = 0.95
"""Progress from which a finer grid is compared, between 0 and 1."""


@dataclass(frozen=True, eq=False)
class Search:
    """The search for the best motion of a job.

    fine: the requested job, with the guess among its options. deadline: of the whole search.
    without: the same without self-collision, which is searched first; None where there is none.
    free: bounds of a free duration; None for a given one. ends: as they were chosen from branches.
    halved: whether the intervals of the job were halved, since it was infeasible before.
    """

    fine: Job
    deadline: Deadline
    progress: Progress
    free: FreeDuration | None = None
    without: Job | None = None
    ends: Ends | None = None
    segments: FreeSegments | None = None
    halved: bool = False

    def run(self, began: float) -> Solution:
        """The best solution, with its times. began: of the plan, by the clock."""
        for job in filter(None, (self.fine, self.without)):
            job.problem()  # outside of the deadline: every solution has its problem
        if self._free:
            require_given_duration(self.fine.problem())
        started = time.perf_counter()
        with self.deadline.in_force():
            best, minima = self._run() if self.without is None else self._begun_at(self.without)
        return dataclasses.replace(
            best,
            minima=minima,
            setup_seconds=started - began,
            solve_seconds=time.perf_counter() - started,
        )

    def _begun_at(self, job: Job) -> tuple[Solution, tuple[float, ...]]:
        """The best solution, and the costs of all minima on the requested grid.

        Most motions keep links apart without being asked to. So where that is asked, the motion
        without is found first, which takes less time and is a minimum of both problems then.
        job: without self-collision.
        """
        best, costs = dataclasses.replace(self, fine=job)._run()
        try:
            whole = self._of_whole(best)
        except OutOfTimeError:
            why = "the time limit was reached before distances between links were looked at"
            return ended_early(best, Status.TIME_LIMIT, why), ()
        if whole is None and interrupted():
            why = "it was interrupted before a motion that keeps links apart was looked for"
            return ended_early(best, Status.INTERRUPTED, why), ()
        return self._over_branches() if whole is None else (whole, costs)

    def _over_branches(self) -> tuple[Solution, tuple[float, ...]]:
        """As `_run`, or for another branch of the ends, if that is better.

        The branch was chosen by motions in which links may meet; the other one by motions in which
        they do not.
        """
        best, costs = self._run()
        ended = best.status in STOPPED or interrupted() or self.free is not None
        if ended or self.ends is None:
            return best, costs
        cost = best.cost if best.success else np.inf
        ends = self.ends.cheaper_clear(cost, self.deadline)
        if ends is None:
            return best, costs
        self.progress("from another configuration at the goal", REFINING)
        other = dataclasses.replace(self, ends=ends, fine=self.fine.to(ends.goal))
        found, further = other._run()
        return (found, further) if found.success and found.cost < cost else (best, costs)

    def _of_whole(self, free: Solution) -> Solution | None:
        """A solution without self-collision as one with; None if links come too near in it."""
        clearance = self.fine.problem().clearance
        assert clearance is not None
        assert free.problem is not None
        assert free.problem.clearance is not None
        if clearance.during:  # by its own durations
            during = free.problem.clearance.during
            clearance = dataclasses.replace(clearance, during=during)
        problem = on_grid_of(free.problem, free).with_clearance(clearance)
        kept, near = dataclasses.replace(free, problem=problem), 0
        ended = free.status in (*STOPPED, Status.INFEASIBLE)
        if not ended and problem.distances is not None:  # there are pairs, within reach
            near = len(near_pairs(free.trajectory, problem.distances, clearance.margin))
        if near:
            return None
        motion = with_metadata(free.trajectory, clearance=clearance.to_dict())
        kept = dataclasses.replace(kept, trajectory=motion)
        known = free.check is not None and free.error_estimate is not None
        return dataclasses.replace(kept, check=Resolution.of(kept)) if known else kept

    def _run(self) -> tuple[Solution, tuple[float, ...]]:
        """The best solution, and the costs of all minima, with all distances from the beginning."""
        job = self._coarse()
        explored = self._explored(job)
        if (again := self._on_finer_grid(explored)) is not None:
            return again._run()
        if self.free is None or explored.minima[0].success:
            return self._finished(job, explored)
        return self._from_another_duration(self.free, explored)

    def _on_finer_grid(self, explored: Exploration) -> Self | None:
        """The search once more where it called its problem infeasible, as its grid may be coarse.

        With nodes where joints that are pressed for time speed up and slow down, also on a grid
        that is given, since limits split its intervals in any case; and then on halved intervals,
        once, but not among obstacles, where the guess is to blame. None if neither is left.
        """
        fine, found = self.fine, explored.minima[0]
        infeasible = found.status is Status.INFEASIBLE and found.nit > 0  # not by a contradiction
        if not infeasible or self.free is not None or interrupted():
            return None
        grid = graded_to_ramps(fine.problem())
        if grid.intervals > fine.grid.intervals:
            return dataclasses.replace(self, fine=fine.on(grid))
        if self.halved or fine.tolerance is None or fine.options.clearance.wanted:
            return None
        return dataclasses.replace(self, fine=fine.on(fine.grid.halved()), halved=True)

    def _from_another_duration(
        self, free: FreeDuration, explored: Exploration
    ) -> tuple[Solution, tuple[float, ...]]:
        """As run, if the exploration at the first duration found no minimum."""
        tried = [(self.fine, explored.minima[0])]
        probing = dataclasses.replace(self, deadline=self.deadline.part(EXPLORATION_FRACTION))
        for T in free.probes(self.fine.problem().limited):
            fine, best = tried[-1]
            if best.success or best.status in STOPPED or interrupted():
                break
            next_one = free.clock.duration(T)
            said = f"no minimum for {fine.grid.duration:.4g} s, trying {next_one:.4g} s"
            self.progress(said, 0.0)
            tried.append(probing._probed(free.clock, T))
        fine, first = min(tried, key=_rank)
        search = dataclasses.replace(self, fine=fine)
        job = search._coarse()
        if fine is not self.fine:
            several = fine.options.starts > 1
            explored = search._explored(job) if several else Exploration([first], 1, False)
        best, minima = search._finished(job, explored)
        if best.status is Status.INFEASIBLE and len(tried) > 1:
            lower, upper = (free.clock.duration(bound) for bound in (free.lower, free.upper))
            others = f"{len(tried) - 1} other durations from {lower:g} to {upper:g} s"
            best = _with_note(best, f"Nor was one found for {others}.")
        return best, minima

    def _probed(self, clock: Clock, length: float) -> tuple[Job, Solution]:
        """The job for another length of its free part, and its solution from one start."""
        options = self.fine.options
        fine = split_for_charts(self.fine.lasting(clock, length), options.guess)
        search = dataclasses.replace(self, fine=fine.with_options(starts=1))
        return fine, search._explored(search._coarse()).minima[0]

    def _finished(self, job: Job, explored: Exploration) -> tuple[Solution, tuple[float, ...]]:
        """The best solution after all stages, and the costs of all minima.

        Where the exploration held the end in a state, that is the goal of all of them.
        """
        if (goal := explored.goal) is not None:
            fine = self.fine.to(goal)
            job = fine if job is self.fine else job.to(goal)
            held = dataclasses.replace(self, fine=fine)
            return held._finished(job, dataclasses.replace(explored, goal=None))
        found = explored.minima
        try:
            for better in self._stages(job, found):
                found = better
        except (KeyboardInterrupt, OutOfTimeError) as stopped:
            found = _ended(found, stopped, "the requested grid or the best duration was reached")
        try:
            found = self._resolved(found)
        except KeyboardInterrupt as stopped:
            found = _ended(found, stopped, "the motion was compared with one on a finer grid")
        best = self._with_ending(found[0], explored)
        problem = best.problem or on_grid_of(self.fine.problem(), best)
        best = dataclasses.replace(best, problem=problem)
        return best, tuple(s.cost for s in found if s.success)

    def _resolved(self, found: list[Solution]) -> list[Solution]:
        """The minima from the cheapest resolved one on; the cheapest of all if none is resolved."""
        checked: list[Solution] = []
        if found[0].success:
            self.progress("comparing with a finer grid", COMPARING)
        for i, solution in enumerate(found[:MAX_REFINED]):
            problem = solution.problem or on_grid_of(self.fine.problem(), solution)
            known = dataclasses.replace(solution, problem=problem)
            after = self._at_finer_tolerances(known, resolved(known))
            checked.append(self._with_duration(after) if solution.success else after)
            if checked[-1].success:
                return [_noting_cheaper(checked), *found[i + 1 :]]
            if self.deadline.passed or interrupted():
                break
        return [self._seeing_features(found[0], checked[0])]

    def _at_finer_tolerances(self, solution: Solution, refused: Solution) -> Solution:
        """A minimum that is unresolved at its tolerance, refined to finer ones until it is not.

        A coarse tolerance may be satisfied on a grid that two finer ones contradict.
        refused: the solution as unresolved, which is returned if no tolerance helps.
        """
        given = self.fine.tolerance
        if given is None or self._free or refused.status is not Status.UNRESOLVED:
            return refused
        if solution.accuracy is not None and solution.accuracy.grows:
            return refused
        stages = FinalStages(self.fine, self.deadline, self.progress)
        for finer in given.finer:
            if self.deadline.passed or interrupted() or NARROW in refused.message:
                break
            solution = stages.refined(finer, "", solution)
            if not solution.success:
                break
            after = resolved(solution)
            if after.success:
                return with_tolerance(after, given)
        return refused

    def _seeing_features(self, solution: Solution, refused: Solution) -> Solution:
        """A motion that was refused for narrow features of effects, on a grid that sees them.

        refused: the solution with the reason. It is kept where there is no such motion.
        """
        tolerance = self.fine.tolerance
        if tolerance is None or self._free or NARROW not in refused.message:
            return refused
        stages = FinalStages(self.fine, self.deadline, self.progress)
        try:
            seen = stages.seeing_features(tolerance, solution)
        except OutOfTimeError:
            return refused
        return refused if seen is solution else resolved(seen)

    @property
    def _free(self) -> bool:
        """Whether any duration is free."""
        return self.free is not None or (self.segments is not None and self.segments.any)

    def _with_duration(self, refused: Solution) -> Solution:
        """The solution, which says its duration if that is free, also where a check refused it."""
        if self.free is None or refused.success:
            return refused
        return _with_note(refused, f"The duration is {refused.trajectory.duration:.10g} s.")

    def _coarse(self) -> Job:
        """The job on the grid of the exploration."""
        grid, options = self.fine.grid, self.fine.options
        continued = isinstance(options.guess, Trajectory) and options.starts == 1
        if grid.intervals <= 2 * COARSE_INTERVALS or continued:
            return self.fine
        coarse = Grid.uniform(
            grid.duration, COARSE_INTERVALS, galerkin_with_more_points(2, grid.order)
        )
        if self.fine.node_times:
            try:
                coarse = coarse.with_nodes(self.fine.node_times)
            except InputError:  # too few nodes for the via points
                return self.fine
        coarse = self.fine.graded(coarse)
        job = split_for_charts(self.fine.on(coarse), self.fine.options.guess)
        return job if job.grid.intervals < grid.intervals else self.fine

    def _explored(self, job: Job) -> Exploration:
        """The minima from all starts; uses part of the time if they are refined afterwards."""
        options = job.options
        whole = job is self.fine and job.tolerance is None and self.free is None
        deadline = self.deadline.part(SOLVING_FRACTION if whole else EXPLORATION_FRACTION)
        pool = Pool(job, options.processes or default_processes(), deadline, self.free)
        first = self._first_guesses(job, deadline)
        return explore(pool, first, options.starts, options.seed, self.progress)

    def _first_guesses(self, job: Job, deadline: Deadline) -> FirstGuesses:
        """The guess, with paths around obstacles that one by name is deep in."""
        options, problem = job.options, job.problem()
        direct = guess_path(problem, options.guess)
        if not isinstance(options.guess, str):
            return FirstGuesses(direct)
        given = options.starts, options.seed, deadline, self.progress
        known = () if self.ends is None else self.ends.found
        if not known:
            return first_guesses(problem, direct, *given)
        best, *others = [guess_path(problem, motion) for motion in known]
        found = first_guesses(problem, best, *given)
        branches = [direct, *others] if options.starts == 1 else [*others, direct]
        return dataclasses.replace(found, branches=tuple(branches), isolated=job.isolated)

    def _continued(self, job: Job, found: list[Solution]) -> list[Solution]:
        """The solutions, or what continuation makes of the best where that found no minimum."""
        options = self.fine.options
        if interrupted() or self.deadline.passed or not options.continuation:
            return found
        if not may_help(job, found[0]):
            return found
        return [solve_by_continuation(job, found[0], self.deadline, self.progress)]

    def _stages(self, job: Job, found: list[Solution]) -> Iterator[list[Solution]]:
        """The minima after each stage: continuation, refinement, best duration.

        Raises KeyboardInterrupt if an interrupt came before the last stage.
        """
        fraction = SOLVING_FRACTION if self.fine.tolerance is None else 1.0
        stages = FinalStages(self.fine, self.deadline.part(fraction), self.progress)
        yield (found := self._continued(job, found))
        if self.fine.tolerance is not None and self.free is None:
            raise_if_interrupted()
            yield (found := stages.to_tolerance(self.fine.tolerance, found))
        elif job is not self.fine:
            raise_if_interrupted()
            clock = None if self.free is None else self.free.clock
            on_grid = stages.to_requested_grid(found, clock)
            yield (found := self._continued(self.fine, on_grid))
        yield (found := [stages.in_charts(found[0]), *found[1:]])
        if self.free is not None:
            raise_if_interrupted()
            yield stages.with_best_durations(self.free, found)
        if self.segments is not None and self.segments.any and found[0].success:
            raise_if_interrupted()
            yield [stages.with_best_segments(self.segments, found[0])]

    def _with_ending(self, best: Solution, explored: Exploration) -> Solution:
        """The best solution, with a note in its message if the search ended early."""
        starts, lost = self.fine.options.starts, len(explored.lost)
        if led := explored.guess_of(best.trajectory):
            best = _with_note(best, led)
        if self.ends is not None and self.ends.compared > 1:
            best = _with_note(best, f"{self.ends.compared} branches of the ends were compared.")
        if explored.done + lost < starts:
            best = _with_note(best, f"The search ended after {explored.done} of {starts} starts.")
        elif interrupted() and best.success:
            best = _with_note(best, "The search was interrupted.")
        if lost > 0:
            causes = " or ".join(dict.fromkeys(explored.lost))
            best = _with_note(best, f"Lost {lost} of {starts} starts: {causes}.")
        return best


def _rank(tried: tuple[Job, Solution]) -> tuple[int, float]:
    """Sort key of durations that were tried: minima, then usable motions, then the longest one."""
    fine, found = tried
    if found.success or found.status not in UNUSABLE:
        return (0 if found.success else 1), 0.0
    return 2, -fine.grid.duration


def _ended(found: list[Solution], stopped: BaseException, what: str) -> list[Solution]:
    """The best solution as no success: an interrupt or the time limit came before `what`."""
    if isinstance(stopped, KeyboardInterrupt):
        record_interrupt()
        return [ended_early(found[0], Status.INTERRUPTED, f"interrupted before {what}")]
    return [ended_early(found[0], Status.TIME_LIMIT, f"{stopped} before {what}")]


def _noting_cheaper(checked: list[Solution]) -> Solution:
    """The last solution, with a note on the cheaper ones before it, which are not resolved."""
    *unresolved, best = checked
    if not unresolved:
        return best
    cheaper = (
        "A cheaper motion was" if len(unresolved) == 1 else f"{len(unresolved)} cheaper ones were"
    )
    return _with_note(best, f"{cheaper} not resolved.")


def _with_note(best: Solution, sentence: str) -> Solution:
    """The solution with one more sentence in its message."""
    return dataclasses.replace(best, message=f"{best.message} {sentence}")
