"""Infeasibility checks without a solve: ends outside limits or in obstacles, too little time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.state import Periodic
from hovi.planning.clearance.clearance_violation import less_than_margin
from hovi.planning.problem.arms.limit_set import KIND_NAMES
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goal_clearance import goal_in_obstacle
from hovi.planning.problem.limits import KINDS, Limits
from hovi.planning.problem.node_conditions import JointCondition
from hovi.planning.problem.presolve.end_torques import unavoidable_torque
from hovi.planning.problem.presolve.legs import Stop, states_too_far_apart
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.space.angle_ranges import beyond_in_degrees
from hovi.robot.space.coordinates import Coordinates

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

MARGIN_TOLERANCE = 1e-9
"""Distance by which an end may violate the margin, in [m]."""


def contradiction(problem: TrajectoryProblem, limits: Limits) -> str:
    """Why no motion between the problem's ends satisfies the limits; "" if none is found.

    Checks the ends, the via points, and the mean velocities that the duration requires.
    """
    q0, v0, q1, v1 = problem.boundary
    space = problem.coordinates.space
    q0, q1 = space.coordinates(q0), space.coordinates(q1)
    if problem.unreachable:
        return problem.unreachable
    accelerations = problem.end_jets[2:3] if problem.ld.k > 2 else ()
    for i, (end, state) in enumerate((("start", (q0, v0)), ("goal", (q1, v1)))):
        for row, values in enumerate((*state, *(a[i] for a in accelerations))):
            held = ~problem.free_ends[i, row]
            here = limits.at_ends[i]
            sentence = _outside(problem.coordinates, end, row, values, here, held)
            if sentence:
                return sentence
    return (
        _via_outside(problem, limits)
        or _end_in_obstacle(problem)
        or _duration_too_short(problem, limits)
        or unavoidable_torque(problem, limits)
    )


def _outside(
    coordinates: Coordinates, end: str, row: int, values: Array, limits: Limits, held: Mask
) -> str:
    """Which prescribed component of an end's q or v is outside its limits; "" if none is."""
    outside = np.maximum(limits.lower[row] - values, values - limits.upper[row])
    outside = np.where(held, outside / limits.ranges[row], -np.inf)
    i = int(np.argmax(outside))
    if outside[i] <= limits.tolerance:
        return ""
    name, unit = coordinates.coordinate_names[i], coordinates.coordinate_units[i][row]
    lower, upper = limits.lower[row, i], limits.upper[row, i]
    slip = beyond_in_degrees(values[i], lower, upper) if row == 0 and unit == "rad" else ""
    return (
        f"the {KIND_NAMES[KINDS[row]]} of joint {name!r} at the {end} is {values[i]:.6g} {unit}, "
        f"outside its limits [{lower:.6g}, {upper:.6g}]"
        + (f", {slip}" if slip else f"; change the {end} or widen the limits")
    )


def _via_outside(problem: TrajectoryProblem, limits: Limits) -> str:
    """Which via point is outside the limits; "" if none is."""
    space, t = problem.coordinates.space, problem.grid.t
    for each in problem.conditions:
        via = each.condition
        if not isinstance(via, JointCondition):
            continue
        end = f"via point at {t[each.node]:g} s"
        if limits.parts:  # of both segments where it is at their shared node
            continue
        for row, values in enumerate((space.coordinates(via.target), via.velocity)):
            sentence = _outside(problem.coordinates, end, row, values, limits, via.held[row])
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
        d = problem.distances.values(problem.distances.at(problem.boundary[2 * i][None], t))[0]
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
    stops = [Stop(f"via point at {via.time:g} s", via.time, via.goal) for via in problem.via]
    stops = sorted(stops, key=lambda stop: stop.time)
    ends = Stop("start", 0.0, first), Stop("goal", problem.grid.duration, last)
    return states_too_far_apart(problem.coordinates, [ends[0], *stops, ends[1]], limits)
