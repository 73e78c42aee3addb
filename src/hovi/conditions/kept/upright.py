"""An axis of a frame keeps its direction: a cup stays upright."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.conditions.frame_rows import axis_rows
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
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
UP = np.array([0.0, 0.0, 1.0])
"""The direction in the world that is up."""


@dataclass(frozen=True, eq=False)
class Upright(KeepFrame):
    """The direction of an axis of a frame: R u = w, or an angle between them of at most `within`.

    axis: (u in the frame, w in the world), as of a FrameGoal; by default what points up at the
        start stays up.
    within: the largest angle, in [rad] or as "5 deg"; None for the direction itself.
    tolerance: by how much the direction may be missed between nodes, in [rad] or as "0.01 deg".
    """

    axis: tuple[npt.ArrayLike, npt.ArrayLike] | Mapping[str, npt.ArrayLike] | None = None
    within: float | str | None = None
    tolerance: float | str = DIRECTION_TOLERANCE
    kind: ClassVar[str] = "upright"

    def check_values(self) -> None:
        """See Keep."""
        _ = as_angle(self.within, self.subject), as_angle(self.tolerance, self.subject)
        if self.axis is not None:
            self._pair(self.axis)

    def _pair(self, given: Any) -> tuple[Array, Array]:
        """The directions of the axis in the frame and in the world. Raises InputError."""
        if isinstance(given, Mapping):
            given = [given.get(x) for x in ("frame", "world")] if len(given) == 2 else ()
        if len(given) != 2:
            raise InputError(
                f"the `axis` of {self.subject} must be a pair: a direction in the frame and one in "
                f"the world, got {given!r:.200}."
            )
        inner, world = (self._direction("axis", each) for each in given)
        return inner, world

    def resolved(self, ends: EndPoses) -> Self:
        """See Keep."""
        if self.axis is not None:
            return self
        R = ends.start(self.frame).rotation
        if R is None:
            raise self._missing("axis", "start")
        return replace(self, axis=((R.T @ UP).tolist(), UP.tolist()))

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        self.check(robot)
        inner, world = self._pair(self.axis)
        at = placement(robot, self.frame)

        def offsets(q: ca.SX) -> ca.SX:
            return axis_rows(at(q)[0], inner, world)

        def chord(q: ca.SX) -> ca.SX:
            return ca.sumsqr(at(q)[0] @ ca.DM(inner) - ca.DM(world))

        return (direction_kept(self.title, offsets, chord, self.within, self.tolerance),)
