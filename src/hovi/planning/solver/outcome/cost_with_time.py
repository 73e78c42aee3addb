"""The cost J + w T of a motion: its discrete action, and what its duration costs."""

from __future__ import annotations

from hovi.discrete.grid import DiscretePath
from hovi.planning.problem.problem import TrajectoryProblem


def price_of_time(problem: TrajectoryProblem) -> float:
    """w T, in units of the cost: 0 for a duration that is given."""
    return problem.time_weight * problem.grid.duration


def cost_of(problem: TrajectoryProblem, path: DiscretePath) -> float:
    """J + w T."""
    return problem.ld.action(path) + price_of_time(problem)
