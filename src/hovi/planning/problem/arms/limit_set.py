"""Limit sets: the limits of common arms by name, with the sources that publish them.

A set is a TOML file in this folder. What its maker does not publish stays unlimited.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args

from hovi.checks.arguments import check_arguments
from hovi.conditions.joint_quantity import QUANTITIES
from hovi.errors import InputError, nearest
from hovi.robot.robot import Robot
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass

LimitSetName = Literal[
    "fr3",
    "gen3",
    "gen3_6dof",
    "gen3_lite",
    "j2s6s200",
    "j2s6s300",
    "j2s7s300",
    "lite6",
    "panda",
    "ur10",
    "ur10e",
    "ur16e",
    "ur3",
    "ur3e",
    "ur5",
    "ur5e",
    "xarm5",
    "xarm6",
    "xarm7",
]
NAMES: tuple[str, ...] = get_args(LimitSetName)
"""The names of all sets, which are those of the files."""

OF_ORDER_3 = ("jerk", "torque_rate")
"""Kinds that only apply to motions of order 3: with order 2 the jerk jumps."""

Pair = tuple[float, float]
FREE: Pair = (-float("inf"), float("inf"))


@dataclass(frozen=True)
class LimitSource:
    """Where limits are published.

    version: of what was read, or its date. kinds: of the limits that it confirms.
    """

    title: str
    url: str
    version: str
    kinds: tuple[str, ...]


@dataclass(frozen=True)
class LimitSet:
    """The limits of an arm as its maker publishes them.

    name: as `limits` accepts it. title: of the arm. joints: their names in the maker's URDF.
    aliases: other names of all joints. note: what the numbers mean and what they leave out.
    limits: bounds by kind ("q", "v", "a", "tau", "jerk", "torque_rate"), one pair per joint, in
        [rad], [N m] and [s]; kinds that are not published are missing.
    sources: at least one for each kind.
    """

    name: str
    title: str
    joints: tuple[str, ...]
    limits: Mapping[str, tuple[Pair, ...]]
    sources: tuple[LimitSource, ...]
    aliases: tuple[tuple[str, ...], ...] = ()
    note: str = ""

    @property
    def unpublished(self) -> tuple[str, ...]:
        """The kinds without limits."""
        return tuple(kind for kind in QUANTITIES if kind not in self.limits)

    @check_arguments
    def beyond(self, order: int) -> tuple[str, ...]:
        """The kinds of this set that do not apply to motions of a Lagrangian of this order."""
        return tuple(kind for kind in OF_ORDER_3 if kind in self.limits and order < 3)

    @check_arguments
    def on(self, coordinates: Coordinates) -> dict[str, dict[str, Pair]]:
        """Bounds on the joints of a robot that the arm has: by kind, then by joint.

        All kinds and joints are there; infinite where nothing is published, and for positions of
        continuous joints. The robot has all joints of the arm by their names, or by those of an
        alias, apart from those that are locked; it may have others.
        Raises InputError for a robot whose joints are named otherwise.
        """
        places = self._places(coordinates)
        plain = set(coordinates.space.plain[1].tolist())
        names = coordinates.coordinate_names
        found: dict[str, dict[str, Pair]] = {}
        for kind in QUANTITIES:
            pairs = self.limits.get(kind, (FREE,) * len(self.joints))
            found[kind] = {joint: pairs[i] for i, joint in places.items()}
            if kind == "q":
                found[kind] = {
                    joint: pair if names.index(joint) in plain else FREE
                    for joint, pair in found[kind].items()
                }
        return found

    def _places(self, coordinates: Coordinates) -> dict[int, str]:
        """The robot's name of each joint of the arm that it has, by its place in `joints`."""
        locked = set(coordinates.source.locked) if isinstance(coordinates, Robot) else set()
        known = set(coordinates.coordinate_names)
        for joints in (self.joints, *self.aliases):
            if known & set(joints) and set(joints) <= known | locked:
                return {i: joint for i, joint in enumerate(joints) if joint in known}
        raise InputError(
            f"limits {self.name!r} are for the joints {', '.join(self.joints)} of a {self.title}, "
            f"but {coordinates.owner} has {', '.join(coordinates.joint_names)}; choose another set "
            "or give limits by joint."
        )


def limit_sets() -> dict[str, LimitSet]:
    """All limit sets by name."""
    return {name: limit_set(name) for name in NAMES}


@cache
def limit_set(name: str) -> LimitSet:
    """The limit set of a name. Raises InputError for an unknown one."""
    if name not in NAMES:
        raise InputError(f"there are no limits of an arm {name!r}: {nearest(str(name), NAMES)}")
    path = Path(__file__).with_name(f"{name}.toml")
    return _read(name, tomllib.loads(path.read_text(encoding="utf-8")))


def is_limit_set(name: object) -> bool:
    """Whether a value is the name of a limit set."""
    return isinstance(name, str) and name in NAMES


def _read(name: str, table: dict[str, Any]) -> LimitSet:
    """A set from its file."""
    return LimitSet(
        name=name,
        title=table["title"],
        joints=tuple(table["joints"]),
        limits={kind: tuple(map(_pair, row)) for kind, row in table["limits"].items()},
        sources=tuple(
            LimitSource(**{**source, "kinds": tuple(source["kinds"])})
            for source in table["sources"]
        ),
        aliases=tuple(map(tuple, table.get("aliases", ()))),
        note=table.get("note", "").strip(),
    )


def _pair(bound: float | list[float]) -> Pair:
    """A bound as lower and upper ones: x stands for -x and x."""
    if isinstance(bound, list):
        lower, upper = bound
        return float(lower), float(upper)
    return -float(bound), float(bound)
