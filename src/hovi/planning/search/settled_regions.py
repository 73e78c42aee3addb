"""Plans to goals with regions: several, until the bounds at which motions end are settled."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import SATISFIED
from hovi.planning.problem.inverse_kinematics import (
    SEEDS,
    first_configuration,
    position_bounds,
)
from hovi.planning.problem.kinematics.branches import find_branches
from hovi.planning.search.options import PlanOptions
from hovi.planning.solver.regions import (
    ends_inside,
    freed,
    inside,
    region_goals,
    region_prices,
    with_next_sides,
)
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import STOPPED
from hovi.scene.scene import Scene
from hovi.system.deadline import Deadline

MOST_PLANS = 12
"""Largest number of plans for one set of regions."""
Again = Callable[[Sequence[FrameGoal], Solution], Solution]
"""A plan to other goals with regions, from the last one."""


def settled(found: Solution, again: Again, deadline: Deadline) -> Solution:
    """The solution with the bounds of all regions held where the motion costs least.

    found: with the bounds as they are given. again: plans with them elsewhere.
    deadline: of all plans.
    """
    if found.problem is None or not region_goals(found.problem):
        return found
    if not found.success and found.status not in STOPPED:
        other = again(inside(found), found)
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
        if deadline.passed:
            break
        last, found = found, again(goals, found)
        steps += found.nit
        if not found.success and found.status not in STOPPED:  # an edge may be out of reach
            found = again(inside(last, goals), last)
            steps += found.nit
    return _unsettled(best, steps)


def begun(
    goal: FrameGoal, start: State | FrameGoal, scene: Scene, options: PlanOptions
) -> FrameGoal:
    """The goal, with no bounds held where its middle is out of reach."""
    robot, bounds = scene.robot, position_bounds(scene.robot, options.limits)
    first = goal.guess if goal.guess is not None else None
    if first is None and isinstance(start, State):
        first = start.on(robot, "start")[0]
    near = first_configuration(robot, goal, first, bounds)
    found = find_branches(robot, goal, near, bounds, 1, SEEDS).q
    if len(found) == 0:
        return goal
    off = [part.off(robot, found[0]) for part in goal.parts]
    at_middle = max(max(float(np.linalg.norm(d)), angle) for d, angle in off) <= SATISFIED
    return goal if at_middle else freed(goal, found[0])


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
    if not best.success:
        return dataclasses.replace(best, nit=steps)
    said = "The bounds of its region were not settled: a motion inside may cost less."
    return dataclasses.replace(best, nit=steps, message=f"{best.message} {said}")
