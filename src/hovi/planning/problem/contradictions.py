"""Infeasibility checks without a solve: ends outside limits or in obstacles, too little time."""

from __future__ import annotations

import numpy as np

from hovi.conditions.state_difference import StateDifference
from hovi.discrete.state import Periodic
from hovi.planning.clearance.clearance_violation import less_than_margin
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goal_clearance import goal_in_obstacle
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.presolve.end_conditions import violated_at_end
from hovi.planning.problem.presolve.end_torques import unavoidable_torque
from hovi.planning.problem.presolve.moves import Waypoint, states_too_far_apart
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.way_back.end_state import EndState
from hovi.planning.problem.way_back.led_back import refused

MARGIN_TOLERANCE = 1e-9
"""Distance by which an end may violate the margin, in [m]."""


def contradiction(problem: TrajectoryProblem, limits: Limits) -> str:
    """Why no motion between the problem's ends satisfies the limits; "" if none is found.

    Checks the ends, the via points, the mean velocities that the duration requires, and conditions
    at the ends.
    """
    if problem.unreachable:
        return problem.unreachable
    return (
        _goal_leaves(problem)
        or _via_leaves(problem, limits)
        or _end_in_obstacle(problem)
        or _duration_too_short(problem, limits)
        or unavoidable_torque(problem, limits)
        or violated_at_end(problem)
    )


def _goal_leaves(problem: TrajectoryProblem) -> str:
    """What of the goal is outside its limits, or leads or came from outside; "" if nothing."""
    if not problem.has_limits or problem.periodic:
        return ""
    return refused(problem.end_state(1), "goal")


def _via_leaves(problem: TrajectoryProblem, limits: Limits) -> str:
    """Which via point is outside the limits, or leads or came from outside; "" if none does."""
    on, T = problem.coordinates, problem.grid.duration
    scene = problem.scene if problem.about_robot else None
    for each in problem.equations:
        via, t = each.y, each.where.time
        if not isinstance(via, StateDifference) or limits.parts:  # of both where segments meet
            continue
        state = EndState.of(on, limits, via.jet, via.held, T, limits.window * T, scene, t)
        sentence = refused(state, f"via point at {t:g} s", passed=True)
        if sentence:
            return sentence
    return ""


def _end_in_obstacle(problem: TrajectoryProblem) -> str:
    """At which end a pair of shapes overlaps or violates the margin; "" if at none."""
    if problem.distances is None or problem.clearance is None:
        return ""
    margin, pairs = float(problem.clearance.margin), problem.distances.pairs
    for i, end in enumerate(("start", "goal")):
        if problem.free_ends[i, 0].any():
            continue
        t = i * problem.grid.duration
        d = problem.distances.values(problem.distances.at(problem.ends[0][i][None], t))[0]
        k = int(np.argmin(d))
        if d[k] < margin - MARGIN_TOLERANCE:
            distance = float(d[k] - problem.distances.allowance[k])
            advice = f"change the {end}" + (" or move the obstacle" if pairs[k].obstacle else "")
            return f"at the {end} {pairs[k]} {less_than_margin(distance, margin)}; {advice}"
    goals = [(problem.goal, "goal"), *((via.goal, "via point") for via in problem.via)]
    for goal, name in goals:
        if isinstance(goal, FrameGoal):
            sentence = goal_in_obstacle(goal, name, problem.distances, margin - MARGIN_TOLERANCE)
            if sentence:
                return sentence
    return ""


def _duration_too_short(problem: TrajectoryProblem, limits: Limits) -> str:
    """Which joint cannot cover its distance within the limits in time; "" if all can."""
    first, last = problem.start, problem.goal
    if isinstance(last, Periodic):
        timed = problem.ld.lagrangian.timed
        first, last = last.ends(first, problem.coordinates, problem.ld.k, timed)
    waypoints = [
        Waypoint(f"via point at {via.time:g} s", via.time, via.goal) for via in problem.via
    ]
    waypoints = sorted(waypoints, key=lambda waypoint: waypoint.time)
    ends = Waypoint("start", 0.0, first), Waypoint("goal", problem.grid.duration, last)
    return states_too_far_apart(problem.coordinates, [ends[0], *waypoints, ends[1]], limits)
