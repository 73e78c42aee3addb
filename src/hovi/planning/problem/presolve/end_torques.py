"""Torques at the ends of a motion: what holding still takes, and what no acceleration avoids."""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.kinematics.branches import find_branches
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.mass_matrix import MassMatrix
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]

BRANCHES, SEEDS = 16, 200
"""Numbers of configurations of a frame goal that are looked at, and of seeds for them."""


def held_still(problem: TrajectoryProblem, limits: Limits) -> Iterator[str]:
    """The ends at rest at which holding the robot still exceeds a torque limit, as clauses.

    That is no contradiction where the robot may begin to fall, or come to rest from below.
    """
    for end in (0, 1):
        yield from held_still_at(problem, limits, end)


def held_still_at(problem: TrajectoryProblem, limits: Limits, end: int) -> Iterator[str]:
    """As `held_still`, at one end: 0 for the start, 1 for the goal."""
    here = limits.at_ends[end]
    if not problem.about_robot or not any(each.bounded[3].any() for each in limits.at_ends):
        return
    if not problem.free_ends[end].any() and not problem.end_velocities[end].any():
        scene, q = problem.scenes[-end], problem.ends[0][end]
        tau = _static(scene, q[None], end * problem.grid.duration)
        yield from _excess(problem, scene, tau, here, f"at the {('start', 'goal')[end]}")
    goal = problem.goal
    if end == 1 and isinstance(goal, FrameGoal) and goal.exact and not goal.free_velocity:
        yield from _at_frame_goal(problem, goal, here)


def static_sentence(problem: TrajectoryProblem, limits: Limits) -> str:
    """The first of `held_still` as the end of a sentence; "" if there is none."""
    clause = next(held_still(problem, limits), "")
    return f"; {clause}" if clause else ""


def unavoidable_torque(problem: TrajectoryProblem, limits: Limits) -> str:
    """Which torque at an end exceeds its limit at every acceleration there; "" if none does.

    The accelerations are what the ends prescribe or, where they are free, what limits allow:
    tau = tau_0 + M a is in tau_0 + [min, max] of M a over them.
    """
    if not problem.about_robot or problem.ld.segments is not None:
        return ""
    for i, end in enumerate(("start", "goal")):
        here, scene = limits.at_ends[i], problem.scenes[-i]
        if not here.bounded[3].any() or problem.free_ends[i, :2].any():
            continue
        bounds = _accelerations(problem, here, i)
        given = bool((bounds[0] == bounds[1]).all())
        if np.isinf(bounds).all():
            continue
        low, high = _torques(problem, scene, i, *bounds)
        over = np.maximum(here.lower[3] - high, low - here.upper[3]) / here.ranges[3]
        over[scene.passive_coordinates] = -np.inf
        over[[x.coordinate for x in limits.excused if x.limit == "tau" and i == 0]] = -np.inf
        k = int(np.argmax(over))
        if over[k] > here.tolerance:
            nearest = low[k] if low[k] > here.upper[3, k] else high[k]
            return (
                f"the torque of joint {_name(problem, k)!r} at the {end} is "
                f"{'' if given else 'at best '}{nearest:.4g} {_unit(problem, k)}"
                f"{'' if given else ' at any acceleration within the limits'}, outside its limits "
                f"[{here.lower[3, k]:.6g}, {here.upper[3, k]:.6g}]; change the {end} or the load, "
                "or widen the limits"
            )
    return ""


def _accelerations(problem: TrajectoryProblem, limits: Limits, end: int) -> tuple[Array, Array]:
    """The smallest and largest accelerations at an end, (nv,)."""
    low, high = limits.lower[2].copy(), limits.upper[2].copy()
    if problem.ld.k > 2:
        held, given = ~problem.free_ends[end, 2], problem.ends[2][end]
        low[held], high[held] = given[held], given[held]
    return low, high


def _torques(
    problem: TrajectoryProblem, scene: Scene, end: int, low: Array, high: Array
) -> tuple[Array, Array]:
    """Bounds of the torques at an end, shape (nv,), for accelerations between two."""
    q, v = problem.ends[0][end][None], problem.end_velocities[end][None]
    t = np.array([end * problem.grid.duration])
    if (low == high).all():
        tau = scene.inverse_dynamics(q, v, low[None], t)[0]
        return tau, tau
    if _depends_on_acceleration(scene):
        return np.full_like(low, -np.inf), np.full_like(low, np.inf)
    tau = scene.inverse_dynamics(q, v, np.zeros_like(v), t)[0]
    M = MassMatrix(scene.model)(q)[0]
    with np.errstate(invalid="ignore"):
        ends = np.stack([M * low, M * high])
    ends[:, M == 0.0] = 0.0
    return tau + ends.min(axis=0).sum(axis=1), tau + ends.max(axis=0).sum(axis=1)


def _depends_on_acceleration(scene: Scene) -> bool:
    """Whether effects add torques that depend on the acceleration."""
    added, a = scene.terms.torque, scene.terms.symbols.columns()[2]
    moving = scene.terms.base is not None
    return moving or (added is not None and bool(ca.depends_on(ca.SX(added), a)))


def _static(scene: Scene, q: Array, time: float) -> Array:
    """Torques at rest in configurations (M, nq) at a time in [s], shape (M, nv)."""
    zero = np.zeros((len(q), scene.robot.nv))
    return scene.inverse_dynamics(q, zero, zero, np.full(len(q), time))


def _at_frame_goal(problem: TrajectoryProblem, goal: FrameGoal, limits: Limits) -> Iterator[str]:
    """The goal, if no configuration found for it can be held still."""
    scene, near = problem.scenes[-1], problem.ends[0][1]
    bounds = limits.lower[0], limits.upper[0]
    found = find_branches(scene.robot, goal, near, bounds, BRANCHES, SEEDS).q
    if len(found) == 0:
        return
    tau = _static(scene, found, problem.grid.duration)
    where = f"at the goal, in the best of {len(found)} configurations," if len(found) > 1 else ""
    yield from _excess(problem, scene, tau, limits, where or "at the goal")


def _excess(
    problem: TrajectoryProblem, scene: Scene, tau: Array, limits: Limits, where: str
) -> Iterator[str]:
    """The clause about the best of some torques (M, nv), unless it is within the limits."""
    over = np.maximum(limits.lower[3] - tau, tau - limits.upper[3])
    over[:, scene.passive_coordinates] = -np.inf
    best = int(np.argmin((over / limits.ranges[3]).max(axis=1)))
    i = int(np.argmax(over[best]))
    if over[best, i] > 0:
        bound = limits.upper[3, i] if tau[best, i] > 0 else limits.lower[3, i]
        yield (
            f"holding the robot still {where} takes {tau[best, i]:.4g} {_unit(problem, i)} at "
            f"joint {_name(problem, i)!r}, whose limit is {bound:.4g}"
        )


def _name(problem: TrajectoryProblem, i: int) -> str:
    return problem.coordinates.coordinate_names[i]


def _unit(problem: TrajectoryProblem, i: int) -> str:
    return problem.coordinates.coordinate_units[i].tau
