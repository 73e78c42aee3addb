"""Clearance: the distance that a motion keeps from obstacles, and from the robot itself."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hovi.errors import InputError
from hovi.planning.clearance.obstacles import Obstacle, obstacle_from_dict

SCALE = 0.1
"""Length that counts as the range of a distance, in [m]."""


MARGIN = 0.01
"""Distance that is kept where nobody says otherwise, in [m]."""
MOST_OBSTACLES = 1_000


@dataclass(frozen=True, eq=False)
class Clearance:
    """Distance >= margin between the robot's collision shapes and obstacles, all along a motion.

    obstacles: what stands in the world; those without a name are numbered.
    margin: the least distance, in [m]; 0 lets them touch.
    self_collision: whether links keep the margin from each other, too: all pairs that are not
        joined by one joint, without those that the robot's SRDF disables.
    Raises InputError.
    """

    obstacles: Sequence[Obstacle] = ()
    margin: float = MARGIN
    self_collision: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.obstacles, Obstacle):
            object.__setattr__(self, "obstacles", (self.obstacles,))
        if len(self.obstacles) > MOST_OBSTACLES:
            raise InputError(f"there may be at most {MOST_OBSTACLES} obstacles.")
        for each in self.obstacles:
            if not isinstance(each, Obstacle):
                raise InputError(
                    f"an obstacle is a hovi.Sphere, hovi.Capsule or hovi.Box, not {each!r}."
                )
        named = tuple(
            each if each.name else dataclasses.replace(each, name=f"{each.kind} {number}")
            for number, each in enumerate(self.obstacles, start=1)
        )
        names = [each.name for each in named]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two obstacles are called {name!r}; give each its own name.")
        object.__setattr__(self, "obstacles", named)
        number = isinstance(self.margin, float | int) and not isinstance(self.margin, bool)
        if not (number and math.isfinite(self.margin) and self.margin >= 0):
            raise InputError(
                "the margin from obstacles is a length of 0 or more, in metres, got "
                f"{self.margin!r}."
            )

    @property
    def wanted(self) -> bool:
        """Whether there is anything to keep away from."""
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
        """The clearance that to_dict wrote. Raises InputError, KeyError or TypeError."""
        obstacles = [obstacle_from_dict(each) for each in data["obstacles"]]
        return cls(obstacles, float(data["margin"]), bool(data["self_collision"]))
