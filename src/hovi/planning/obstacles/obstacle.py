"""What all obstacles have in common: a name, convex bodies, and how they are stored."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, field, fields
from typing import Any, NamedTuple

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.names import require_name
from hovi.checks.shapes import numbers_of
from hovi.errors import InputError, nearest
from hovi.planning.obstacles.obstacle_path import ObstaclePath
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


MAX_NUMBER = 1e9
"""Largest number of an obstacle, in [m] or [rad]."""
MIN_LENGTH = 1e-9
"""Smallest length of an obstacle, in [m]: volumes and inertias of smaller ones vanish."""
SHOWN = 200
"""Number of characters of a value that a message shows."""
GRASPED_KEYS = {
    "frame": "the name of a link of the robot",
    "mass": "a positive number of kilograms",
    "shape": "a table such as an obstacle's, or a list of them",
}
"""What a table of a grasped object must have, and what that is."""
SYNONYMS = {
    "cube": "box",
    "cuboid": "box",
    "brick": "box",
    "ball": "sphere",
    "rod": "cylinder",
    "tube": "cylinder",
    "plane": "half_space",
    "floor": "half_space",
    "ground": "half_space",
}
"""Kinds of obstacles by other words for them, for messages."""


class Body(NamedTuple):
    """One convex shape of an obstacle, and the pose of its frame."""

    shape: coal.CollisionGeometry
    placement: pin.SE3


@dataclass(frozen=True)
class Obstacle(ABC):
    """One or more convex bodies, in [m] and [rad].

    name: used in messages.
    path: along which it moves: an ObstaclePath, or a mapping of its fields. Its poses are those of
        the frame in which the obstacle is described; the world's if None.
    """

    name: str = field(default="", kw_only=True)
    path: ObstaclePath | Mapping[str, Any] | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        require_name(self.name, f"a {self.in_words}")
        object.__setattr__(self, "path", ObstaclePath.of(self.path))

    @abstractmethod
    def bodies(self) -> tuple[Body, ...]:
        """The convex bodies, placed in the world, or in the frame that moves along the path."""

    @property
    def motion(self) -> ObstaclePath | None:
        """The path."""
        return ObstaclePath.of(self.path)

    def drawn(self) -> tuple[Body, ...]:
        """The bodies as replays draw them."""
        return self.bodies()

    @property
    def kind(self) -> str:
        """The kind as files name it, such as "sphere" or "half_space"."""
        name = type(self).__name__
        return "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")

    def recorded(self) -> Obstacle:
        """The obstacle as a motion records it, which reads no file: itself by default."""
        return self

    def to_dict(self) -> dict[str, Any]:
        """The obstacle as JSON-able data, with the keys of a scene file."""
        values = {each.name: _plain(getattr(self, each.name)) for each in fields(self)}
        del values["path"]
        path = {} if self.motion is None else {"path": self.motion.to_dict()}
        return {"kind": self.kind, **values, **path}

    @property
    def in_words(self) -> str:
        """The kind as messages name it."""
        return self.kind.replace("_", " ")

    def _keep(self, key: str, shape: tuple[int | None, ...]) -> None:
        """Store a field as nested tuples of finite numbers; None stands for any length.

        Raises InputError.
        """
        value = getattr(self, key)
        try:
            numbers = numbers_of(key, value)
        except InputError:
            numbers = np.full((), np.nan)
        fits = len(numbers.shape) == len(shape) and all(
            size in (None, n) for size, n in zip(shape, numbers.shape, strict=True)
        )
        if not fits or not (np.abs(numbers) <= MAX_NUMBER).all():
            lengths = " x ".join("any number of" if n is None else str(n) for n in shape)
            size = f"{lengths} finite numbers" if shape else "a number"
            most = f" up to {MAX_NUMBER:g}" if np.isfinite(numbers).all() and fits else ""
            raise InputError(
                f"`{key}` of a {self.in_words} must be {size}{most}, got {_short(value)}."
            )
        object.__setattr__(self, key, _tuples(numbers.tolist()))

    def _keep_lengths(self, key: str, shape: tuple[int, ...]) -> None:
        """As _keep, for positive lengths."""
        self._keep(key, shape)
        least = np.min(getattr(self, key))
        if least < MIN_LENGTH:
            much = "positive" if least <= 0.0 else f"at least {MIN_LENGTH:g}"
            raise InputError(
                f"`{key}` of a {self.in_words} must be {much}, in metres, got "
                f"{getattr(self, key)!r}."
            )


def obstacle_of_kind(
    table: Mapping[str, Any], kinds: Mapping[str, type[Obstacle]], *others: str
) -> Obstacle:
    """The obstacle of a table with its `kind` and the fields of that class. Raises InputError.

    others: kinds that exist elsewhere, for the message.
    """
    kind = table.get("kind")
    if kind is None:
        raise InputError(f"an obstacle needs `kind`: {nearest('', [*kinds, *others])}")
    if not isinstance(kind, str) or kind not in kinds:
        likely = SYNONYMS.get(str(kind).lower(), str(kind))
        raise InputError(
            f"there is no obstacle of kind {kind!r}: {nearest(likely, [*kinds, *others])}"
        )
    words = kind.replace("_", " ")
    known = {each.name: each.default is MISSING for each in fields(kinds[kind])}
    given = {key: value for key, value in table.items() if key != "kind"}
    for key in given:
        if key not in known:
            raise InputError(f"a {words} has no `{key}`: {nearest(str(key), known)}")
    for key, needed in known.items():
        if needed and key not in given:
            raise InputError(f"a {words} needs `{key}`.")
    return kinds[kind](**given)


def pose_of(position: npt.ArrayLike, rpy: npt.ArrayLike) -> pin.SE3:
    """The pose at a position (3,), turned by roll, pitch and yaw (3,) as in a URDF."""
    roll, pitch, yaw = np.asarray(rpy, dtype=np.float64)
    return pin.SE3(pin.rpy.rpyToMatrix(roll, pitch, yaw), np.asarray(position, dtype=np.float64))


def turned_to(direction: Array) -> Array:
    """A rotation (3, 3) that turns the z axis to a direction (3,)."""
    return np.asarray(pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), direction).matrix())


def _short(value: object) -> str:
    words = " ".join(repr(value).split())
    return words if len(words) <= SHOWN else f"{words[:SHOWN]}..."


def _tuples(value: Any) -> Any:
    return tuple(_tuples(each) for each in value) if isinstance(value, list) else value


def _plain(value: Any) -> Any:
    return [_plain(each) for each in value] if isinstance(value, tuple) else value
