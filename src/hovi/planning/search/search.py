"""The search for the best motion: explore coarsely, refine the best minima, then rank them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

from hovi.discrete.grid import Grid
from hovi.errors import InputError
from hovi.planning.search.continuation import climb, may_help
from hovi.planning.search.free_duration import FreeDuration
from hovi.planning.search.job import Job, Progress, with_room
from hovi.planning.search.multistart import Exploration, Pool, default_processes, explore
from hovi.planning.search.refining import Refinement
from hovi.planning.solver.solver import Solution, guess_path
from hovi.planning.solver.status import Status
from hovi.schemes import galerkin
from hovi.system.deadline import Deadline
from hovi.system.interruption import interrupted, raise_if_interrupted, record_interrupt

COARSE_INTERVALS = 60
"""Grids with more than twice as many intervals are first solved on a grid of this many."""
EXPLORING = 0.7
"""Share of a time limit that the search may take when its minima are refined afterwards."""


@dataclass(frozen=True, eq=False)
class Search:
    """The search for the best motion of a job.

    fine: what was asked for, its guess among its options. deadline: of everything.
    free: bounds of a free duration; None where it is given.
    """

    fine: Job
    deadline: Deadline
    progress: Progress
    free: FreeDuration | None = None

    def run(self) -> tuple[Solution, tuple[float, ...]]:
        """The best solution, and the costs of all minima on the grid that was asked for."""
        job = self._coarse()
        explored = self._explored(job)
        found = explored.minima
        try:
            for better in self._stages(job, found):
                found = better
        except KeyboardInterrupt:
            record_interrupt()
            found = _interrupted(found[0])
        best = self._with_ending(found[0], explored)
        return best, tuple(s.cost for s in found if s.success)

    def _coarse(self) -> Job:
        """The job on the grid on which its minima are looked for."""
        grid = self.fine.grid
        if grid.intervals <= 2 * COARSE_INTERVALS:
            return self.fine
        coarse = Grid.uniform(grid.duration, COARSE_INTERVALS, galerkin(2))
        if self.fine.via:
            try:
                coarse = coarse.with_nodes([each.time for each in self.fine.via])
            except InputError:  # too few nodes for the via points
                return self.fine
        job = with_room(self.fine.on(coarse), self.fine.options.guess)
        return job if job.grid.intervals < grid.intervals else self.fine

    def _explored(self, job: Job) -> Exploration:
        """The minima from all starts, in a part of the time where refining takes some."""
        options = job.options
        whole = job is self.fine and job.tolerance is None
        deadline = self.deadline if whole else self.deadline.part(EXPLORING)
        pool = Pool(job, options.processes or default_processes(), deadline)
        first = guess_path(job.problem(), options.guess)
        return explore(pool, first, options.starts, options.seed, self.progress)

    def _climbed(self, job: Job, found: list[Solution]) -> list[Solution]:
        """What continuation leads to where there is no minimum among what was found."""
        options = self.fine.options
        if interrupted() or not options.continuation or not may_help(found[0]):
            return found
        return [climb(job, found[0], options.guess, self.deadline, self.progress)]

    def _stages(self, job: Job, found: list[Solution]) -> Iterator[list[Solution]]:
        """The minima of a job after each stage on their way to what was asked for.

        Raises KeyboardInterrupt where a person asked for an end before that.
        """
        refinement = Refinement(self.fine, self.deadline, self.progress)
        yield (found := self._climbed(job, found))
        if self.fine.tolerance is not None and self.free is None:
            raise_if_interrupted()
            yield (found := refinement.to_tolerance(self.fine.tolerance, found))
        elif job is not self.fine:
            raise_if_interrupted()
            yield (found := self._climbed(self.fine, refinement.on_the_grid(found)))
        yield (found := [refinement.in_charts(found[0]), *found[1:]])
        if self.free is not None:
            raise_if_interrupted()
            yield refinement.in_best_time(self.free, found)

    def _with_ending(self, best: Solution, explored: Exploration) -> Solution:
        """The best solution with a message that says how the search ended, if early."""
        starts = self.fine.options.starts
        if explored.done < starts:
            ended = f"The search ended after {explored.done} of {starts} starts."
        elif interrupted() and best.success:
            ended = "The search was interrupted."
        else:
            return best
        return dataclasses.replace(best, message=f"{best.message} {ended}")


def _interrupted(best: Solution) -> list[Solution]:
    """The best so far when a person ends the search before what was asked for was reached."""
    message = (
        "interrupted before the grid or the duration that was asked for was reached; the motion is "
        f"the best so far, on {best.trajectory.grid.intervals} intervals: {best.message}"
    )
    status = Status.INTERRUPTED
    return [dataclasses.replace(best, success=False, status=status, message=message)]
