"""Automatic continuation: a solve that ran out of iterations goes on from its motion."""

from __future__ import annotations

import dataclasses

from hovi.planning.search.job import Job
from hovi.planning.solver.solver import Solution, solve_on_grid
from hovi.planning.solver.status import Status
from hovi.system.deadline import Deadline
from hovi.system.interruption import record_interrupt
from hovi.system.progress import Progress

MAX_SOLVES = 12
"""Maximum number of solves, each of the job's number of iterations."""
STOPPED = Status.TIME_LIMIT, Status.INTERRUPTED
"""Statuses that end a search."""
UNUSABLE = Status.DIVERGED, Status.INFEASIBLE
"""Statuses without a useful motion."""


def may_help(solution: Solution) -> bool:
    """Whether a direct solve ran out of iterations, so that more steps may find a minimum."""
    return solution.status is Status.ITERATION_LIMIT and solution.nit > 0


def solve_by_continuation(
    job: Job,
    failed: Solution,
    deadline: Deadline | None = None,
    progress: Progress | None = None,
) -> Solution:
    """A minimum that the direct solve did not reach, or the best motion by more steps from it.

    failed: the direct solve, at its iteration limit. deadline: of all solves together; none if
    None. progress: called before each. The message says how it went; nit counts the steps of the
    last solve only.
    """
    deadline, last, best, steps = deadline or Deadline(), failed, failed, 0
    try:
        for i in range(MAX_SOLVES):
            if progress is not None:
                progress("continuation: more steps from the last motion", i / MAX_SOLVES)
            last = solve_on_grid(
                job.problem(),
                last.trajectory,
                max_iterations=job.options.max_iterations,
                time_limit=deadline.seconds_left,
                barrier=job.barrier,
            )
            steps += last.nit
            if last.success or (last.status not in UNUSABLE and last.cost < best.cost):
                best = last
            if last.status is not Status.ITERATION_LIMIT:
                break
        if last.status in STOPPED:
            best = dataclasses.replace(best, status=last.status)
    except KeyboardInterrupt:
        record_interrupt()
        best = dataclasses.replace(best, status=Status.INTERRUPTED)
    return _with_sentence(best, failed, steps)


def how_ended(status: Status) -> str:
    """What ended a search, a status of STOPPED, as a predicate."""
    return "was interrupted" if status is Status.INTERRUPTED else "reached the time limit"


def _with_sentence(best: Solution, failed: Solution, steps: int) -> Solution:
    """The solution with a sentence about the continuation in its message."""
    sentence = "Continuation found no minimum."
    if best.success:
        sentence = f"The direct solve ended in {failed.status}; continuation found this "
        sentence += f"minimum by {steps} more steps."
    elif best.status in STOPPED:
        sentence = f"Continuation {how_ended(best.status)}."
    message = f"{best.message} {sentence}".rstrip()
    return dataclasses.replace(best, message=message, problem=None)
