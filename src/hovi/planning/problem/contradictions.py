"""Limits that no motion can meet, seen without solving anything."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.planning.clearance.violation import in_words
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goal_clearance import goal_in_obstacle
from hovi.planning.problem.limits import KINDS, NAMES, Limits
from hovi.planning.problem.node_conditions import JointCondition
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

ROUNDING = 1e-9
"""By how much an end may be nearer than the margin, in [m]."""


def contradiction(problem: TrajectoryProblem, limits: Limits) -> str:
    """Why no motion between the problem's ends is within the limits; "" if nothing speaks against.

    The ends themselves, and the mean velocity that the distance needs.
    """
    q0, v0, q1, v1 = problem.boundary
    names, space = problem.robot.coordinate_names, problem.robot.space
    q0, q1 = space.coordinates(q0), space.coordinates(q1)
    if problem.unreachable:
        return problem.unreachable
    for i, (end, state) in enumerate((("start", (q0, v0)), ("goal", (q1, v1)))):
        for row in (0, 1):
            held = ~problem.free_ends[i, row]
            sentence = _outside(problem.robot, end, row, state[row], limits, held)
            if sentence:
                return sentence
    return _via_outside(problem, limits) or _too_near(problem) or _too_short(problem, limits, names)


def static_sentence(problem: TrajectoryProblem, limits: Limits) -> str:
    """Which end takes more than a torque limit at rest, as the end of a sentence, or ""."""
    q0, v0, q1, v1 = problem.boundary
    zero = np.zeros((1, problem.robot.nv))
    for i, (end, q, v) in enumerate((("start", q0, v0), ("goal", q1, v1))):
        if np.any(v != 0) or problem.free_ends[i].any():
            continue
        tau = problem.scene.inverse_dynamics(q[None], zero, zero)[0]
        over = np.maximum(limits.lower[3] - tau, tau - limits.upper[3])
        i = int(np.argmax(over))
        if over[i] > 0:
            bound = limits.upper[3, i] if tau[i] > 0 else limits.lower[3, i]
            return (
                f"; holding the {end} alone takes {tau[i]:.4g} "
                f"{problem.robot.coordinate_units[i].tau} at joint "
                f"{problem.robot.coordinate_names[i]!r}, whose limit is {bound:.4g}"
            )
    return ""


def _outside(robot: Robot, end: str, row: int, values: Array, limits: Limits, held: Mask) -> str:
    """Which held component of an end's q or v is outside its limits; "" where none is."""
    outside = np.maximum(limits.lower[row] - values, values - limits.upper[row])
    outside = np.where(held, outside / limits.ranges[row], -np.inf)
    i = int(np.argmax(outside))
    if outside[i] <= limits.tolerance:
        return ""
    name, unit = robot.coordinate_names[i], robot.coordinate_units[i][row]
    return (
        f"the {NAMES[KINDS[row]]} of joint {name!r} at the {end} is {values[i]:.6g} {unit}, "
        f"outside its limits [{limits.lower[row, i]:.6g}, {limits.upper[row, i]:.6g}]; move the "
        f"{end} or widen them"
    )


def _via_outside(problem: TrajectoryProblem, limits: Limits) -> str:
    """Which via point is outside the limits; "" where none is."""
    space, t = problem.robot.space, problem.grid.t
    for each in problem.conditions:
        passed = each.condition
        if not isinstance(passed, JointCondition):
            continue
        end = f"via point at {t[each.node]:g} s"
        for row, values in enumerate((space.coordinates(passed.target), passed.velocity)):
            sentence = _outside(problem.robot, end, row, values, limits, passed.held[row])
            if sentence:
                return sentence
    return ""


def _too_near(problem: TrajectoryProblem) -> str:
    """Which end is inside an obstacle, or nearer to one than the margin; "" where none is."""
    if problem.distances is None or problem.clearance is None:
        return ""
    margin, pairs = float(problem.clearance.margin), problem.distances.pairs
    for i, end in enumerate(("start", "goal")):
        if problem.free_ends[i, 0].any():
            continue
        d = problem.distances.values(problem.boundary[2 * i][None])[0]
        k = int(np.argmin(d))
        if d[k] < margin - ROUNDING:
            needed = "" if d[k] < 0 else f", less than the margin of {margin:g} m"
            return (
                f"at the {end} {pairs[k]} {in_words(float(d[k]))}{needed}; move the {end} or what "
                "is in its way"
            )
    goals = [(problem.goal, "goal"), *((via.goal, "via point") for via in problem.via)]
    for goal, name in goals:
        if isinstance(goal, FrameGoal):
            sentence = goal_in_obstacle(goal, name, problem.distances, margin - ROUNDING)
            if sentence:
                return sentence
    return ""


def _too_short(problem: TrajectoryProblem, limits: Limits, names: tuple[str, ...]) -> str:
    q0, _, q1, _ = problem.boundary
    distance = problem.robot.difference(q0, q1)
    T = problem.grid.duration
    fastest = np.where(distance >= 0, limits.upper[1], -limits.lower[1])
    needed = np.abs(distance) / np.maximum(fastest, 1e-300)
    needed[problem.free_ends[:, 0].any(axis=0)] = 0.0
    i = int(np.argmax(needed))
    if needed[i] <= T:
        return ""
    units = problem.robot.coordinate_units[i]
    return (
        f"joint {names[i]!r} has {abs(distance[i]):.4g} {units.q} to go, which takes "
        f"{needed[i]:.4g} s at its velocity limit of {fastest[i]:.4g} {units.v}, more than the "
        f"duration of {T:.4g} s; allow more time or a higher velocity"
    )
