"""Automatic continuation: `plan` solves easier problems in order if the direct solve fails."""

from __future__ import annotations

import dataclasses
from dataclasses import field

from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError
from hovi.planning.search.homotopies import (
    Homotopy,
    Stage,
    finer_grids,
    growing_gravity,
    lighter_rotors,
    narrowing_limits,
    other_durations,
)
from hovi.planning.search.job import Job
from hovi.planning.solver.solver import Solution, solve_on_grid
from hovi.planning.solver.status import Status
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline
from hovi.system.interruption import record_interrupt
from hovi.system.progress import Progress

HOMOTOPIES: dict[str, Homotopy] = {
    "inertia": lighter_rotors,
    "the intervals": finer_grids,
    "gravity": growing_gravity,
    "the duration": other_durations,
    "the limits": narrowing_limits,
}
STEPS = "steps"
"""The continuation that takes more steps from the best motion so far."""
UNLIMITED_ORDER = "inertia", "the intervals", "gravity", "the duration"
LIMITED_ORDER = "the limits", "the duration", "the intervals", "inertia", "gravity"
"""Homotopies in the order in which they are tried, the most promising first."""
INFEASIBLE_ORDER = "the limits", "the duration"
"""Homotopies for an infeasible problem; the others do not relax the limits."""
MAX_RESTARTS = 12
"""Maximum number of solves from the best motion so far."""
STOPPED = Status.TIME_LIMIT, Status.INTERRUPTED
"""Statuses that end the continuation."""
UNUSABLE = Status.DIVERGED, Status.INFEASIBLE
"""Statuses without a useful motion."""
CONTINUABLE = Status.ITERATION_LIMIT, Status.SADDLE, Status.DIVERGED, Status.INFEASIBLE
"""Statuses of a direct solve after which continuation may find a minimum."""


def may_help(solution: Solution) -> bool:
    """Whether continuation may find a minimum that a direct solve did not.

    Not if limits and ends contradict each other or the guess has no finite cost, both of which are
    detected before the first step; nor where searches from several guesses ended at the same least
    violation of limits.
    """
    if solution.locally_infeasible:
        return False
    return solution.status in CONTINUABLE and solution.nit > 0


def solve_by_continuation(
    job: Job,
    failed: Solution,
    guess: str | Trajectory = "cubic",
    deadline: Deadline | None = None,
    progress: Progress | None = None,
) -> Solution:
    """A minimum that the direct solve did not find, by the first continuation that reaches one.

    failed: result of the direct solve. guess: for the first stage of every homotopy.
    deadline: of all stages together; none if None.
    progress: called before every stage.
    Returns the minimum, or the best motion found; the message names the continuation. nit counts
    the steps of the last solve only.
    """
    run = _Continuation(job, guess, deadline or Deadline(), progress)
    best, tried = failed, []
    names = _order(job, failed)
    for i, name in enumerate(names):
        run.begin(name, i / len(names), (i + 1) / len(names))
        try:
            found = run.restart(best) if name == STEPS else run.follow(HOMOTOPIES[name](job))
        except KeyboardInterrupt:
            record_interrupt()
            found, run.ended = None, Status.INTERRUPTED
        if run.stages > 0:
            tried.append(name)
        if found is not None and found.success:
            sentence = f"The direct solve ended in {failed.status}; {run.summary}."
            return _with_sentence(found, sentence)
        best = _better(best, found)
        if run.ended is not None:
            best = dataclasses.replace(best, status=run.ended)
            return _with_sentence(best, f"Continuation in {name} {how_ended(run.ended)}.")
    sentence = f"Continuation in {', '.join(tried)} found no minimum." if tried else ""
    return _with_sentence(best, sentence)


def _order(job: Job, failed: Solution) -> list[str]:
    """The names of the continuations in the order in which they are tried.

    More steps come first if the direct solve reached its iteration limit at positive curvature, or
    among obstacles, where a motion that is nearly within its bounds is closer than a guess.
    """
    if failed.status is Status.INFEASIBLE:
        return list(INFEASIBLE_ORDER)
    order = LIMITED_ORDER if job.limits.bounded.any() else UNLIMITED_ORDER
    closer = failed.n_neg == 0 or job.options.clearance.wanted
    first = failed.status is Status.ITERATION_LIMIT and closer
    return [STEPS, *order] if first else [*order, STEPS]


@dataclass(eq=False)
class _Continuation:
    """State shared by all continuations, and the progress of the current one.

    stages, steps: of the current continuation. fractions: its range of the overall progress.
    ended: status that ended it, if any.
    """

    job: Job
    guess: str | Trajectory
    deadline: Deadline
    progress: Progress | None
    name: str = field(default="", init=False)
    steps: int = field(default=0, init=False)
    stages: int = field(default=0, init=False)
    fractions: tuple[float, float] = field(default=(0.0, 1.0), init=False)
    ended: Status | None = field(default=None, init=False)

    def begin(self, name: str, first: float, last: float) -> None:
        """Start a continuation that covers progress from `first` to `last`."""
        self.name, self.steps, self.stages, self.fractions = name, 0, 0, (first, last)

    @property
    def summary(self) -> str:
        """The continuation that found the minimum, and its effort."""
        stages = "1 stage" if self.stages == 1 else f"{self.stages} stages"
        return f"continuation in {self.name} found this minimum in {stages} and {self.steps} steps"

    def follow(self, stages: list[Stage]) -> Solution | None:
        """The solution of the job at the end of a homotopy; None if a stage fails."""
        if not stages:
            return None
        guess = self.guess
        for i, stage in enumerate([*stages, Stage("the task itself", self.job)]):
            solution = self._solve(stage, guess, i / (len(stages) + 1))
            if solution is None or solution.status is Status.INFEASIBLE or self.ended is not None:
                return None
            if solution.status is not Status.DIVERGED:
                guess = solution.trajectory
        return solution

    def restart(self, best: Solution) -> Solution | None:
        """More steps from the best motion so far; None unless it is at its iteration limit."""
        found: Solution | None = None
        stage = Stage("more steps from the best motion", self.job)
        for i in range(MAX_RESTARTS):
            if self.ended is not None or best.status is not Status.ITERATION_LIMIT:
                break
            found = self._solve(stage, best.trajectory, i / MAX_RESTARTS)
            best = best if found is None else found
        return found

    def _solve(self, stage: Stage, guess: str | Trajectory, fraction: float) -> Solution | None:
        """Solve one stage; None if its problem is invalid."""
        if self.progress is not None:
            first, last = self.fractions
            text = f"continuation in {self.name}: {stage.name}"
            self.progress(text, first + fraction * (last - first))
        left = self.deadline.seconds_left
        try:
            problem, most = stage.job.problem(), self.job.options.max_iterations
            barrier = stage.job.barrier
            solution = solve_on_grid(
                problem, guess, max_iterations=most, time_limit=left, barrier=barrier
            )
        except HoviError:
            return None
        self.steps += solution.nit
        self.stages += 1
        self.ended = solution.status if solution.status in STOPPED else None
        return solution


def _better(best: Solution, found: Solution | None) -> Solution:
    """The cheaper of two motions, neither of which is a minimum."""
    if found is None or found.status in UNUSABLE:
        return best
    return found if best.status in UNUSABLE or found.cost < best.cost else best


def how_ended(status: Status) -> str:
    """What ended a search, a status of STOPPED, as a predicate."""
    return "was interrupted" if status is Status.INTERRUPTED else "reached the time limit"


def _with_sentence(solution: Solution, sentence: str) -> Solution:
    message = f"{solution.message} {sentence}".rstrip()
    return dataclasses.replace(solution, message=message, problem=None)
