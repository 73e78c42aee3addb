"""Inactive limits: a motion far from its limits can be refined without them."""

from __future__ import annotations

import dataclasses

from hovi.planning.problem.limit_conditions import closeness
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.solver import Solution

MIN_DISTANCE = 0.01
"""Smallest distance of a motion that is far from its limits from every bound, as a fraction of the
range."""


def far_from_limits(solution: Solution) -> bool:
    """Whether a minimum has limits, no obstacles, and is far from every limit."""
    limits = _limits_alone(solution.problem)
    return (
        solution.success
        and limits is not None
        and float(closeness(solution.trajectory, limits).min()) > MIN_DISTANCE
    )


def without_limits(solution: Solution) -> Solution:
    """The same motion as a solution of its problem without limits."""
    assert solution.problem is not None
    return dataclasses.replace(solution, problem=dataclasses.replace(solution.problem, limits=None))


def with_limits_again(refined: Solution, limited: Solution) -> Solution | None:
    """A motion refined without limits as a solution with them; None if it is near a limit."""
    assert limited.problem is not None
    problem = limited.problem.on(refined.trajectory.grid)
    restored = dataclasses.replace(refined, problem=problem)
    return restored if far_from_limits(restored) else None


def _limits_alone(problem: TrajectoryProblem | None) -> Limits | None:
    """The limits of a problem without obstacles and conditions; None if there are none."""
    if problem is None or problem.distances is not None or problem.bounds or not problem.limited:
        return None
    return problem.limits
