"""A frame keeps some of the six coordinates of its pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar, Self

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.conditions.frame_rows import rotation_rows
from hovi.conditions.kept.keep import (
    DIRECTION_TOLERANCE,
    POSITION_TOLERANCE,
    Conditions,
    EndPoses,
    KeepFrame,
    as_angle,
    as_length,
    placement,
    pose_kept,
)
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.robot.space.orientation import rotation_from
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

SHIFTS, TURNS = ("x", "y", "z"), ("rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class KeepPose(KeepFrame):
    """Some coordinates of the pose (R, p) of a frame in the axes of a pose (R*, p*).

    They are those of R*^T (p - p*), and of sin(theta) u in these axes for a turn by theta about u.

    axes: which are kept, of "x", "y", "z", "rx", "ry" and "rz"; all by default.
    position: p*, in [m]. rpy: of R*, in [rad]. By default both are those of the start.
    tolerance: by how much x, y and z may be missed between nodes, in [m] or as "0.01 mm"; angle:
        the same for rx, ry and rz, in [rad] or as "0.01 deg".
    """

    axes: Sequence[str] = (*SHIFTS, *TURNS)
    position: npt.ArrayLike | None = None
    rpy: npt.ArrayLike | None = None
    tolerance: float | str = POSITION_TOLERANCE
    angle: float | str = DIRECTION_TOLERANCE
    kind: ClassVar[str] = "keep_pose"

    def check_values(self) -> None:
        """See Keep."""
        _ = as_length(self.tolerance, self.subject), as_angle(self.angle, self.subject)
        known = (*SHIFTS, *TURNS)
        unlike = len(set(self.axes)) == len(self.axes) > 0
        if isinstance(self.axes, str) or not unlike or not set(self.axes) <= set(known):
            raise InputError(
                f"the `axes` of {self.subject} must be some of {', '.join(known)}, got "
                f"{self.axes!r:.200}."
            )
        if self.position is not None:
            self._vector("position", self.position)
        if self.rpy is not None:
            rotation_from("rpy", self.rpy, self.subject)

    def resolved(self, ends: EndPoses) -> Self:
        """See Keep."""
        start = ends.start(self.frame)
        position = self._point(self.position, ends, "position")
        rpy = self.rpy
        if rpy is None:
            if start.rotation is None:
                raise self._missing("rpy", "start")
            rpy = pin.rpy.matrixToRpy(start.rotation).tolist()
        return replace(self, position=position, rpy=rpy)

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        self.check(robot)
        p = self._vector("position", self.position)
        R, at = rotation_from("rpy", self.rpy, self.subject), placement(robot, self.frame)
        shifts = [i for i, name in enumerate(SHIFTS) if name in self.axes]
        turns = [i for i, name in enumerate(TURNS) if name in self.axes]

        def shifted(q: ca.SX) -> ca.SX:
            return (ca.DM(R.T) @ (at(q)[1] - ca.DM(p)))[shifts]

        def turned(q: ca.SX) -> ca.SX:
            return (ca.DM(R.T) @ rotation_rows(at(q)[0], R))[turns]

        asked = shifted if shifts else None, turned if turns else None
        return pose_kept(self, *asked, self.tolerance, self.angle)
