"""Rotation matrices from roll, pitch and yaw, or from a quaternion whose order is named."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.directions import unit_vector
from hovi.checks.shapes import numbers_of
from hovi.errors import InputError, warn
from hovi.robot.space.angle_ranges import rpy_in_degrees

Array = npt.NDArray[np.float64]

ORIENTATIONS = ("rpy", "quaternion_xyzw", "quaternion_wxyz")
"""The ways to give a rotation by a few numbers."""
NORM_TOLERANCE = 1e-3
"""Largest deviation of a quaternion's length from 1, which is then made 1: four digits will do."""


def rotation_from(name: str, value: Any, of: str = "a frame goal") -> Array:
    """The rotation matrix (3, 3) of one of the ORIENTATIONS.

    name: "rpy" for roll, pitch and yaw in [rad], R = Rz(yaw) Ry(pitch) Rx(roll) as in a URDF;
        "quaternion_xyzw" or "quaternion_wxyz" for a unit quaternion in that order.
    of: whose it is, in messages.
    Raises InputError for other numbers. Warns of roll, pitch and yaw that look like degrees.
    """
    size, of_what = (3, "three") if name == "rpy" else (4, "four")
    numbers = numbers_of(f"the {name} of {of}", value)
    if numbers.shape != (size,) or not np.isfinite(numbers).all():
        raise InputError(f"the {name} of {of} must be {of_what} finite numbers, got {value!r}.")
    if name == "rpy":
        note = rpy_in_degrees(numbers)
        if note:
            warn(f"{of}'s {note}.")
        return np.array(pin.rpy.rpyToMatrix(numbers))
    length = math.hypot(*numbers)
    if abs(length - 1.0) > NORM_TOLERANCE:
        raise InputError(
            f"the {name} of {of} must have length 1, got {value!r} of length {length:.4g}: "
            "divide it by its length."
        )
    xyzw = numbers if name == "quaternion_xyzw" else numbers[[1, 2, 3, 0]]
    return np.array(pin.Quaternion(unit_vector(xyzw)).toRotationMatrix())
