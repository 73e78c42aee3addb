"""Obstacles from files of other programs."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.checks.shapes import numbers_of
from hovi.errors import InputError
from hovi.planning.obstacles.obstacle import Obstacle, pose_of
from hovi.planning.obstacles.obstacle_path import ObstaclePath
from hovi.planning.obstacles.planning_scene import obstacles_of_planning_scene
from hovi.planning.obstacles.urdf_obstacles import obstacles_of_urdf

FILE_TYPES = (".urdf", ".yaml", ".yml")
"""Types of files that obstacles are read from."""
_ORIGIN = (0.0, 0.0, 0.0)


@check_arguments_except("joints", "package_dirs", "path")
def load_obstacles(
    file: str | Path,
    *,
    name: str = "",
    position: npt.ArrayLike = _ORIGIN,
    rpy: npt.ArrayLike = _ORIGIN,
    joints: Mapping[str, float] | None = None,
    package_dirs: Iterable[str | Path] = (),
    convex_parts: bool = False,
    path: ObstaclePath | Mapping[str, Any] | None = None,
) -> tuple[Obstacle, ...]:
    """The obstacles of a file: the collision shapes of a URDF, or a planning scene of MoveIt.

    file: path of a .urdf, or of a .yaml with `world: collision_objects:`. Each obstacle has the
        name of its link or its id.
    name: put before these names, with a slash.
    path: along which all of them move, as for an obstacle.
    position: of the file's root link or frame in the world, shape (3,), in [m].
    rpy: roll, pitch and yaw about the world's axes, as in a URDF, shape (3,), in [rad].
    joints: positions of a URDF's joints by name, in [rad] or [m]; 0 for the others.
    package_dirs: folders in which `package://` meshes of a URDF are looked up.
    convex_parts: whether meshes are divided into convex parts, instead of taken as their hulls.
    Raises SceneError for an invalid planning scene, ModelError for an invalid URDF, and InputError
    for other files and values.
    """
    if not isinstance(joints, Mapping | None):
        raise InputError(f"`joints` must map names of joints to positions, got {joints!r:.200}.")
    motion, source = ObstaclePath.of(path), Path(file)
    frame = pose_of(_three("position", position), _three("rpy", rpy))
    if source.suffix.lower() not in FILE_TYPES:
        raise InputError(
            f"obstacles are read from {', '.join(FILE_TYPES)} files, got {source.name[:100]!r}; a "
            "mesh is an obstacle of kind 'mesh'."
        )
    if source.suffix.lower() == ".urdf":
        found = obstacles_of_urdf(source, frame, joints or {}, package_dirs, convex_parts)
    elif joints:
        raise InputError("`joints` are those of a URDF; a planning scene has none.")
    else:
        found = obstacles_of_planning_scene(source, frame, convex_parts)
    prefix = f"{name}/" if name else ""
    return tuple(
        dataclasses.replace(each, name=f"{prefix}{each.name}", path=motion) for each in found
    )


def _three(key: str, value: npt.ArrayLike) -> npt.ArrayLike:
    return numbers_of(key, value, 3)
