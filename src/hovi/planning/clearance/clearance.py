"""Clearance: the minimum distance to obstacles and between the robot's own links."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from hovi.checks.arguments import check_arguments_except
from hovi.checks.kinds import shown
from hovi.errors import InputError
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.system.dataclass import dataclass

DISTANCE_SCALE = 0.1
"""Unit in which the solver measures distances, in [m]; limits are measured by their ranges."""
DEFAULT_MARGIN = 0.01
"""Margin where none is given, in [m]."""
MAX_MARGIN = 1e9
"""Largest margin, in [m]."""
MAX_OBSTACLES = 1_000
"""Maximum number of obstacles."""
MOST_GAP = 1e-5
"""Most by which a pair that is nearer than the margin at an end may be nearer, in [m]."""
GAP_ROUNDING = 1e-6
"""Excess of given gaps over MOST_GAP that is accepted, in [m]."""
TOUCH_DEPTH = 1e-3
"""Depth by which shapes that may touch may overlap, in [m]."""


@check_arguments_except("obstacles", "margin", "may_touch", "left_out", "gaps", "during")
@dataclass(frozen=True, eq=False)
class Clearance:
    """distance >= margin between the robot's collision shapes and obstacles, all along a motion.

    obstacles: shapes in the world, or tables of them as in a scene file, such as {"kind": "box",
        ...} or {"kind": "file", "file": "kitchen.yaml"}; those without a name are numbered.
    margin: the minimum distance, in [m]; 0 allows contact.
    self_collision: whether links keep the margin from each other, too: all pairs that are not
        connected by one joint, except those that the robot's SRDF disables and those that overlap
        at every configuration.
    may_touch: pairs of names, of a link and of an obstacle or another link, that need not keep the
        margin and may overlap by TOUCH_DEPTH, such as what is grasped and what it stands on.
    left_out: pairs of names of links that are not kept apart.
    gaps: pairs of names, with by how much less than the margin they may be apart, up to MOST_GAP:
        a problem sets those of pairs that are hardly nearer than it at an end.
    during: links that are kept clear in parts of the motion alone, such as what is carried there:
        the name of the link with the times at which a part begins and ends, in [s], once for each
        part. At other times they may be anywhere.
    Raises InputError for other objects, equal names or a margin that is no length.
    """

    obstacles: Sequence[Obstacle] = ()
    margin: float = DEFAULT_MARGIN
    self_collision: bool = False
    may_touch: Sequence[tuple[str, str]] = ()
    left_out: Sequence[tuple[str, str]] = ()
    gaps: Sequence[tuple[str, str, float]] = ()
    during: Sequence[tuple[str, float, float]] = ()

    def __post_init__(self) -> None:
        if isinstance(self.obstacles, Obstacle | Mapping):
            object.__setattr__(self, "obstacles", (self.obstacles,))
        if not isinstance(self.obstacles, Sequence):
            raise InputError(
                f"obstacles must be a list, such as of hovi.Sphere, got {self.obstacles!r}."
            )
        given = [obstacle for i, x in enumerate(self.obstacles) for obstacle in _obstacles(x, i)]
        if len(given) > MAX_OBSTACLES:
            raise InputError(f"there may be at most {MAX_OBSTACLES} obstacles.")
        for each in given:
            if not isinstance(each, Obstacle):
                raise InputError(
                    f"an obstacle must be a hovi.Sphere, hovi.Box or another kind, got {each!r}."
                )
        named = tuple(
            each if each.name else dataclasses.replace(each, name=f"{each.in_words} {number}")
            for number, each in enumerate(given, start=1)
        )
        names = [each.name for each in named]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two obstacles have the name {name!r}; give each its own name.")
        object.__setattr__(self, "obstacles", named)
        for name in ("may_touch", "left_out"):
            object.__setattr__(self, name, _pairs_of_names(getattr(self, name), name))
        if not all(0.0 <= gap <= MOST_GAP + GAP_ROUNDING for *_, gap in self.gaps):
            raise InputError(
                f"gaps must be lengths from 0 to {MOST_GAP:g} m, got {self.gaps!r:.200}."
            )
        number = isinstance(self.margin, float | int) and not isinstance(self.margin, bool)
        if not (number and 0 <= self.margin <= MAX_MARGIN):
            raise InputError(
                "`margin` must be a length of 0 or more, in metres, but it is "
                f"{shown(self.margin)}."
            )

    @property
    def wanted(self) -> bool:
        """Whether there are obstacles or self-collisions to avoid."""
        return bool(self.obstacles) or self.self_collision

    def from_time(self, time: float) -> Clearance:
        """The clearance by a clock that starts at a time, in [s]: itself if nothing moves."""
        if all(each.motion is None for each in self.obstacles) and not self.during:
            return self
        paths = [each.motion for each in self.obstacles]
        later = [
            dataclasses.replace(each, path=None if path is None else path.from_time(time))
            for each, path in zip(self.obstacles, paths, strict=True)
        ]
        parts = [(name, begin - time, end - time) for name, begin, end in self.during]
        return dataclasses.replace(self, obstacles=later, during=parts)

    def to_dict(self) -> dict[str, Any]:
        """The clearance as JSON-able data."""
        return {
            "obstacles": [each.recorded().to_dict() for each in self.obstacles],
            "margin": float(self.margin),
            "self_collision": bool(self.self_collision),
            **{
                name: [list(pair) for pair in pairs]
                for name, pairs in (("may_touch", self.may_touch), ("left_out", self.left_out))
                if pairs
            },
            **({"gaps": [list(each) for each in self.gaps]} if self.gaps else {}),
            **({"during": [list(each) for each in self.during]} if self.during else {}),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Clearance:
        """The inverse of to_dict. Raises InputError for other data."""
        from hovi.planning.clearance.obstacles import obstacle_from_dict  # 10 ms

        try:
            if any("file" in each for each in data["obstacles"]):
                raise InputError("a recorded clearance names no files.")
            obstacles = [obstacle_from_dict(each) for each in data["obstacles"]]
            touching, left_out = (
                [tuple(pair) for pair in data.get(name, ())] for name in ("may_touch", "left_out")
            )
            margin, both = float(data["margin"]), bool(data["self_collision"])
            gaps = [(str(a), str(b), float(gap)) for a, b, gap in data.get("gaps", ())]
            parts = [(str(a), float(t), float(end)) for a, t, end in data.get("during", ())]
            return cls(obstacles, margin, both, touching, left_out, gaps, parts)
        except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
            raise InputError(
                f"expected the clearance that `to_dict` returns, got data with {error!r}."
            ) from error


def _obstacles(given: Any, number: int) -> Sequence[Any]:
    """What is given as an obstacle, or those of a table in the words of a scene file."""
    if not isinstance(given, Mapping):
        return (given,)
    from hovi.planning.clearance.obstacles import obstacles_from_table  # 10 ms

    return obstacles_from_table(given, number)


def _pairs_of_names(pairs: Any, field: str) -> tuple[tuple[str, str], ...]:
    """Pairs of different names. field: of a Clearance. Raises InputError for anything else."""
    if not isinstance(pairs, Sequence) or not all(_is_pair(pair) for pair in pairs):
        raise InputError(f"{field} must be a list of pairs of different names, got {pairs!r:.200}.")
    return tuple((first, second) for first, second in pairs)


def _is_pair(pair: Any) -> bool:
    """Whether something is two different names."""
    two = isinstance(pair, tuple | list) and len(pair) == 2
    return two and all(isinstance(name, str) for name in pair) and pair[0] != pair[1]
