"""Regions in which a frame may end: how each of their bounds is held, as equations.

A bound is held at its middle, as a goal without a region is, or at its edge on one side, which is
one equation; or not at all, where the frame ends inside. With the offset d of the origin, in [m],
and the angle theta by which a rotation or an axis is off:

    |d|^2 / (2 r) = r / 2 for a ball of radius r,   d_i = -b_i or d_i = b_i for a box,
    2 (1 - cos theta) / (2 sin alpha) = 2 (1 - cos alpha) / (2 sin alpha) for an angle alpha,

whose slopes in the distance and in the angle are 1 at the edge.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import StrEnum
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.checks.kinds import is_number
from hovi.checks.units import angle, length
from hovi.errors import InputError
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Within = float | str | npt.ArrayLike
"""A radius, or half of the edges of a box: numbers or texts with their unit."""

AXES, ANGLE = ("x", "y", "z"), "angle"
"""Names of the bounds of a box, and of an angle."""


class Side(StrEnum):
    """Where a bound of a region is held."""

    MIDDLE = "middle"
    INSIDE = "inside"
    LOW = "low"
    HIGH = "high"


@dataclass(frozen=True, eq=False)
class Bound:
    """A bound of a region. name: in messages. room: its radius, half of its edge, or its angle.

    first, size: which equations hold it at its middle, among those of the frame's goal.
    """

    name: str
    room: float
    first: int
    size: int

    @property
    def entries(self) -> slice:
        """Where its equations are among those of the frame's goal."""
        return slice(self.first, self.first + self.size)

    @property
    def of_angle(self) -> bool:
        """Whether it bounds an angle."""
        return self.name == ANGLE

    def edge(self, middle: ca.SX, turn: ca.SX, side: Side) -> ca.SX:
        """The equation at its edge. middle: those at its middle. turn: 1 - cos of the angle."""
        if self.of_angle:
            return ca.SX((turn - (1.0 - np.cos(self.room))) / np.sin(self.room))
        if self.size == 1:
            return ca.SX(middle - (self.room if side is Side.HIGH else -self.room))
        return ca.SX(ca.sumsqr(middle) / (2.0 * self.room) - self.room / 2.0)


def room_of(within: Any) -> tuple[float, ...]:
    """The radius of a ball, in [m], or half of the three edges of a box. Raises InputError."""
    what = "`within` of a frame goal"
    within = within.tolist() if isinstance(within, np.ndarray) else within
    if not isinstance(within, list | tuple):
        return (length(within, what),)
    if len(within) != len(AXES):
        raise InputError(f"{what} must be a length, or three for a box, got {within!r:.200}.")
    return tuple(0.0 if _is_zero(each) else length(each, what) for each in within)


def angle_of(within: Any) -> float:
    """The largest angle of a region, in [rad], below half a turn. Raises InputError."""
    what = "`within_angle` of a frame goal"
    found = angle(within, what)
    if found >= np.pi:
        raise InputError(
            f"{what} must be less than half a turn, got {within!r}: leave the rotation or the axis "
            "out to have any."
        )
    return found


def _is_zero(given: Any) -> bool:
    return is_number(given) and float(given) == 0.0


def held(middle: ca.SX, turn: ca.SX, bounds: Sequence[Bound], sides: Sequence[Side]) -> ca.SX:
    """The equations of a goal whose bounds are held at sides, those at its middle by default.

    middle: its equations at the middle of all bounds. turn: 1 - cos of the angle.
    """
    rows, parts = list[ca.SX](), dict(zip([x.first for x in bounds], sides, strict=False))
    of = {i: each for each in bounds for i in range(each.first, each.first + each.size)}
    for i in range(middle.shape[0]):
        bound = of.get(i)
        side = Side.MIDDLE if bound is None else parts.get(bound.first, Side.MIDDLE)
        if side is Side.MIDDLE:
            rows.append(middle[i])
        elif bound is not None and i == bound.first and side is not Side.INSIDE:
            rows.append(bound.edge(middle[bound.entries], turn, side))
    return ca.vertcat(*rows)


def bounds_of(
    room: tuple[float, ...] | None, angle: float | None, position: int, turn: int
) -> Iterator[Bound]:
    """The bounds of a goal, in the order of its equations.

    room, angle: as `room_of` and `angle_of` have them, None where a goal is exact. position, turn:
    number of its equations of a position, and of a rotation or an axis.
    """
    if room is not None and len(room) == 1:
        yield Bound("distance", room[0], 0, len(AXES))
    elif room is not None:
        for i, (axis, half) in enumerate(zip(AXES, room, strict=True)):
            if half > 0.0:
                yield Bound(axis, half, i, 1)
    if angle is not None:
        yield Bound(ANGLE, angle, position, turn)
