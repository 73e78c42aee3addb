"""Inverse kinematics of any robot: Levenberg-Marquardt from several seeds, in Python.

For frames whose joints the compiled search does not know: those on a floating base, or that mimic
other joints.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from hovi.conditions.function import linear
from hovi.planning.problem.frame_goal import FrameGoal, PoseDifference
from hovi.robot.robot import Robot
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]

MAX_SEEDS = 160
"""Maximum number of random seeds after the first."""
SPREAD = 0.2
"""Increase of the spread of random seeds about the first from one to the next, up to 1 rad or m."""
MAX_ITERATIONS = 100
"""Maximum number of steps per seed."""
RESIDUAL_TOLERANCE = 1e-13
"""Largest component of the residual at convergence, in [m] or [rad]."""
FIRST_DAMPING, LEAST_DAMPING = 1e-2, 1e-14
"""Damping that is added to the diagonal of J J^T, at first and at least."""
DAMPING_DECREASE, DAMPING_GROWTH = 0.2, 8.0
"""Factors on the damping after a step that decreases the residual and after another one."""
MAX_STEP = 0.5
"""Maximum step of a joint, in [rad] or [m]."""
STALL_RATIO = 0.98
"""Ratio of successive residuals above which a step counts as stalled."""
MAX_STALLED_STEPS = 8
"""Consecutive stalled steps after which a seed is given up."""


def candidates(
    robot: Robot,
    goal: FrameGoal,
    near: Array,
    lower: Array,
    upper: Array,
    known: Sequence[Array] = (),
) -> Iterator[Array]:
    """Where the search from each seed ends: configurations (nq,), whether or not they reach a goal.

    near: the first seed, shape (nq,).
    lower, upper: position limits, shape (nv,), applied to joints whose q is a plain number.
    known: further seeds, which come after the first.
    """
    difference = goal.difference(robot)
    others = itertools.islice(seeds(robot, near, lower, upper), 1, None)
    for seed in itertools.chain([near], known, others):
        raise_if_late()
        yield _newton(robot, difference, inside(robot, seed, lower, upper), lower, upper)


def seeds(robot: Robot, near: Array, lower: Array, upper: Array) -> Iterator[Array]:
    """The configuration `near`, then reproducible random ones."""
    yield near
    random = np.random.default_rng(0)
    low, high = np.maximum(lower, -np.pi), np.minimum(upper, np.pi)
    middle, half = (low + high) / 2, (high - low) / 2
    for i in range(MAX_SEEDS):
        if i % 2 == 0 or not robot.vector_joints:
            spread = min(1.0, SPREAD * (i + 1))
            yield robot.integrate(near, random.uniform(-1, 1, robot.nv) * spread)
        else:
            yield middle + half * random.uniform(-1, 1, robot.nv)


def inside(robot: Robot, q: Array, lower: Array, upper: Array) -> Array:
    """A configuration (nq,) with the joints whose q is a plain number within their limits."""
    indices, velocities = robot.space.plain
    clipped = q.copy()
    clipped[indices] = np.clip(q[indices], lower[velocities], upper[velocities])
    return clipped


def _newton(robot: Robot, off: PoseDifference, q: Array, lower: Array, upper: Array) -> Array:
    """Levenberg-Marquardt steps, clipped to the limits."""
    v = np.zeros(robot.nv)
    c, J = linear(off, q, v)
    damping, stalled = FIRST_DAMPING, 0
    for _ in range(MAX_ITERATIONS):
        if np.max(np.abs(c)) <= RESIDUAL_TOLERANCE:
            break
        A = J[:, 0]
        step = -A.T @ np.linalg.solve(A @ A.T + damping * np.eye(len(c)), c)
        step *= min(1.0, MAX_STEP / max(float(np.max(np.abs(step))), 1e-300))
        candidate = inside(robot, robot.integrate(q, step), lower, upper)
        new, slope = linear(off, candidate, v)
        ratio = np.linalg.norm(new) / np.linalg.norm(c)
        if ratio < 1.0:
            q, c, J = candidate, new, slope
        if ratio < 1.0:
            damping = max(DAMPING_DECREASE * damping, LEAST_DAMPING)
        else:
            damping *= DAMPING_GROWTH
        stalled = stalled + 1 if ratio > STALL_RATIO else 0
        if stalled >= MAX_STALLED_STEPS:
            break
    return q
