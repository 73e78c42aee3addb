"""Automatic continuation: more steps, or from motions that may take longer.

A solve that ran out of iterations goes on from its motion. Where limits leave no way past the
obstacles from a guess, the motion is found for a longer duration first, which is then shortened.
"""

from __future__ import annotations

import dataclasses
from typing import TypeVar

import numpy as np

from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.errors import HoviError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import Limits
from hovi.planning.search.job import Job
from hovi.planning.solver.solver import Solution, solved_on_grid
from hovi.planning.solver.status import STOPPED, Status
from hovi.system.deadline import Deadline
from hovi.system.interruption import record_interrupt
from hovi.system.progress import Progress

MORE_STEPS = "more steps from the last motion"
"""What is tried after an iteration limit."""
MAX_SOLVES = 12
"""Maximum number of solves that go on, each of the job's number of iterations."""
LONGER = 2.0, 1.5, 1.25, 1.1
"""Durations before the given one, relative to it."""
Goal = TypeVar("Goal", State, State | FrameGoal)
UNUSABLE = Status.DIVERGED, Status.INFEASIBLE
"""Statuses without a useful motion."""


def may_help(job: Job, failed: Solution) -> bool:
    """Whether a direct solve ended such that more steps, or a longer duration, may help."""
    if failed.nit == 0:
        return False
    return failed.status is Status.ITERATION_LIMIT or _needs_time(job, failed)


def _needs_time(job: Job, failed: Solution) -> bool:
    """Whether no motion was found among obstacles, or clear of links, within limits."""
    limited = bool(job.limits.bounded[1:].any())
    return failed.status in UNUSABLE and job.options.clearance.wanted and limited


def solve_by_continuation(
    job: Job,
    failed: Solution,
    deadline: Deadline | None = None,
    progress: Progress | None = None,
) -> Solution:
    """A minimum that the direct solve did not reach, or the best motion found on the way.

    failed: the direct solve. deadline: of all solves together; none if None. progress: called
    before each. The message says how it went; nit counts the steps of the last solve only.
    """
    deadline, best, last, steps = deadline or Deadline(), failed, failed, 0
    longer = _needs_time(job, failed)
    guess = job.options.guess if longer else failed.trajectory
    try:
        stages = [*(_lasting(job, each) for each in LONGER), job] if longer else [job] * MAX_SOLVES
        for i, stage in enumerate(stages):
            if progress is not None:
                text = f"a duration of {stage.grid.duration:.4g} s" if longer else MORE_STEPS
                progress(f"continuation: {text}", i / len(stages))
            last = solved_on_grid(
                stage.problem(),
                guess,
                max_iterations=job.options.max_iterations,
                time_limit=deadline.seconds_left,
                barrier=stage.barrier,
            )
            steps, guess = steps + last.nit, last.trajectory
            if stage is job and (last.success or _is_better(last, best)):
                best = last
            done = stage is job and last.status is not Status.ITERATION_LIMIT
            if done or last.status in (*STOPPED, *UNUSABLE):
                break
        if last.status in STOPPED:
            best = dataclasses.replace(best, status=last.status)
    except KeyboardInterrupt:
        record_interrupt()
        best = dataclasses.replace(best, status=Status.INTERRUPTED)
    except HoviError:  # effects or conditions that do not allow a longer duration
        pass
    return _with_sentence(best, failed, steps)


def _is_better(found: Solution, best: Solution) -> bool:
    """Whether a motion that is no minimum is the better one of two."""
    if found.status in UNUSABLE:
        return False
    return best.status in UNUSABLE or found.cost < best.cost


def _lasting(job: Job, factor: float) -> Job:
    """The job with its duration times `factor`, and velocities of its ends in proportion."""
    grid = Grid(factor * job.grid.steps, job.grid.schemes)
    via = tuple(
        dataclasses.replace(each, time=factor * each.time, goal=_slower(each.goal, factor))
        for each in job.via
    )
    if job.limits.parts:
        ends = [factor * end for end in job.limits.ends]
        job = job.with_options(limits=Limits.of_segments(job.limits.parts, ends))
    if during := job.options.clearance.during:
        later = [(name, factor * begin, factor * end) for name, begin, end in during]
        job = dataclasses.replace(job, options=job.options.carrying(later))
    start, goal = _slower(job.start, factor), _slower(job.goal, factor)
    return dataclasses.replace(job.with_options(via=via), grid=grid, start=start, goal=goal)


def _slower(goal: Goal, factor: float) -> Goal:
    """A state with its velocity divided by `factor`; goals of frames are unchanged."""
    if not isinstance(goal, State) or goal.v is None:
        return goal
    return dataclasses.replace(goal, v=np.asarray(goal.v) / factor)


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
