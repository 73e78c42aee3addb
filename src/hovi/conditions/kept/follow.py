"""A frame follows poses at given times."""

from __future__ import annotations

from collections.abc import Callable
from math import factorial
from typing import ClassVar

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.interpolate import make_interp_spline

from hovi.checks.shapes import numbers_of
from hovi.conditions.frame_rows import rotation_rows
from hovi.conditions.kept.keep import (
    DIRECTION_TOLERANCE,
    POSITION_TOLERANCE,
    Conditions,
    KeepFrame,
    as_angle,
    as_length,
    placement,
    pose_kept,
)
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

DEGREE = 5
"""Of the pieces of a path."""
MAX_POSES = 50
"""Largest number of poses: each adds a piece to the expression of the path."""
LEAST_COSINE = 0.05
"""Least cosine of half the angle between two poses, which has to be less than half a turn."""


@dataclass(frozen=True, eq=False)
class Follow(KeepFrame):
    """The pose of a frame along a path: p = p*(t), and R = R*(t) where rotations are given.

    The path is a spline of degree 5 through the poses, of class C^4, at rest and without
    acceleration at both ends; quaternions are interpolated so, and divided by their length.

    A motion that lasts longer than the path holds its last pose from then on.

    times: ascending, the first one 0, shape (M,), in [s]; the last one is when the path ends, for
        most motions their duration.
    positions: shape (M, 3), in [m]. rpy: roll, pitch and yaw as in a URDF, shape (M, 3), in [rad];
        none by default, which leaves the rotation free.
    tolerance: by how much positions may be missed between nodes, in [m] or as "0.01 mm"; angle:
        the same for the rotation, in [rad] or as "0.01 deg".
    """

    times: npt.ArrayLike
    positions: npt.ArrayLike
    rpy: npt.ArrayLike | None = None
    tolerance: float | str = POSITION_TOLERANCE
    angle: float | str = DIRECTION_TOLERANCE
    kind: ClassVar[str] = "follow"

    def check_values(self) -> None:
        """See Keep."""
        _ = as_length(self.tolerance, self.subject), as_angle(self.angle, self.subject)
        t, p, R = self._path
        if not 2 <= len(t) <= MAX_POSES or any(x is not None and len(x) != len(t) for x in (p, R)):
            raise InputError(
                f"{self.subject} needs 2 to {MAX_POSES} times, and as many positions and rpy, got "
                f"{len(t)} times and {len(p)} positions."
            )
        if t[0] != 0.0 or not (np.diff(t) > 0).all():
            raise InputError(f"the `times` of {self.subject} must ascend from 0, got {t}.")
        if R is not None and (np.vecdot(R[1:], R[:-1]) < LEAST_COSINE).any():
            raise InputError(
                f"the poses of {self.subject} must be less than half a turn apart: give poses in "
                "between."
            )

    @property
    def _path(self) -> tuple[Array, Array, Array | None]:
        """Times (M,), positions (M, 3) and quaternions (M, 4), each near the one before."""
        t, p = self._numbers("times", 1), self._numbers("positions", 2)
        if self.rpy is None:
            return t, p, None
        found = list[Array]()
        for each in self._numbers("rpy", 2):
            q = pin.Quaternion(pin.rpy.rpyToMatrix(each)).coeffs()
            found.append(-q if found and q @ found[-1] < 0 else q)
        return t, p, np.array(found)

    def _numbers(self, name: str, dimensions: int) -> Array:
        x = numbers_of(f"the `{name}` of {self.subject}", getattr(self, name))
        fits = x.ndim == dimensions and (dimensions == 1 or x.shape[1] == 3)
        if not fits or not np.isfinite(x).all():
            shape = "a list of numbers" if dimensions == 1 else "a list of three numbers each"
            raise InputError(f"the `{name}` of {self.subject} must be {shape}, got {x.shape}.")
        return x

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        self.check(robot)
        (t, p, quaternions), at = self._path, placement(robot, self.frame)
        along = _spline(t, p)
        turning = None if quaternions is None else _spline(t, quaternions)

        def position(q: ca.SX, t: ca.SX) -> ca.SX:
            return at(q)[1] - along(t)

        def rotation(q: ca.SX, t: ca.SX) -> ca.SX:
            assert turning is not None
            return _turned_rows(at(q)[0], turning(t))

        turned = None if turning is None else rotation
        return pose_kept(self, position, turned, self.tolerance, self.angle)


def _spline(t: Array, x: Array) -> Callable[[ca.SX], ca.SX]:
    """The spline through points (M, d) as a function of time: a column of d."""
    rest = [(1, np.zeros(x.shape[1])), (2, np.zeros(x.shape[1]))]
    spline = make_interp_spline(t, x, k=DEGREE, bc_type=(rest, rest))
    knots = np.unique(spline.t)[:-1].tolist()
    taylor = [spline.derivative(j)(knots) / factorial(j) for j in range(DEGREE, 0, -1)]
    coefficients = [*taylor, spline(knots)]

    def at(time: ca.SX) -> ca.SX:
        inside = ca.fmin(ca.fmax(time, float(t[0])), float(t[-1]))
        value = ca.SX.zeros(x.shape[1])
        for number, knot in enumerate(knots):
            piece = ca.SX.zeros(x.shape[1])
            for each in coefficients:
                piece = piece * (inside - knot) + ca.DM(each[number])
            value = piece if number == 0 else ca.if_else(inside >= knot, piece, value)
        return value

    return at


def _turned_rows(R: ca.SX, quaternion: ca.SX) -> ca.SX:
    """sin(theta) u of the turn from a quaternion (x, y, z, w) of any length to R, (3,)."""
    unit = quaternion / ca.norm_2(quaternion)
    u, w = unit[:3], unit[3]
    turned = u @ u.T + w * ca.skew(u)
    return rotation_rows(R, (w**2 - ca.sumsqr(u)) * ca.SX.eye(3) + 2 * turned)
