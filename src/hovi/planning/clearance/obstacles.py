"""The kinds of obstacles, and obstacles from the tables of files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

from hovi.errors import InputError, nearest
from hovi.planning.obstacles.mesh import ConvexParts, Mesh
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.planning.obstacles.point_cloud import PointCloud
from hovi.planning.obstacles.primitives import (
    Box,
    Capsule,
    ConvexHull,
    Cylinder,
    HalfSpace,
    Sphere,
)

KINDS: dict[str, type[Obstacle]] = {
    "sphere": Sphere,
    "capsule": Capsule,
    "box": Box,
    "cylinder": Cylinder,
    "half_space": HalfSpace,
    "convex_hull": ConvexHull,
    "convex_parts": ConvexParts,
    "mesh": Mesh,
    "point_cloud": PointCloud,
}
"""The obstacle classes by kind."""


def obstacle_from_dict(data: Mapping[str, Any], *others: str) -> Obstacle:
    """The inverse of `to_dict`, also for a table of a scene file. Raises InputError.

    others: kinds that exist elsewhere, for the message.
    """
    kind = data.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        raise InputError(
            f"there is no obstacle of kind {kind!r}: {nearest(str(kind), [*KINDS, *others])}"
        )
    words = kind.replace("_", " ")
    known = {each.name: each.default is MISSING for each in fields(KINDS[kind])}
    given = {key: value for key, value in data.items() if key != "kind"}
    for key in given:
        if key not in known:
            raise InputError(f"a {words} has no `{key}`: {nearest(str(key), known)}")
    for key, needed in known.items():
        if needed and key not in given:
            raise InputError(f"a {words} needs `{key}`.")
    return KINDS[kind](**given)
