"""Poses of the elements of an MJCF."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from hovi.robot.formats.mjcf_text import Array, MjcfError, numbers
from hovi.system.dataclass import dataclass

ORIENTATIONS = "quat", "axisangle", "xyaxes", "zaxis", "euler"
LEAST_NORM = 1e-10
"""Length below which a vector has no direction."""


@dataclass(frozen=True)
class Angles:
    """Whether angles are in degrees, and the axes of Euler angles, capital if fixed."""

    degrees: bool
    sequence: str

    def radians(self, values: Array) -> Array:
        """Angles in [rad]."""
        return np.deg2rad(values) if self.degrees else values


def pose_of(given: dict[str, str], where: str, angles: Angles) -> pin.SE3:
    """The pose by pos= and one orientation. Raises MjcfError."""
    position = numbers(given, "pos", where, 3)
    return pin.SE3(rotation_of(given, where, angles), np.zeros(3) if position is None else position)


def rotation_of(given: dict[str, str], where: str, angles: Angles) -> Array:
    """The rotation matrix by one orientation; the unit matrix without one. Raises MjcfError."""
    named = [key for key in ORIENTATIONS if key in given]
    if len(named) > 1:
        raise MjcfError(f"{where} has {' and '.join(named)}, also by its class: keep one of them.")
    count = {"quat": 4, "axisangle": 4, "xyaxes": 6, "zaxis": 3, "euler": 3}
    if not named:
        return np.eye(3)
    values = numbers(given, named[0], where, count[named[0]])
    assert values is not None
    return _ROTATIONS[named[0]](values, where, angles)


def unit(vector: Array, what: str) -> Array:
    """A vector of length 1. Raises MjcfError for one without a direction."""
    length = float(np.linalg.norm(vector))
    if length < LEAST_NORM:
        raise MjcfError(f"{what} is zero: give a vector with a direction.")
    return np.asarray(vector / length)


def from_z(direction: Array) -> Array:
    """The least rotation that turns the z axis to a unit vector."""
    return np.array(pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), direction).matrix())


def _quaternion(values: Array, where: str, angles: Angles) -> Array:
    w, x, y, z = unit(values, f"quat of {where}")
    return np.array(pin.Quaternion(w, x, y, z).matrix())


def _axis_angle(values: Array, where: str, angles: Angles) -> Array:
    axis = unit(values[:3], f"the axis in axisangle of {where}")
    return np.array(pin.exp3(axis * float(angles.radians(values[3:])[0])))


def _xy_axes(values: Array, where: str, angles: Angles) -> Array:
    x = unit(values[:3], f"the first axis in xyaxes of {where}")
    y = unit(values[3:] - x * (x @ values[3:]), f"the second axis, without the first, of {where}")
    return np.column_stack([x, y, np.cross(x, y)])


def _z_axis(values: Array, where: str, angles: Angles) -> Array:
    return from_z(unit(values, f"zaxis of {where}"))


def _euler(values: Array, where: str, angles: Angles) -> Array:
    """One rotation after the other, about axes that turn along (xyz) or stay (XYZ)."""
    rotation = np.eye(3)
    for axis, angle in zip(angles.sequence, angles.radians(values), strict=True):
        turn = np.array(pin.exp3(angle * np.eye(3)["xyz".index(axis.lower())]))
        rotation = turn @ rotation if axis.isupper() else rotation @ turn
    return rotation


_ROTATIONS = {
    "quat": _quaternion,
    "axisangle": _axis_angle,
    "xyaxes": _xy_axes,
    "zaxis": _z_axis,
    "euler": _euler,
}
