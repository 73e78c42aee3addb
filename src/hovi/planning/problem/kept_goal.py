"""Where a frame reaches its goal on a way along which a motion keeps what it is to keep.

Inverse kinematics in steps from the start: of min |dq| at each of them with

    y(q) - y* = (1 - s) (y(q0) - y*) for what is kept, and d(q) = (1 - s) d(q0) for the difference d
    from the goal,

s from 0 to 1. Configurations that reach the goal elsewhere are no ends of such a way.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import Condition
from hovi.conditions.function import Function, linear
from hovi.conditions.places import Along
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

STEPS, NEWTON_STEPS = 40, 12
"""Steps of the way, and largest number of Newton steps for each."""
LARGEST_STEP = 0.3
"""Largest change of a joint in one Newton step, in [rad] or [m]."""
REACHED, NEARBY = 1e-8, 1e-3
"""Largest residuals at which the last step of the way is made, and the others, in [m] or [rad]."""
RANK = 1e-6
"""Singular values that count as zero, relative to the largest."""


def goal_along(
    kept: Sequence[Condition[Any, Any]],
    robot: Robot,
    q: Array,
    goal: FrameGoal,
    bounds: tuple[Array, Array],
    duration: float,
) -> Array | None:
    """The configuration (nq,) at the goal, or None where the way ends before it.

    kept: conditions of which those of positions with a value are kept. q: at the start, (nq,).
    bounds: limits on positions, (nv,) each, within which the configuration has to be. duration: of
        the way, in [s], for what is kept at times.
    """
    wanted = [each for each in kept if each.where == Along(0)]
    rows = [(each.y, np.asarray(each.on.value)) for each in wanted]
    rows.append((goal.difference(robot), np.zeros(())))
    timed = any("t" in each.y.needs for each in wanted)
    begun, J = _missed(rows, robot, q, 0.0)
    missed = begun
    for s in np.linspace(0.0, 1.0, STEPS + 1)[1:]:
        if timed:
            missed, J = _missed(rows, robot, q, s * duration)
        for _ in range(NEWTON_STEPS):
            residual = missed - (1.0 - s) * begun
            if np.abs(residual).max() <= (NEARBY if s < 1.0 else REACHED):
                break
            step = np.linalg.lstsq(J, -residual, rcond=RANK)[0]
            q = robot.integrate(q, np.clip(step, -LARGEST_STEP, LARGEST_STEP))
            missed, J = _missed(rows, robot, q, s * duration)
        else:
            return None
    inside = robot.space.coordinates(q)
    return q if ((inside >= bounds[0]) & (inside <= bounds[1])).all() else None


def _missed(
    rows: Sequence[tuple[Function, Array]], robot: Robot, q: Array, t: float
) -> tuple[Array, Array]:
    """Functions minus their values at a configuration and a time, (K,), and the Jacobian."""
    parts = [(*linear(y, q, np.zeros(robot.nv), t), value) for y, value in rows]
    missed, J = [y - value for y, _, value in parts], [slopes[:, 0] for _, slopes, _ in parts]
    return np.concatenate(missed), np.concatenate(J)
