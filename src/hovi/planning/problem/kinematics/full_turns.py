"""Configurations that differ by full turns of joints, within their limits, at the same pose."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import numpy.typing as npt

from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

TURNED = 2
"""Largest number of joints that are turned at once."""


def with_full_turns(
    robot: Robot, moving: Mask, q: Array, near: Array, bounds: tuple[Array, Array]
) -> Array:
    """A configuration, then those with up to TURNED joints a full turn further, (M, nq).

    Each joint turns in the direction in which it stays within its limits; where it may turn in
    both, in the one that ends nearer to `near`.
    moving: the entries of v that may turn, (nv,). q, near: shape (nq,). bounds: of positions,
        shape (nv,).
    """
    turns = _turns(robot, moving, q, near, bounds)
    joints = np.flatnonzero(turns)
    chosen = [each for count in range(TURNED + 1) for each in combinations(joints, count)]
    found = np.tile(q, (len(chosen), 1))
    for row, each in enumerate(chosen):
        found[row, list(each)] += turns[list(each)]
    return found


def _turns(robot: Robot, moving: Mask, q: Array, near: Array, bounds: tuple[Array, Array]) -> Array:
    """The full turn of each entry of q that is allowed, in [rad]; 0 for none, shape (nq,)."""
    positions, velocities = robot.space.plain
    lower, upper = (side[velocities] for side in bounds)
    angles = moving[velocities] & ~robot.sliding[velocities]
    sides = np.array([[-2 * np.pi], [2 * np.pi]])
    there = q[positions] + sides
    allowed = angles & (there >= lower) & (there <= upper)
    distance = np.where(allowed, np.abs(there - near[positions]), np.inf)
    turns = np.zeros(robot.nq)
    turns[positions] = np.where(allowed.any(axis=0), sides[distance.argmin(axis=0), 0], 0.0)
    return turns
