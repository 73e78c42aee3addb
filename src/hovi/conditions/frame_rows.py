"""Rows of the orientation of a frame that vanish where it has a rotation, or an axis a direction.

Both vanish at half a turn as well.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def rotation_rows(R: ca.SX, target: Array | ca.SX) -> ca.SX:
    """sin(theta) u = sum_i R*_i x R_i / 2 over the columns, for a turn by theta about u, (3,).

    R: of the frame in the world, (3, 3). target: R*, (3, 3).
    """
    wanted = target if isinstance(target, ca.SX) else ca.DM(np.asarray(target))
    turns = [ca.cross(wanted[:, i], R[:, i]) for i in range(3)]
    return (turns[0] + turns[1] + turns[2]) / 2


def axis_rows(R: ca.SX, inner: Array, world: Array) -> ca.SX:
    """The two components of R inner that are orthogonal to a direction, (2,).

    inner, world: unit vectors in the frame and in the world, (3,).
    """
    return ca.DM(across(world)) @ (R @ ca.DM(np.asarray(inner)))


def across(direction: Array) -> Array:
    """Two unit vectors that are orthogonal to one and to each other, (2, 3)."""
    return np.asarray(np.linalg.svd(np.asarray(direction)[None])[2][1:])
