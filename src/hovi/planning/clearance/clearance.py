"""Clearance: the minimum distance to obstacles and between the robot's own links."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hovi.checks.arguments import check_arguments_except
from hovi.errors import InputError
from hovi.planning.clearance.obstacles import Obstacle, obstacle_from_dict

DISTANCE_SCALE = 0.1
"""Unit in which the solver measures distances, in [m]; limits are measured by their ranges."""
DEFAULT_MARGIN = 0.01
"""Margin where none is given, in [m]."""
MAX_MARGIN = 1e9
"""Largest margin, in [m]."""
MAX_OBSTACLES = 1_000
"""Maximum number of obstacles."""


@check_arguments_except("obstacles", "margin")
@dataclass(frozen=True, eq=False)
class Clearance:
    """distance >= margin between the robot's collision shapes and obstacles, all along a motion.

    obstacles: static shapes in the world; those without a name are numbered.
    margin: the minimum distance, in [m]; 0 allows contact.
    self_collision: whether links keep the margin from each other, too: all pairs that are not
        connected by one joint, except those that the robot's SRDF disables.
    Raises InputError for other objects, equal names or a margin that is no length.
    """

    obstacles: Sequence[Obstacle] = ()
    margin: float = DEFAULT_MARGIN
    self_collision: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.obstacles, Obstacle):
            object.__setattr__(self, "obstacles", (self.obstacles,))
        if not isinstance(self.obstacles, Sequence):
            raise InputError(
                f"obstacles must be a list of hovi.Sphere, hovi.Capsule or hovi.Box, got "
                f"{self.obstacles!r}."
            )
        if len(self.obstacles) > MAX_OBSTACLES:
            raise InputError(f"there may be at most {MAX_OBSTACLES} obstacles.")
        for each in self.obstacles:
            if not isinstance(each, Obstacle):
                raise InputError(
                    f"an obstacle must be a hovi.Sphere, hovi.Capsule or hovi.Box, got {each!r}."
                )
        named = tuple(
            each if each.name else dataclasses.replace(each, name=f"{each.kind} {number}")
            for number, each in enumerate(self.obstacles, start=1)
        )
        names = [each.name for each in named]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two obstacles have the name {name!r}; give each its own name.")
        object.__setattr__(self, "obstacles", named)
        number = isinstance(self.margin, float | int) and not isinstance(self.margin, bool)
        if not (number and 0 <= self.margin <= MAX_MARGIN):
            raise InputError(
                "the margin from obstacles must be a length of 0 or more, in metres, got "
                f"{self.margin!r}."
            )

    @property
    def wanted(self) -> bool:
        """Whether there are obstacles or self-collisions to avoid."""
        return bool(self.obstacles) or self.self_collision

    def to_dict(self) -> dict[str, Any]:
        """The clearance as JSON-able data."""
        return {
            "obstacles": [each.to_dict() for each in self.obstacles],
            "margin": float(self.margin),
            "self_collision": bool(self.self_collision),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Clearance:
        """The inverse of to_dict. Raises InputError for other data."""
        try:
            obstacles = [obstacle_from_dict(each) for each in data["obstacles"]]
            return cls(obstacles, float(data["margin"]), bool(data["self_collision"]))
        except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
            raise InputError(
                f"expected the clearance that `to_dict` returns, got data with {error!r}."
            ) from error
