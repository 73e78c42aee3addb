"""Limits that a motion stays far from: it is the motion without them, and as accurate as that."""

from __future__ import annotations

import dataclasses

from hovi.planning.problem.limit_violation import closeness
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.solver import Solution

FAR = 0.01
"""Share of every range that such a motion leaves to the nearest bound."""


def far_from_limits(solution: Solution) -> bool:
    """Whether a minimum is limited by nothing that it comes near to."""
    limits = _limits_alone(solution.problem)
    return (
        solution.success
        and limits is not None
        and float(closeness(solution.trajectory, limits).min()) > FAR
    )


def without_limits(solution: Solution) -> Solution:
    """The same motion as a solution of its problem without limits."""
    assert solution.problem is not None
    return dataclasses.replace(solution, problem=dataclasses.replace(solution.problem, limits=None))


def with_limits_again(refined: Solution, limited: Solution) -> Solution | None:
    """A motion refined without limits as a solution within them; None where it comes near."""
    assert limited.problem is not None
    problem = limited.problem.on(refined.trajectory.grid)
    back = dataclasses.replace(refined, problem=problem)
    return back if far_from_limits(back) else None


def _limits_alone(problem: TrajectoryProblem | None) -> Limits | None:
    """The limits of a problem that has nothing to keep away from; None where there are none."""
    if problem is None or problem.distances is not None or not problem.limited:
        return None
    return problem.limits
