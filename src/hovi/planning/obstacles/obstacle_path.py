"""The path along which an obstacle moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.arguments import check_arguments_except
from hovi.checks.shapes import numbers_of
from hovi.errors import InputError, nearest
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

MAX_POSES = 10_000
"""Maximum number of poses of a path."""
MAX_NUMBER = 1e9
"""Largest time or coordinate, in [s], [m] or [rad]."""
LEAST_COSINE = 0.05
"""Least cosine of half the angle between two poses, which has to be less than half a turn."""


@check_arguments_except("times", "positions", "rpy")
@dataclass(frozen=True)
class ObstaclePath:
    """Poses at times, and smooth motion between them: natural cubic splines, two poses a line.

    The pose of an obstacle at a time is that of the path times that of its shape. Before the first
    and after the last time it stands still.

    times: ascending, shape (M,), in [s]. positions: shape (M, 3), in [m].
    rpy: roll, pitch and yaw as in a URDF, shape (M, 3), in [rad]; none by default.
    Raises InputError for other shapes, times that do not ascend, and poses that are half a turn
    apart.
    """

    times: npt.ArrayLike
    positions: npt.ArrayLike
    rpy: npt.ArrayLike | None = None

    def __post_init__(self) -> None:
        count = self._keep("times", ())
        self._keep("positions", (3,))
        if self.rpy is not None:
            self._keep("rpy", (3,))
        lengths = [len(x) for x in (self.times, self.positions, self.rpy) if isinstance(x, tuple)]
        if not 2 <= count <= MAX_POSES or len(set(lengths)) > 1:
            raise InputError(
                f"a path of an obstacle needs 2 to {MAX_POSES:,} times and as many positions and "
                f"rpy, got {', '.join(str(n) for n in lengths)}."
            )
        if not (np.diff(np.asarray(self.times)) > 0).all():
            raise InputError("the times of a path of an obstacle must ascend.")
        q = self._quaternions
        if (np.vecdot(q[1:], q[:-1]) < LEAST_COSINE).any():
            raise InputError(
                "the poses of a path of an obstacle must be less than half a turn apart: give "
                "poses in between."
            )

    @classmethod
    def of(cls, given: Any) -> ObstaclePath | None:
        """A path, or one from a mapping of its fields, or None. Raises InputError."""
        if given is None or isinstance(given, cls):
            return given
        known = [each.name for each in fields(cls)]
        if not isinstance(given, Mapping):
            raise InputError(
                f"the path of an obstacle must have times and positions, got {given!r:.200}."
            )
        for key in given:
            if key not in known:
                raise InputError(
                    f"a path of an obstacle has no `{key!s:.80}`: {nearest(str(key)[:80], known)}"
                )
        for key in known[:2]:
            if key not in given:
                raise InputError(f"a path of an obstacle needs `{key}`.")
        return cls(**given)

    def to_dict(self) -> dict[str, Any]:
        """The path as JSON-able data, with the keys of a scene file."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        return {key: np.asarray(x).tolist() for key, x in values.items() if x is not None}

    def from_time(self, time: float) -> ObstaclePath:
        """The path by a clock that starts at a time, in [s]."""
        return replace(self, times=np.asarray(self.times) - time)

    def poses(self, t: npt.ArrayLike) -> Array:
        """Positions and unit quaternions (x, y, z, w) at times (P,), shape (P, 7)."""
        times = np.asarray(self.times)
        found = np.array(self._spline(np.clip(numbers_of("t", t, None), times[0], times[-1])))
        found[:, 3:] /= np.linalg.norm(found[:, 3:], axis=1, keepdims=True)
        return found

    def pose(self, t: float) -> pin.SE3:
        """The pose at a time."""
        return pose_from_row(self.poses([t])[0])

    def travelled(self, t: npt.ArrayLike) -> tuple[Array, Array]:
        """Bounds of the way of its origin, in [m], and of its turn, in [rad], from its first time.

        t: times (P,), in [s]. Between two times the difference bounds how far it moves. Both grow
        evenly between the path's own times, by its largest speed there.
        """
        times = np.asarray(self.times)
        grown = np.concatenate([np.zeros((1, 2)), np.cumsum(self._largest_steps, axis=0)])
        way, angle = (np.interp(numbers_of("t", t, None), times, each) for each in grown.T)
        return way, angle

    @cached_property
    def _largest_steps(self) -> Array:
        """Bounds of way and turn between its times, shape (M - 1, 2).

        The derivative of a cubic lies between its control points; of a rotation it is at most twice
        that of the quaternion, relative to the quaternion's length.
        """
        h = np.diff(np.asarray(self.times))[:, None]
        a, b, c, q = np.asarray(self._spline.c)
        points = np.stack([c, c + b * h, c + 2.0 * b * h + 3.0 * a * h**2])
        speeds = [np.linalg.norm(x, axis=2).max(axis=0) for x in (points[..., :3], points[..., 3:])]
        fractions = np.linspace(0.0, 1.0, 9)[:, None, None]
        along = q + fractions * h * (c + fractions * h * (b + fractions * h * a))
        length = np.linalg.norm(along[..., 3:], axis=2).min(axis=0)
        turns = np.where(speeds[1] == 0, 0.0, 2.0 * speeds[1] / np.maximum(length, LEAST_COSINE))
        return np.column_stack([speeds[0], turns]) * h

    @cached_property
    def _spline(self) -> Any:
        """Of positions and quaternions, whose signs make neighbors close."""
        from scipy.interpolate import CubicSpline  # a quarter of a second

        rows = np.column_stack([np.asarray(self.positions), self._quaternions])
        return CubicSpline(np.asarray(self.times), rows, bc_type="natural")

    @property
    def _quaternions(self) -> Array:
        times = np.asarray(self.times)
        rpy = np.zeros((len(times), 3)) if self.rpy is None else np.asarray(self.rpy)
        turns = [pin.Quaternion(pin.rpy.rpyToMatrix(*each)).coeffs() for each in rpy]
        q = np.array(turns)
        signs = np.where(np.vecdot(q[1:], q[:-1]) < 0.0, -1.0, 1.0)
        q[1:] *= np.cumprod(signs)[:, None]
        return q

    def _keep(self, key: str, shape: tuple[int, ...]) -> int:
        """Store a field as nested tuples; its length. Raises InputError."""
        numbers = numbers_of(f"`{key}` of a path", getattr(self, key))
        if numbers.ndim < 1 or numbers.shape[1:] != shape or not (abs(numbers) <= MAX_NUMBER).all():
            words = "a list of finite numbers" if not shape else "rows of three finite numbers"
            raise InputError(f"`{key}` of a path of an obstacle must be {words}.")
        rows = numbers.tolist()
        kept = tuple(tuple(row) for row in rows) if shape else tuple(rows)
        object.__setattr__(self, key, kept)
        return len(kept)


def pose_from_row(row: Array) -> pin.SE3:
    """The pose of a position and a unit quaternion (x, y, z, w), shape (7,)."""
    return pin.XYZQUATToSE3(np.asarray(row))
