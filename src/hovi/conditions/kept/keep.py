"""The base class of what a motion keeps, which makes conditions for a robot and two ends."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import field, fields, replace
from typing import Any, ClassVar, Self, cast

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments, check_fields
from hovi.checks.directions import unit_vector
from hovi.checks.names import require_name
from hovi.checks.shapes import numbers_of
from hovi.checks.units import angle, length
from hovi.conditions.condition import Condition, require_part
from hovi.conditions.sets import Between, Equal
from hovi.dynamics.symbolic_dynamics import functions_of
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Conditions = tuple[Condition[Any, Any], ...]
Placement = Callable[[ca.SX], tuple[ca.SX, ca.SX]]

POSITION_TOLERANCE = 1e-5
"""By how much a position may miss its value between nodes, in [m]."""
DIRECTION_TOLERANCE = float(np.deg2rad(0.01))
"""By how much a direction may miss its value between nodes, in [rad]."""
LEAST_ROOM = 10.0
"""Room in tolerances below which a value is kept instead: a range that is not much wider."""
NARROW_ROOM = 100.0
"""Room in tolerances below which a solve begins with the value in its middle."""


@dataclass(frozen=True, eq=False)
class Pose:
    """What an end says of a frame. rotation: R, (3, 3). position: (3,), in [m]. None where free."""

    rotation: Array | None = None
    position: Array | None = None


@dataclass(frozen=True, eq=False)
class EndPoses:
    """Where frames are at both ends of a motion, by their names."""

    start: Callable[[str], Pose]
    goal: Callable[[str], Pose]


@dataclass(frozen=True, eq=False)
class Keep(ABC):
    """What a motion keeps all along; the fields of the dataclass are keys in scene files.

    name: in messages and margins; by default what it is and of which frame.
    during: (begin, end) in [s], the part of the motion in which it is kept; all of it if None.
    """

    name: str = field(default="", kw_only=True)
    during: tuple[float, float] | None = field(default=None, kw_only=True)
    kind: ClassVar[str]
    """Its kind in scene files."""

    @check_arguments  # keeps the tracebacks of its errors short
    def __post_init__(self) -> None:
        """Raise InputError for a field of another type, and as `check_values`."""
        check_fields(self, f"keep {self.kind!r}", InputError)
        require_name(self.name, "a condition")
        if self.during is not None:
            require_part(self.during, self.subject)
        self.check_values()

    @abstractmethod
    def check_values(self) -> None:
        """Raise InputError for values that are invalid for every robot."""

    @abstractmethod
    def check(self, robot: Robot) -> None:
        """Raise InputError if it is not valid for the robot."""

    def resolved(self, ends: EndPoses) -> Self:
        """The same with what is not said taken from the ends of a motion; itself by default.

        Raises InputError where an end does not say it either.
        """
        return self

    def require_time(self, ends: EndPoses, longest: float) -> None:
        """Raise InputError where no motion of at most a duration, in [s], keeps it between ends."""
        return

    @abstractmethod
    def conditions(self, robot: Robot) -> Conditions:
        """The conditions on a robot, of what is `resolved`. Raises InputError as `check`."""

    @property
    def centered(self) -> Self:
        """What is kept itself, where it may be kept within a distance or an angle."""
        itself: dict[str, Any] = {"within": None}
        return replace(self, **itself) if hasattr(self, "within") else self

    @property
    def title(self) -> str:
        """Its name, or what it is."""
        return self.name or self.kind.replace("_", " ")

    @property
    def subject(self) -> str:
        """What it is called in messages, such as "keep 'upright tool0'"."""
        return f"keep {self.title!r}"

    def describe(self) -> str:
        """One line for the description of a task: what it is, and what is said of it."""
        said = {k: v for k, v in self.to_dict().items() if k not in ("kind", "name")}
        own = ", ".join(f"{key} {value}" for key, value in said.items())
        return f"{self.title}: {own}"

    def to_dict(self) -> dict[str, Any]:
        """As JSON-able data, with the keys of a scene file."""
        values = {each: _plain(getattr(self, each.name)) for each in fields(self)}
        given = {x.name: value for x, value in values.items() if value != _plain(x.default)}
        return {"kind": self.kind, **given}


@dataclass(frozen=True, eq=False)
class KeepFrame(Keep):
    """What a frame keeps. frame: the name of a frame of the robot."""

    frame: str

    @property
    def title(self) -> str:
        """Its name, or what it is and of which frame."""
        return self.name or f"{super().title} {self.frame}"

    def check(self, robot: Robot) -> None:
        """Raise InputError for a frame that the robot does not have, or that no joint moves."""
        robot.check_frame_moves(self.frame)

    def _vector(self, name: str, given: Any) -> Array:
        """Three finite numbers. Raises InputError."""
        vector = numbers_of(f"the `{name}` of {self.subject}", given)
        if vector.shape != (3,) or not np.isfinite(vector).all():
            raise InputError(
                f"the `{name}` of {self.subject} must be three finite numbers, got {given!r:.200}."
            )
        return vector

    def _direction(self, name: str, given: Any) -> Array:
        """A unit vector along three numbers. Raises InputError where they are all zero."""
        vector = self._vector(name, given)
        if not np.abs(vector).max() > 0.0:
            raise InputError(f"the `{name}` of {self.subject} has length zero; give a direction.")
        return unit_vector(vector)

    def _point(self, given: Any, ends: EndPoses, name: str = "point") -> list[float]:
        """A given point, or where the frame is at the start, (3,). Raises InputError."""
        p = ends.start(self.frame).position if given is None else self._vector(name, given)
        if p is None:
            raise self._missing(name, "start")
        return [float(x) for x in p]

    def _missing(self, name: str, end: str) -> InputError:
        """The error for a field that is not said, and that an end does not say."""
        return InputError(
            f"{self.subject} needs its `{name}`: the {end} does not say where frame "
            f"{self.frame!r} is."
        )


def placement(robot: Robot, frame: str) -> Placement:
    """q -> R (3, 3), p (3,) of a frame."""
    return cast(Placement, functions_of(robot).frame_placement(frame))


Room = float | str | None
"""The largest distance or angle, a number or a text with its unit; None for none at all."""


def as_length(given: Room, subject: str) -> float:
    """A positive length in [m], 0 for None. subject: of messages. Raises InputError."""
    return 0.0 if given is None else length(given, f"a distance of {subject}")


def as_angle(given: Room, subject: str) -> float:
    """A positive angle in [rad], 0 for None. subject: of messages. Raises InputError."""
    return 0.0 if given is None else angle(given, f"an angle of {subject}")


def distance_kept(
    title: str, offsets: Callable[[ca.SX], ca.SX], within: Room, tolerance: Room
) -> Condition[Any, Any]:
    """Offsets in [m], a column of q, that vanish, or whose norm is at most `within`."""
    room, accepted = as_length(within, title), as_length(tolerance, title)
    if room < LEAST_ROOM * accepted:
        return _value(title, offsets, room, accepted, "m")

    def squared(q: ca.SX) -> ca.SX:
        return ca.sumsqr(offsets(q))

    on, middle = Between(upper=room**2), _middle(title, offsets, room, accepted, "m")
    more: dict[str, Any] = {"scale": room**2, "read": root, "middle": middle}
    return Condition(squared, on, name=title, unit="m", **more)


def direction_kept(
    title: str,
    offsets: Callable[[ca.SX], ca.SX],
    chord: Callable[[ca.SX], ca.SX],
    within: Room,
    tolerance: Room,
) -> Condition[Any, Any]:
    """Sines of angles in [rad], a column of q, that vanish, or an angle of at most `within`.

    chord: 2 (1 - cos) of the angle, which grows up to half a turn, where the sines vanish, too.
    """
    room, accepted = as_angle(within, title), as_angle(tolerance, title)
    if room < LEAST_ROOM * accepted:
        return _value(title, offsets, room, accepted, "rad")
    most = 4.0 * np.sin(min(room, np.pi) / 2) ** 2
    middle = _middle(title, offsets, room, accepted, "rad")
    more: dict[str, Any] = {"scale": most, "read": _angle, "middle": middle}
    return Condition(chord, Between(upper=most), name=title, unit="deg", **more)


def root(square: float) -> float:
    """A size of a square, which may be a rounding error below zero."""
    return math.sqrt(max(square, 0.0))


def _angle(chord: float) -> float:
    """An angle in degrees of 2 (1 - cos) of it."""
    return math.degrees(2.0 * math.asin(min(0.5 * root(chord), 1.0)))


def _value(
    title: str, offsets: Callable[..., ca.SX], room: float, accepted: float, unit: str
) -> Condition[Any, Any]:
    """Offsets that vanish, but for what is accepted, or the room if that is less."""
    tolerance = min(room, accepted) if room > 0 else accepted
    return Condition(offsets, Equal(0.0), name=title, unit=unit, tolerance=tolerance)


def _middle(
    title: str, offsets: Callable[..., ca.SX], room: float, accepted: float, unit: str
) -> Condition[Any, Any] | None:
    """The value in the middle of a narrow room; None for another one."""
    narrow = room < NARROW_ROOM * accepted
    return _value(title, offsets, 0.0, accepted, unit) if narrow else None


def pose_kept(
    kept: KeepFrame,
    shifts: Callable[..., ca.SX] | None,
    turns: Callable[..., ca.SX] | None,
    tolerance: Room,
    angle: Room,
) -> Conditions:
    """Shifts in [m] and sines of turns in [rad], columns, that vanish; None for those that do not.

    tolerance, angle: by how much each may be missed between nodes.
    """
    found = list[Condition[Any, Any]]()
    if shifts is not None:
        found.append(_value(kept.title, shifts, 0.0, as_length(tolerance, kept.subject), "m"))
    if turns is not None:
        title = f"{kept.title} (turn)" if found else kept.title
        found.append(_value(title, turns, 0.0, as_angle(angle, kept.subject), "rad"))
    return tuple(found)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [_plain(each) for each in value] if isinstance(value, list | tuple) else value
