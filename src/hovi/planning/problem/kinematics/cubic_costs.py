"""The costs of many cubics at once, as a first estimate of what motions cost."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.robot.robot import Robot
from hovi.scene.lagrangian import Lagrangian

Array = npt.NDArray[np.float64]

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(8)
"""Gauss points in [-1, 1] and their weights, by which the cost of a cubic is integrated."""


def cubic_costs(
    lagrangian: Lagrangian, robot: Robot, q0: Array, q1: Array, duration: float, begin: float = 0.0
) -> Array:
    """The costs of the cubics between pairs of configurations at rest, shape (P,).

    q0, q1: shape (P, nq). duration: of each cubic, which starts at `begin`, in [s].
    """
    T, s = duration, (POINTS + 1) / 2
    basis = [s**2 * (3 - 2 * s), 6 * s * (1 - s) / T, (6 - 12 * s) / T**2, -12 * s**0 / T**3]
    step = robot.difference(q0, q1)
    jet = [(row[:, None, None] * step).reshape(-1, robot.nv) for row in basis]
    jet[0] = robot.integrate(np.tile(q0, (len(s), 1)), jet[0])
    t = np.repeat(begin + s * T, len(q0))
    value = lagrangian.value(*jet[: lagrangian.order + 1], t=t)
    return np.asarray(WEIGHTS @ value.reshape(len(s), -1)) * T / 2
