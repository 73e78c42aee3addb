"""Obstacles from a URDF: its collision shapes at a configuration."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin

from hovi.errors import InputError, ModelError
from hovi.planning.obstacles.mesh import Mesh
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.planning.obstacles.primitives import Box, Cylinder, Sphere
from hovi.robot.formats.recognized import require_untrusted
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.robot.urdf.check import checked_urdf


def obstacles_of_urdf(
    path: Path,
    frame: pin.SE3,
    joints: Mapping[str, float],
    package_dirs: Iterable[str | Path],
    convex_parts: bool,
) -> list[Obstacle]:
    """The collision shapes of a URDF, named after their links.

    frame: pose of its root link. joints: positions by name; the others are at their neutral one.
    Raises ModelError for an invalid URDF, and InputError for one without usable shapes.
    """
    require_untrusted(path)
    model = load_robot(path, package_dirs=package_dirs, locked=dict(joints))
    geometry = model.collision
    if model.collision_problem or geometry is None or not geometry.ngeoms:
        raise InputError(
            model.collision_problem
            or f"{path.name!r} has no collision shapes that could be obstacles: add <collision> "
            "elements to its links."
        )
    named = len(checked_urdf(model.source.urdf or "", path.name).findall("link/collision"))
    if geometry.ngeoms != named:
        raise InputError(
            f"{path.name!r} has {named} collision shapes, of which only {geometry.ngeoms} can be "
            "read: a capsule has to be a cylinder and two spheres."
        )
    data, places = model.model.createData(), geometry.createData()
    q = pin.neutral(model.model)
    pin.updateGeometryPlacements(model.model, data, geometry, places, q)
    names = _names(model, geometry)
    return [
        _obstacle(item, frame * place, name, convex_parts)
        for item, place, name in zip(geometry.geometryObjects, places.oMg, names, strict=True)
    ]


def _names(robot: Robot, geometry: pin.GeometryModel) -> list[str]:
    """The name of each shape's link, numbered from its second shape on."""
    names = list[str]()
    links = [str(robot.model.frames[each.parentFrame].name) for each in geometry.geometryObjects]
    for k, link in enumerate(links):
        number = links[: k + 1].count(link)
        names.append(link if number == 1 else f"{link} {number}")
    return names


def _obstacle(item: pin.GeometryObject, place: pin.SE3, name: str, convex_parts: bool) -> Obstacle:
    shape, at = item.geometry, np.array(place.translation)
    rpy = np.array(pin.rpy.matrixToRpy(place.rotation))
    if isinstance(shape, coal.Box):
        return Box(2.0 * np.asarray(shape.halfSide), at, rpy, name=name)
    if isinstance(shape, coal.Sphere):
        return Sphere(at, float(shape.radius), name=name)
    if isinstance(shape, coal.Cylinder):
        return Cylinder(float(shape.radius), 2.0 * float(shape.halfLength), at, rpy, name=name)
    if isinstance(shape, coal.BVHModelBase):
        scale = np.array(item.meshScale)
        return Mesh(str(item.meshPath), at, rpy, scale, convex_parts, name=name)
    raise ModelError(f"collision shape {item.name!r} is no kind of obstacle; use a mesh or a box.")
