"""Infeasibility checks without a solve: ends outside limits or in obstacles, too little time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.planning.clearance.clearance_violation import distance_in_words
from hovi.planning.problem.arms.limit_set import KIND_NAMES
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goal_clearance import goal_in_obstacle
from hovi.planning.problem.limits import KINDS, Limits
from hovi.planning.problem.node_conditions import JointCondition
from hovi.planning.problem.problem import TrajectoryProblem
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
    names, space = problem.coordinates.coordinate_names, problem.coordinates.space
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
        or _duration_too_short(problem, limits, names)
    )


def static_sentence(problem: TrajectoryProblem, limits: Limits) -> str:
    """Which end exceeds a torque limit at rest, as the end of a sentence; "" if none does."""
    if not problem.about_robot:
        return ""
    q0, v0, q1, v1 = problem.boundary
    zero = np.zeros((1, problem.coordinates.nv))
    for i, (end, q, v) in enumerate((("start", q0, v0), ("goal", q1, v1))):
        if np.any(v != 0) or problem.free_ends[i].any():
            continue
        here, scene = limits.at_ends[i], problem.scenes[-i]
        tau = scene.inverse_dynamics(q[None], zero, zero)[0]
        over = np.maximum(here.lower[3] - tau, tau - here.upper[3])
        i = int(np.argmax(over))
        if over[i] > 0:
            bound = here.upper[3, i] if tau[i] > 0 else here.lower[3, i]
            return (
                f"; holding the robot still at the {end} takes {tau[i]:.4g} "
                f"{problem.coordinates.coordinate_units[i].tau} at joint "
                f"{problem.coordinates.coordinate_names[i]!r}, whose limit is {bound:.4g}"
            )
    return ""


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
    return (
        f"the {KIND_NAMES[KINDS[row]]} of joint {name!r} at the {end} is {values[i]:.6g} {unit}, "
        f"outside its limits [{limits.lower[row, i]:.6g}, {limits.upper[row, i]:.6g}]; change the "
        f"{end} or widen the limits"
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
    """Which end overlaps an obstacle or violates the margin; "" if none does."""
    if problem.distances is None or problem.clearance is None:
        return ""
    margin, pairs = float(problem.clearance.margin), problem.distances.pairs
    for i, end in enumerate(("start", "goal")):
        if problem.free_ends[i, 0].any():
            continue
        d = problem.distances.values(problem.boundary[2 * i][None])[0]
        k = int(np.argmin(d))
        if d[k] < margin - MARGIN_TOLERANCE:
            needed = "" if d[k] < 0 else f", less than the margin of {margin:g} m"
            return (
                f"at the {end} {pairs[k]} {distance_in_words(float(d[k]))}{needed}; change the "
                f"{end} or move the obstacle"
            )
    goals = [(problem.goal, "goal"), *((via.goal, "via point") for via in problem.via)]
    for goal, name in goals:
        if isinstance(goal, FrameGoal):
            sentence = goal_in_obstacle(goal, name, problem.distances, margin - MARGIN_TOLERANCE)
            if sentence:
                return sentence
    return ""


def _duration_too_short(problem: TrajectoryProblem, limits: Limits, names: tuple[str, ...]) -> str:
    """Which joint cannot cover its distance at its velocity limit in time; "" if all can."""
    q0, _, q1, _ = problem.boundary
    if limits.parts:
        return ""
    distance = problem.coordinates.difference(q0, q1)
    T = problem.grid.duration
    fastest = np.where(distance >= 0, limits.upper[1], -limits.lower[1])
    needed = np.abs(distance) / np.maximum(fastest, 1e-300)
    needed[problem.free_ends[:, 0].any(axis=0)] = 0.0
    i = int(np.argmax(needed))
    if needed[i] <= T:
        return ""
    units = problem.coordinates.coordinate_units[i]
    return (
        f"joint {names[i]!r} has to move by {abs(distance[i]):.4g} {units.q}, which takes "
        f"{needed[i]:.4g} s at its velocity limit of {fastest[i]:.4g} {units.v}, longer than the "
        f"duration of {T:.4g} s; increase the duration or the velocity limit"
    )
