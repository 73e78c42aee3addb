"""A start outside its limits gets more time for its way back where no motion takes it in less."""

from __future__ import annotations

import dataclasses

from hovi.optimize.criteria import Criteria
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.methods.method import Guess, Method, Report
from hovi.planning.solver.status import Status
from hovi.system.deadline import Deadline

DOUBLINGS = 2
"""Number of times that the window of the way back is doubled."""


def minimized(
    method: Method,
    problem: TrajectoryProblem,
    start: Guess,
    criteria: Criteria,
    report: Report | None,
) -> Answer:
    """The result of a method, with a longer way back of the start if it finds no motion."""
    deadline = Deadline(criteria.time_limit)
    found = method.minimize(problem, start, criteria, report)
    for _ in range(DOUBLINGS):
        limits = problem.limits
        if found.status is not Status.INFEASIBLE or limits is None or not limits.excused:
            break
        longer = dataclasses.replace(limits, window=2.0 * limits.window)
        problem = dataclasses.replace(problem, limits=longer)
        left = dataclasses.replace(criteria, time_limit=deadline.seconds_left)
        found = method.minimize(problem, start, left, report).after(found)
    return found
