"""A configuration that meets a frame goal: a damped Newton method from several seeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.planning.problem.frame_goal import FrameCondition, FrameGoal
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

SEEDS = 40
"""Random configurations that are tried after the first."""
ENOUGH = 4
"""Seeds that may meet the goal before the nearest is taken."""
ITERATIONS = 100
"""Steps from one seed."""
CONVERGED = 1e-13
"""Largest component of a condition at which the steps end, in [m] or [rad]."""
LONGEST = 0.5
"""Longest step of a joint, in [rad] or [m]."""
IDLE = 0.98
"""Share of the residual that a step may leave before it counts as idle."""
PATIENCE = 8
"""Idle steps in a row that end a seed."""
MET = 1e-6
"""Largest distance and angle, together, of a configuration that meets the goal."""


@dataclass(frozen=True, eq=False)
class Reached:
    """A configuration, and by how much it does not meet the goal, in words.

    q: shape (nq,). reason: "" where it meets the goal.
    """

    q: Array
    reason: str = ""


def inverse_kinematics(
    robot: Robot,
    goal: FrameGoal,
    near: Array,
    lower: Array | None = None,
    upper: Array | None = None,
) -> Reached:
    """The configuration that meets a goal, of those found the nearest to another.

    near: where the search starts, and what is near. lower, upper: of ordinary joints, shape (nv,).
    """
    condition = goal.condition(robot)
    n = robot.nv
    lower = np.full(n, -np.inf) if lower is None else lower
    upper = np.full(n, np.inf) if upper is None else upper
    found: list[Array] = []
    best, least = near, np.inf
    for seed in _seeds(robot, near, lower, upper):
        q = _newton(robot, condition, _inside(robot, seed, lower, upper), near, lower, upper)
        missed = sum(condition.missed(q))
        if missed < least:
            best, least = q, missed
        if missed <= MET:
            found.append(q)
        if len(found) == ENOUGH:
            break
    if not found:
        return Reached(best, condition.describe(best, np.zeros(n)))
    return Reached(min(found, key=lambda q: float(np.linalg.norm(robot.difference(near, q)))))


def _seeds(robot: Robot, near: Array, lower: Array, upper: Array) -> Iterator[Array]:
    """The configuration nearby, then reproducible random ones."""
    yield near
    random = np.random.default_rng(0)
    low, high = np.maximum(lower, -np.pi), np.minimum(upper, np.pi)
    middle, half = (low + high) / 2, (high - low) / 2
    for i in range(SEEDS):
        if i % 2 == 0 or not robot.vector_joints:
            yield robot.integrate(near, random.uniform(-1, 1, robot.nv) * min(1.0, 0.2 * (i + 1)))
        else:
            yield middle + half * random.uniform(-1, 1, robot.nv)


def _newton(
    robot: Robot, condition: FrameCondition, q: Array, near: Array, lower: Array, upper: Array
) -> Array:
    """Levenberg-Marquardt steps, cut at the limits."""
    v = np.zeros(robot.nv)
    c, J = condition.evaluate(q, v)
    damping, idle = 1e-2, 0
    for _ in range(ITERATIONS):
        if np.max(np.abs(c)) <= CONVERGED:
            break
        A = J[:, 0]
        step = -A.T @ np.linalg.solve(A @ A.T + damping * np.eye(len(c)), c)
        step *= min(1.0, LONGEST / max(float(np.max(np.abs(step))), 1e-300))
        candidate = _inside(robot, robot.integrate(q, step), lower, upper)
        new, slope = condition.evaluate(candidate, v)
        share = np.linalg.norm(new) / np.linalg.norm(c)
        if share < 1.0:
            q, c, J = candidate, new, slope
        damping = max(0.2 * damping, 1e-14) if share < 1.0 else 8.0 * damping
        idle = idle + 1 if share > IDLE else 0
        if idle >= PATIENCE:
            break
    return q


def _inside(robot: Robot, q: Array, lower: Array, upper: Array) -> Array:
    places, rates = robot.space.plain
    inside = q.copy()
    inside[places] = np.clip(q[places], lower[rates], upper[rates])
    return inside
