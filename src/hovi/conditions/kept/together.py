"""Two frames keep their poses relative to each other: two hands carry a box."""

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


@dataclass(frozen=True, eq=False)
class Together(KeepFrame):
    """The pose of another frame in a frame: R^T (p' - p) = d and R^T R' = D.

    other: the name of the other frame, of R' and p'.
    position: d, in [m]. rpy: of D, in [rad]. By default both are those of the start.
    tolerance: by how much the position may be missed between nodes, in [m] or as "0.01 mm"; angle:
        the same for the rotation, in [rad] or as "0.01 deg".
    """

    other: str
    position: npt.ArrayLike | None = None
    rpy: npt.ArrayLike | None = None
    tolerance: float | str = POSITION_TOLERANCE
    angle: float | str = DIRECTION_TOLERANCE
    kind: ClassVar[str] = "together"

    @property
    def title(self) -> str:
        """Its name, or both frames."""
        return self.name or f"{super().title} {self.other}"

    def check_values(self) -> None:
        """See Keep."""
        _ = as_length(self.tolerance, self.subject), as_angle(self.angle, self.subject)
        if self.position is not None:
            self._vector("position", self.position)
        if self.rpy is not None:
            rotation_from("rpy", self.rpy, self.subject)

    def check(self, robot: Robot) -> None:
        """Raise InputError for a frame that the robot does not have, and for frames of one link."""
        for frame in (self.frame, self.other):
            robot.check_frame_moves(frame)
        joints = (robot.model.frames[robot.model.getFrameId(x)].parentJoint for x in self._both)
        if len(set(joints)) == 1:
            raise InputError(
                f"{self.subject} is about two frames of one link, which no motion changes: name "
                "frames of different ones."
            )

    @property
    def _both(self) -> tuple[str, str]:
        return self.frame, self.other

    def resolved(self, ends: EndPoses) -> Self:
        """See Keep."""
        if self.position is not None and self.rpy is not None:
            return self
        (R, p), (other_R, other_p) = (
            (each.rotation, each.position) for each in map(ends.start, self._both)
        )
        if R is None or p is None or other_R is None or other_p is None:
            raise self._missing("position", "start")
        d, rpy = self.position, self.rpy
        d = (R.T @ (other_p - p)).tolist() if d is None else d
        rpy = pin.rpy.matrixToRpy(R.T @ other_R).tolist() if rpy is None else rpy
        return replace(self, position=d, rpy=rpy)

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        self.check(robot)
        first, second = (placement(robot, each) for each in self._both)
        d, D = self._vector("position", self.position), rotation_from("rpy", self.rpy, self.subject)

        def apart(q: ca.SX) -> ca.SX:
            (R, p), (_, other) = first(q), second(q)
            return R.T @ (other - p) - ca.DM(d)

        def turned(q: ca.SX) -> ca.SX:
            return rotation_rows(first(q)[0].T @ second(q)[0], D)

        return pose_kept(self, apart, turned, self.tolerance, self.angle)
