"""The ladder of continuations: what `plan` climbs by itself when the direct way fails."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError
from hovi.planning.search.homotopies import (
    Rung,
    Way,
    finer_grids,
    growing_gravity,
    lighter_rotors,
    narrowing_limits,
    other_durations,
)
from hovi.planning.search.job import Job, Progress
from hovi.planning.solver.solver import Solution, solve
from hovi.planning.solver.status import Status
from hovi.system.deadline import Deadline
from hovi.system.interruption import record_interrupt

WAYS: dict[str, Way] = {
    "inertia": lighter_rotors,
    "the intervals": finer_grids,
    "gravity": growing_gravity,
    "the duration": other_durations,
    "the limits": narrowing_limits,
}
STEPS = "steps"
"""The name of the way that just goes on from the best motion so far."""
UNLIMITED = "inertia", "the intervals", "gravity", "the duration"
LIMITED = "the limits", "the duration", "the intervals", "inertia", "gravity"
"""Ways in the order in which they are tried, the most promising first."""
INFEASIBLE = "the limits", "the duration"
"""Ways when no motion within the limits was found: the others change none of them."""
AGAIN = 12
"""Solves that go on from the best motion so far."""
ENDED = Status.TIME_LIMIT, Status.INTERRUPTED
"""What ends a climb whatever is left to try."""
WITHOUT_MOTION = Status.DIVERGED, Status.INFEASIBLE
"""What is worse than any motion that is only unfinished."""
HELPED = Status.ITERATION_LIMIT, Status.SADDLE, Status.DIVERGED, Status.INFEASIBLE
"""What a direct solve ends in when climbing may help."""


def may_help(solution: Solution) -> bool:
    """Whether climbing can find what a direct solve did not.

    Not where limits and ends contradict each other or where the guess has no finite cost, both of
    which are seen without a step.
    """
    return solution.status in HELPED and solution.nit > 0


def climb(
    job: Job,
    failed: Solution,
    guess: str | Trajectory = "cubic",
    deadline: Deadline | None = None,
    progress: Progress | None = None,
) -> Solution:
    """A minimum that the direct way did not find, by the first continuation that leads to it.

    failed: what the direct way ended in. guess: for the first rung of every way.
    deadline: for all ways together; none when None.
    progress: told of every rung.
    Returns the minimum, or the best that there is; the message says which way was taken. nit
    counts the steps of the last solve alone.
    """
    ladder = _Ladder(job, guess, deadline or Deadline(), progress)
    best, tried = failed, []
    names = _order(job, failed)
    for i, name in enumerate(names):
        ladder.begin(name, i / len(names), (i + 1) / len(names))
        try:
            found = ladder.go_on(best) if name == STEPS else ladder.climb(WAYS[name](job))
        except KeyboardInterrupt:
            record_interrupt()
            found, ladder.ended = None, Status.INTERRUPTED
        if ladder.rungs > 0:
            tried.append(name)
        if found is not None and found.success:
            return _told(found, f"The direct way ended in {failed.status}; {ladder.told}.")
        best = _better(best, found)
        if ladder.ended is not None:
            best = dataclasses.replace(best, status=ladder.ended)
            return _told(best, f"Continuation in {name} was ended by {ladder.ended}.")
    return _told(best, f"Continuation in {', '.join(tried)} found no minimum." if tried else "")


def _order(job: Job, failed: Solution) -> list[str]:
    """The names of the ways in the order in which they are tried.

    A direct way that ran out of steps in a valley of positive curvature is followed on first.
    """
    if failed.status is Status.INFEASIBLE:
        return list(INFEASIBLE)
    ways = LIMITED if job.limits.bounded.any() else UNLIMITED
    first = failed.status is Status.ITERATION_LIMIT and failed.n_neg == 0
    return [STEPS, *ways] if first else [*ways, STEPS]


@dataclass(eq=False)
class _Ladder:
    """What the ways share: where they start, what they may take, and how far the last one came."""

    job: Job
    guess: str | Trajectory
    deadline: Deadline
    progress: Progress | None
    name: str = field(default="", init=False)
    steps: int = field(default=0, init=False)
    rungs: int = field(default=0, init=False)
    shares: tuple[float, float] = field(default=(0.0, 1.0), init=False)
    ended: Status | None = field(default=None, init=False)

    def begin(self, name: str, first: float, last: float) -> None:
        """A new way, between two shares of all that can be done."""
        self.name, self.steps, self.rungs, self.shares = name, 0, 0, (first, last)

    @property
    def told(self) -> str:
        """How the way led to a minimum."""
        rungs = "1 rung" if self.rungs == 1 else f"{self.rungs} rungs"
        return f"continuation in {self.name} led here over {rungs} and {self.steps} steps"

    def climb(self, rungs: list[Rung]) -> Solution | None:
        """The solution of the job at the end of a way; None where the way breaks off."""
        if not rungs:
            return None
        guess = self.guess
        for i, rung in enumerate([*rungs, Rung("the task itself", self.job)]):
            solution = self._solve(rung, guess, i / (len(rungs) + 1))
            if solution is None or solution.status is Status.INFEASIBLE or self.ended is not None:
                return None
            if solution.status is not Status.DIVERGED:
                guess = solution.trajectory
        return solution

    def go_on(self, best: Solution) -> Solution | None:
        """More steps from the best motion so far; None where it is not just unfinished."""
        found: Solution | None = None
        rung = Rung("on from the best so far", self.job)
        for i in range(AGAIN):
            if self.ended is not None or best.status is not Status.ITERATION_LIMIT:
                break
            found = self._solve(rung, best.trajectory, i / AGAIN)
            best = best if found is None else found
        return found

    def _solve(self, rung: Rung, guess: str | Trajectory, share: float) -> Solution | None:
        """One rung; None where it makes no problem."""
        if self.progress is not None:
            first, last = self.shares
            text = f"continuation in {self.name}: {rung.name}"
            self.progress(text, first + share * (last - first))
        left = self.deadline.seconds_left
        try:
            problem, most = rung.job.problem(), self.job.options.max_iterations
            solution = solve(problem, guess, max_iterations=most, time_limit=left)
        except HoviError:
            return None
        self.steps += solution.nit
        self.rungs += 1
        self.ended = solution.status if solution.status in ENDED else None
        return solution


def _better(best: Solution, found: Solution | None) -> Solution:
    """The cheaper of two motions, of which neither is a minimum."""
    if found is None or found.status in WITHOUT_MOTION:
        return best
    return found if best.status in WITHOUT_MOTION or found.cost < best.cost else best


def _told(solution: Solution, sentence: str) -> Solution:
    message = f"{solution.message} {sentence}".rstrip()
    return dataclasses.replace(solution, message=message, problem=None)
