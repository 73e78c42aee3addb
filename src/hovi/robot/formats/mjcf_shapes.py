"""The shapes of the bodies of an MJCF."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin

from hovi.errors import ModelError
from hovi.robot.formats.mjcf_assets import Meshes
from hovi.robot.formats.mjcf_bodies import Bodies, Geom
from hovi.robot.formats.mjcf_inertia import SIZES, Solid, solid_of
from hovi.robot.formats.mjcf_text import MjcfError, number, numbers
from hovi.robot.meshes.mesh_shape import bvh_of

MAX_SHAPES = 1_000
"""Largest number of shapes."""
COLLISION_GROUP = 3
"""Group from which on geoms are not drawn, as by MuJoCo's viewer."""


def shapes_of(bodies: Bodies, kind: str) -> tuple[pin.GeometryModel | None, str]:
    """The "visual" or "collision" shapes, and why there are none, or "".

    Geoms that touch nothing are visual, and those of groups that MuJoCo does not draw collide.
    """
    geometry, counts = pin.GeometryModel(), 0
    for body, geoms in bodies.geoms.items():
        for k, geom in enumerate(each for each in geoms if _is_of(each, kind)):
            counts += 1
            if counts > MAX_SHAPES:
                return None, f"it has more than {MAX_SHAPES:,} {kind} shapes, the maximum"
            try:
                item = _object(geom, f"{body}_{k}", bodies, bodies.meshes)
            except (MjcfError, ModelError) as error:
                return None, f"{kind} shapes are left out, since {str(error).removesuffix('.')}"
            if item is not None:
                geometry.addGeometryObject(item)
    return (geometry, "") if geometry.ngeoms else (None, "")


def _is_of(geom: Geom, kind: str) -> bool:
    touches = any(number(geom.given, key, geom.where, 1.0) for key in ("contype", "conaffinity"))
    if kind == "collision":
        return touches
    return not touches or number(geom.given, "group", geom.where, 0.0) < COLLISION_GROUP


def _object(geom: Geom, name: str, bodies: Bodies, meshes: Meshes) -> pin.GeometryObject | None:
    """A shape; None for a plane or a height field, which robots do not have."""
    solid = solid_of(geom.given, geom.where, bodies.compiler)
    mesh = geom.given.get("mesh", "")
    path = ""
    if solid.kind == "mesh":
        shape, path = bvh_of(meshes.read(mesh)), str(meshes.path(mesh))
    elif solid.kind in SIZES and not mesh:
        shape = _shape(solid)
    elif solid.kind in ("plane", "hfield"):
        return None
    else:
        raise MjcfError(f"{geom.where} has type {solid.kind[:40]!r}, which is not read.")
    place = geom.place.pose * solid.pose
    item = pin.GeometryObject(name, geom.place.joint, geom.place.frame, place, shape)
    item.meshPath = path
    color = numbers(geom.given, "rgba", geom.where, 4)
    if color is not None:
        item.meshColor, item.overrideMaterial = np.clip(color, 0.0, 1.0), True
    return item


def _shape(solid: Solid) -> coal.CollisionGeometry:
    size = [float(each) for each in solid.size]
    match solid.kind:
        case "sphere":
            return coal.Sphere(*size)
        case "ellipsoid":
            return coal.Ellipsoid(*size)
        case "box":
            return coal.Box(*(2.0 * each for each in size))
        case "cylinder":
            return coal.Cylinder(size[0], 2.0 * size[1])
    return coal.Capsule(size[0], 2.0 * size[1])
