"""Plans to goals with regions: several, until the bounds at which motions end are settled."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.solver.regions import (
    ends_inside,
    inside_all,
    region_goals,
    region_prices,
    with_next_sides,
)
from hovi.planning.solver.solver import Solution

MOST_PLANS = 12
"""Largest number of plans for one set of regions."""
Again = Callable[[Sequence[FrameGoal], Solution], Solution]
"""A plan to other goals with regions, from the last one."""


def settled(found: Solution, again: Again) -> Solution:
    """The solution with the bounds of all regions held where the motion costs least.

    found: with the bounds as they are given. again: plans with them elsewhere.
    """
    if found.problem is None or not region_goals(found.problem):
        return found
    if not found.success:
        other = again(inside_all(found), found)
        found = other if other.success else found
    best, steps = found, found.nit
    for _ in range(MOST_PLANS):
        if not found.success:
            return _unsettled(best, steps)
        if found.cost <= best.cost and ends_inside(found):
            best = found
        goals, problem = with_next_sides(found), found.problem
        assert problem is not None
        if all(a is b for a, b in zip(goals, region_goals(problem), strict=True)):
            return _saying(dataclasses.replace(found, nit=steps))
        found = again(goals, found)
        steps += found.nit
    return _unsettled(best, steps)


def moved_to(goals: Sequence[FrameGoal], last: Solution) -> Trajectory:
    """The motion of a plan with its end moved to the guess of another goal."""
    assert last.problem is not None
    problem = dataclasses.replace(last.problem, goal=goals[-1])
    return problem.trajectory(problem.moved_to_guesses(last.trajectory.path))


def _saying(found: Solution) -> Solution:
    """The solution, which says at which bounds the motion ends."""
    held = {name: price for name, price in region_prices(found).items() if price != 0.0}
    if not held:
        return found
    said = ", ".join(f"{name!r} ({price:.4g} per unit of its room)" for name, price in held.items())
    return dataclasses.replace(found, message=f"{found.message} It ends at the bounds {said}.")


def _unsettled(best: Solution, steps: int) -> Solution:
    said = "The bounds of its region were not settled: a motion inside may cost less."
    return dataclasses.replace(best, nit=steps, message=f"{best.message} {said}")
