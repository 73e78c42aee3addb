"""A frame keeps its orientation."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Self

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.conditions.frame_rows import rotation_rows
from hovi.conditions.kept.keep import (
    DIRECTION_TOLERANCE,
    Conditions,
    EndPoses,
    KeepFrame,
    as_angle,
    direction_kept,
    placement,
)
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.robot.space.orientation import ORIENTATIONS, rotation_from
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class KeepOrientation(KeepFrame):
    """The rotation R of a frame: R = R*, or a turn between both of at most `within`.

    rpy: of R*, roll, pitch and yaw in [rad], Rz(yaw) Ry(pitch) Rx(roll) as in a URDF.
    quaternion_xyzw, quaternion_wxyz: the same as a unit quaternion in that order; one of the three
        at most. By default R* is that of the start.
    within: the largest angle, in [rad] or as "5 deg"; None for the orientation itself.
    tolerance: by how much it may be missed between nodes, in [rad] or as "0.01 deg".
    """

    rpy: npt.ArrayLike | None = None
    quaternion_xyzw: npt.ArrayLike | None = None
    quaternion_wxyz: npt.ArrayLike | None = None
    within: float | str | None = None
    tolerance: float | str = DIRECTION_TOLERANCE
    kind: ClassVar[str] = "keep_orientation"

    def check_values(self) -> None:
        """See Keep."""
        _ = as_angle(self.within, self.subject), as_angle(self.tolerance, self.subject)
        given = [name for name in ORIENTATIONS if getattr(self, name) is not None]
        if len(given) > 1:
            raise InputError(
                f"{self.subject} takes one orientation: leave out {given[0]} or {given[1]}."
            )
        _ = self._given  # raises for what is no rotation

    @property
    def _given(self) -> Array | None:
        """R*, (3, 3), if it is given."""
        for name in ORIENTATIONS:
            if getattr(self, name) is not None:
                return rotation_from(name, getattr(self, name), self.subject)
        return None

    def resolved(self, ends: EndPoses) -> Self:
        """See Keep."""
        if self._given is not None:
            return self
        R = ends.start(self.frame).rotation
        if R is None:
            raise self._missing("rpy", "start")
        return replace(self, quaternion_xyzw=pin.Quaternion(R).coeffs().tolist())

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        self.check(robot)
        target = self._given
        assert target is not None
        at = placement(robot, self.frame)

        def offsets(q: ca.SX) -> ca.SX:
            return rotation_rows(at(q)[0], target)

        def chord(q: ca.SX) -> ca.SX:
            return 3.0 - ca.sum1(ca.sum2(ca.DM(target) * at(q)[0]))

        return (direction_kept(self.title, offsets, chord, self.within, self.tolerance),)
