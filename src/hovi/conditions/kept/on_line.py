"""The origin of a frame stays on a line."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Self

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.conditions.frame_rows import across
from hovi.conditions.kept.keep import (
    POSITION_TOLERANCE,
    Conditions,
    EndPoses,
    KeepFrame,
    as_length,
    distance_kept,
    placement,
)
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

LEAST_LENGTH = 1e-4
"""Distance between both ends in [m] from which they say the direction of a line."""


@dataclass(frozen=True, eq=False)
class OnLine(KeepFrame):
    """The origin p of a frame on a line: (1 - d d^T) (p - p0) = 0, or no longer than `within`.

    Where on the line it is at a time is free, also beyond both ends.

    direction: d, of any length; by default from the start to the goal.
    point: p0, in [m]; by default where the frame is at the start.
    within: the largest distance, in [m] or as "5 mm"; None for the line itself.
    tolerance: by how much the line may be missed between nodes, in [m] or as "0.01 mm".
    """

    direction: npt.ArrayLike | None = None
    point: npt.ArrayLike | None = None
    within: float | str | None = None
    tolerance: float | str = POSITION_TOLERANCE
    kind: ClassVar[str] = "on_line"

    def check_values(self) -> None:
        """See Keep."""
        _ = as_length(self.within, self.subject), as_length(self.tolerance, self.subject)
        if self.direction is not None:
            self._direction("direction", self.direction)
        if self.point is not None:
            self._vector("point", self.point)

    def resolved(self, ends: EndPoses) -> Self:
        """See Keep."""
        point, direction = self._point(self.point, ends), self.direction
        if direction is None:
            end = ends.goal(self.frame).position
            if end is None:
                raise self._missing("direction", "goal")
            direction = (end - np.array(point)).tolist()
            if np.linalg.norm(direction) < LEAST_LENGTH:
                raise InputError(
                    f"{self.subject} needs a `direction`: frame {self.frame!r} begins where it "
                    "ends."
                )
        return replace(self, point=point, direction=direction)

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        self.check(robot)
        normals = across(self._direction("direction", self.direction))
        p0, at = self._vector("point", self.point), placement(robot, self.frame)

        def offsets(q: ca.SX) -> ca.SX:
            return ca.DM(normals) @ (at(q)[1] - ca.DM(p0))

        return (distance_kept(self.title, offsets, self.within, self.tolerance),)
