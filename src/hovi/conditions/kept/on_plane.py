"""The origin of a frame stays in a plane."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Self

import casadi as ca
import numpy.typing as npt

from hovi.conditions.kept.keep import (
    POSITION_TOLERANCE,
    Conditions,
    EndPoses,
    KeepFrame,
    as_length,
    distance_kept,
    placement,
)
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class OnPlane(KeepFrame):
    """The origin p of a frame in a plane: n . (p - p0) = 0, or of a size of at most `within`.

    normal: n, of any length. point: p0, in [m]; by default where the frame is at the start.
    within: the largest distance, in [m] or as "5 mm"; None for the plane itself.
    tolerance: by how much the plane may be missed between nodes, in [m] or as "0.01 mm".
    """

    normal: npt.ArrayLike = (0.0, 0.0, 1.0)
    point: npt.ArrayLike | None = None
    within: float | str | None = None
    tolerance: float | str = POSITION_TOLERANCE
    kind: ClassVar[str] = "on_plane"

    def check_values(self) -> None:
        """See Keep."""
        _ = as_length(self.within, self.subject), as_length(self.tolerance, self.subject)
        self._direction("normal", self.normal)
        if self.point is not None:
            self._vector("point", self.point)

    def resolved(self, ends: EndPoses) -> Self:
        """See Keep."""
        return replace(self, point=self._point(self.point, ends))

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        self.check(robot)
        normal, p0 = self._direction("normal", self.normal), self._vector("point", self.point)
        at = placement(robot, self.frame)

        def offsets(q: ca.SX) -> ca.SX:
            return ca.dot(ca.DM(normal), at(q)[1] - ca.DM(p0))

        return (distance_kept(self.title, offsets, self.within, self.tolerance),)
