"""A floating body with an arm, and its flight past a ball."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

import hovi
from samples.small_robots import arm

Array = npt.NDArray[np.float64]
BALL = hovi.Sphere([0.5, 0.02, 0.05], 0.1, name="ball")


def floating() -> hovi.Robot:
    return arm("floating", ("revolute",), free_flyer=True)


def flight(robot: hovi.Robot, turn: float = 0.8) -> tuple[Array, Array]:
    """Configurations on both sides of the ball, the second one turned."""
    start = pin.neutral(robot.model)
    goal = start.copy()
    start[0] -= 0.4
    goal[:3] = 1.0, 0.1, -0.05
    goal[3:7] = pin.Quaternion(pin.exp3(np.array([0.3, turn, -0.4]))).coeffs()
    goal[7] = 0.5
    return start, goal
