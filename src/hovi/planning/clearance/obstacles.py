"""Obstacles that stand still in the world: spheres, capsules and boxes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.arguments import check_arguments_except
from hovi.checks.shapes import numbers_of
from hovi.errors import InputError, nearest

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Obstacle(ABC):
    """A convex shape with a fixed pose in the world, in [m] and [rad].

    name: used in messages.
    """

    name: str = field(default="", kw_only=True)

    @abstractmethod
    def shape(self) -> coal.CollisionGeometry:
        """The shape in its own frame."""

    @abstractmethod
    def placement(self) -> pin.SE3:
        """Pose of the shape's frame in the world."""

    @property
    def kind(self) -> str:
        """The kind as files name it: "sphere", "capsule" or "box"."""
        return type(self).__name__.lower()

    def to_dict(self) -> dict[str, Any]:
        """The obstacle as JSON-able data."""
        values = {each.name: _plain(getattr(self, each.name)) for each in fields(self)}
        return {"kind": self.kind, **values}

    def _keep(self, key: str, shape: tuple[int, ...]) -> None:
        """Store a field as nested tuples of finite numbers. Raises InputError."""
        value = getattr(self, key)
        try:
            numbers = numbers_of(key, value)
        except InputError:
            numbers = np.full((), np.nan)
        if numbers.shape != shape or not np.isfinite(numbers).all():
            size = f"{' x '.join(str(n) for n in shape)} finite numbers" if shape else "a number"
            raise InputError(f"`{key}` of a {self.kind} must be {size}, got {value!r}.")
        object.__setattr__(self, key, _tuples(numbers.tolist()))

    def _keep_lengths(self, key: str, shape: tuple[int, ...]) -> None:
        """As _keep, for positive lengths."""
        self._keep(key, shape)
        if np.min(getattr(self, key)) <= 0:
            raise InputError(
                f"`{key}` of a {self.kind} must be positive, in metres, got {getattr(self, key)!r}."
            )


@check_arguments_except("position", "radius")
@dataclass(frozen=True)
class Sphere(Obstacle):
    """A ball.

    position: of its center, shape (3,), in [m]. radius: in [m].
    Raises InputError for other shapes, and a radius that is not positive.
    """

    position: npt.ArrayLike
    radius: float

    def __post_init__(self) -> None:
        self._keep("position", (3,))
        self._keep_lengths("radius", ())

    def shape(self) -> coal.CollisionGeometry:
        """A sphere about its center."""
        return coal.Sphere(self.radius)

    def placement(self) -> pin.SE3:
        """At its center."""
        return pin.SE3(np.eye(3), np.asarray(self.position))


@check_arguments_except("ends", "radius")
@dataclass(frozen=True)
class Capsule(Obstacle):
    """Everything within a radius of a line segment.

    ends: of the segment, shape (2, 3), in [m]. radius: in [m].
    Raises InputError for other shapes, ends that coincide, and a radius that is not positive.
    """

    ends: npt.ArrayLike
    radius: float

    def __post_init__(self) -> None:
        self._keep("ends", (2, 3))
        self._keep_lengths("radius", ())
        if self._length <= 1e-9:
            raise InputError("the ends of a capsule coincide; use a sphere instead.")

    @property
    def _length(self) -> float:
        first, last = np.asarray(self.ends, dtype=np.float64)
        return float(np.linalg.norm(last - first))

    def shape(self) -> coal.CollisionGeometry:
        """The capsule along z about its middle."""
        return coal.Capsule(self.radius, self._length)

    def placement(self) -> pin.SE3:
        """In the middle of the segment, z along it."""
        first, last = np.asarray(self.ends, dtype=np.float64)
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), last - first)
        return pin.SE3(turn.matrix(), 0.5 * (first + last))


@check_arguments_except("size", "position", "rpy")
@dataclass(frozen=True)
class Box(Obstacle):
    """A cuboid.

    size: lengths of its edges, shape (3,), in [m]. position: of its center, shape (3,), in [m].
    rpy: roll, pitch and yaw about the world's axes, as in a URDF, shape (3,), in [rad].
    Raises InputError for other shapes, and edges that are not positive.
    """

    size: npt.ArrayLike
    position: npt.ArrayLike
    rpy: npt.ArrayLike = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        self._keep_lengths("size", (3,))
        self._keep("position", (3,))
        self._keep("rpy", (3,))

    def shape(self) -> coal.CollisionGeometry:
        """The box about its center."""
        return coal.Box(*np.asarray(self.size, dtype=np.float64))

    def placement(self) -> pin.SE3:
        """At its center, turned by rpy."""
        roll, pitch, yaw = np.asarray(self.rpy, dtype=np.float64)
        return pin.SE3(pin.rpy.rpyToMatrix(roll, pitch, yaw), np.asarray(self.position))


KINDS: dict[str, type[Obstacle]] = {"sphere": Sphere, "capsule": Capsule, "box": Box}
"""The obstacle classes by kind."""


def obstacle_from_dict(data: Mapping[str, Any]) -> Obstacle:
    """The inverse of `to_dict`, also for a table of a scene file. Raises InputError."""
    kind = data.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        raise InputError(f"there is no obstacle of kind {kind!r}: {nearest(str(kind), KINDS)}")
    known = {each.name: each.default is MISSING for each in fields(KINDS[kind])}
    given = {key: value for key, value in data.items() if key != "kind"}
    for key in given:
        if key not in known:
            raise InputError(f"a {kind} has no `{key}`: {nearest(str(key), known)}")
    for key, needed in known.items():
        if needed and key not in given:
            raise InputError(f"a {kind} needs `{key}`.")
    return KINDS[kind](**given)


def _tuples(value: Any) -> Any:
    return tuple(_tuples(each) for each in value) if isinstance(value, list) else value


def _plain(value: Any) -> Any:
    return [_plain(each) for each in value] if isinstance(value, tuple) else value
