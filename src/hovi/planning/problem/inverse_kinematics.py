"""Inverse kinematics of a frame goal: Levenberg-Marquardt from several seeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.planning.problem.frame_goal import FrameCondition, FrameGoal
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

MAX_SEEDS = 160
"""Maximum number of random seeds after the first."""
SOLUTIONS_WANTED = 4
"""Number of solutions among which the nearest is returned."""
MAX_ITERATIONS = 100
"""Maximum number of steps per seed."""
RESIDUAL_TOLERANCE = 1e-13
"""Largest component of the residual at convergence, in [m] or [rad]."""
MAX_STEP = 0.5
"""Maximum step of a joint, in [rad] or [m]."""
STALL_RATIO = 0.98
"""Ratio of successive residuals above which a step counts as stalled."""
MAX_STALLED_STEPS = 8
"""Consecutive stalled steps after which a seed is given up."""
GOAL_TOLERANCE = 1e-6
"""Largest sum of distance [m] and angle [rad] of a configuration that meets the goal."""


@dataclass(frozen=True, eq=False)
class InverseKinematicsResult:
    """A configuration, and its error in words.

    q: shape (nq,). reason: by how much q misses the goal; "" if it meets it.
    """

    q: Array
    reason: str = ""


def inverse_kinematics(
    robot: Robot,
    goal: FrameGoal,
    near: Array,
    lower: Array | None = None,
    upper: Array | None = None,
) -> InverseKinematicsResult:
    """The nearest of the configurations found that meet a goal, or the best one if none does.

    near: the first seed, to which distances are measured, shape (nq,).
    lower, upper: position limits, shape (nv,), applied to joints whose q is a plain number.
    """
    condition = goal.condition(robot)
    n = robot.nv
    lower = np.full(n, -np.inf) if lower is None else lower
    upper = np.full(n, np.inf) if upper is None else upper
    found: list[Array] = []
    best, least = near, np.inf
    for seed in _seeds(robot, near, lower, upper):
        q = _newton(robot, condition, _inside(robot, seed, lower, upper), near, lower, upper)
        pose_error = sum(condition.pose_error(q))
        if pose_error < least:
            best, least = q, pose_error
        if pose_error <= GOAL_TOLERANCE:
            found.append(q)
        if len(found) == SOLUTIONS_WANTED:
            break
    if not found:
        return InverseKinematicsResult(best, condition.describe(best, np.zeros(n)))
    return InverseKinematicsResult(
        min(found, key=lambda q: float(np.linalg.norm(robot.difference(near, q))))
    )


def _seeds(robot: Robot, near: Array, lower: Array, upper: Array) -> Iterator[Array]:
    """The configuration `near`, then reproducible random ones."""
    yield near
    random = np.random.default_rng(0)
    low, high = np.maximum(lower, -np.pi), np.minimum(upper, np.pi)
    middle, half = (low + high) / 2, (high - low) / 2
    for i in range(MAX_SEEDS):
        if i % 2 == 0 or not robot.vector_joints:
            yield robot.integrate(near, random.uniform(-1, 1, robot.nv) * min(1.0, 0.2 * (i + 1)))
        else:
            yield middle + half * random.uniform(-1, 1, robot.nv)


def _newton(
    robot: Robot, condition: FrameCondition, q: Array, near: Array, lower: Array, upper: Array
) -> Array:
    """Levenberg-Marquardt steps, clipped to the limits."""
    v = np.zeros(robot.nv)
    c, J = condition.evaluate(q, v)
    damping, stalled = 1e-2, 0
    for _ in range(MAX_ITERATIONS):
        if np.max(np.abs(c)) <= RESIDUAL_TOLERANCE:
            break
        A = J[:, 0]
        step = -A.T @ np.linalg.solve(A @ A.T + damping * np.eye(len(c)), c)
        step *= min(1.0, MAX_STEP / max(float(np.max(np.abs(step))), 1e-300))
        candidate = _inside(robot, robot.integrate(q, step), lower, upper)
        new, slope = condition.evaluate(candidate, v)
        share = np.linalg.norm(new) / np.linalg.norm(c)
        if share < 1.0:
            q, c, J = candidate, new, slope
        damping = max(0.2 * damping, 1e-14) if share < 1.0 else 8.0 * damping
        stalled = stalled + 1 if share > STALL_RATIO else 0
        if stalled >= MAX_STALLED_STEPS:
            break
    return q


def _inside(robot: Robot, q: Array, lower: Array, upper: Array) -> Array:
    indices, velocities = robot.space.plain
    inside = q.copy()
    inside[indices] = np.clip(q[indices], lower[velocities], upper[velocities])
    return inside
