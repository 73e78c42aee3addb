"""The kinds of obstacles, and obstacles from tables, of files or in Python."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hovi.checks.names import as_names
from hovi.errors import HoviError, InputError, nearest
from hovi.planning.obstacles.mesh import ConvexParts, Mesh
from hovi.planning.obstacles.obstacle import Obstacle, obstacle_of_kind
from hovi.planning.obstacles.obstacle_files import load_obstacles
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


FROM_FILE = "file"
"""The kind of a table that stands for the obstacles of a file."""


def obstacle_from_dict(data: Mapping[str, Any]) -> Obstacle:
    """The inverse of `to_dict`. Raises InputError."""
    return obstacle_of_kind(data, KINDS)


def obstacles_from_table(
    table: Mapping[str, Any], number: int, folder: Path | None = None
) -> tuple[Obstacle, ...]:
    """The obstacle of a table [[obstacles]], or those of the file that it names.

    number: of the table, from 0. folder: that paths are relative to; the current one if None.
    Raises InputError, or SceneError or ModelError for the file, with the obstacle's name.
    """
    try:
        if folder is not None and isinstance(table.get("file"), str):
            table = {**table, "file": str(folder / table["file"])}
        if table.get("kind") == FROM_FILE:
            return _of_file(table, folder or Path())
        return (obstacle_of_kind(table, KINDS, FROM_FILE),)
    except HoviError as wrong:
        name = table.get("name") or f"number {number + 1}"
        raise type(wrong)(f"obstacle {name!r}: {wrong}") from None


def _of_file(table: Mapping[str, Any], folder: Path) -> tuple[Obstacle, ...]:
    """Raises HoviError for unknown keys, and as load_obstacles."""
    known = inspect.signature(load_obstacles).parameters
    given = {key: value for key, value in table.items() if key != "kind"}
    for key in given:
        if key not in known:
            raise InputError(f"obstacles of a file have no `{key}`: {nearest(str(key), known)}")
    if "file" not in given:
        raise InputError("obstacles of a file need `file`.")
    folders = as_names(given.get("package_dirs", ()))
    given["package_dirs"] = [folder / each for each in folders]
    return load_obstacles(**given)
