"""A robot's collision shapes as convex shapes: primitives unchanged, meshes by their hulls."""

from __future__ import annotations

from functools import lru_cache

import coal
import numpy as np
import pinocchio as pin

from hovi.errors import ModelError
from hovi.planning.clearance.mesh_hulls import mesh_hull
from hovi.planning.obstacles.hull import hull_of
from hovi.robot.geometry import load_shapes
from hovi.robot.robot import Robot

_CONVEX = (
    coal.Box,
    coal.Sphere,
    coal.Capsule,
    coal.Cylinder,
    coal.Cone,
    coal.Ellipsoid,
    coal.ConvexBase,
    coal.TriangleP,
)


@lru_cache(maxsize=16)
def convex_geometry(robot: Robot) -> pin.GeometryModel:
    """The collision geometry with every mesh replaced by its convex hull; treat as read-only.

    Raises ModelError for a robot without collision shapes or with missing ones, whose distances
    would be too large.
    """
    given, problem = robot.given[1], ""
    if given is None:  # hulls need no triangles, which take ten times as long to put into a tree
        shapes = load_shapes(robot.source, "collision", mesh_hull)
        given, problem = shapes.geometry, shapes.problem
    if problem:
        raise ModelError(f"distances need every collision shape: {problem}")
    if given is None or given.ngeoms == 0:
        raise ModelError(
            f"robot {robot.name!r} has no collision shapes to compute distances from: add "
            "<collision> elements to its URDF."
        )
    convex = given.copy()
    convex.removeAllCollisionPairs()
    for item in convex.geometryObjects:
        item.geometry = _convex(item, robot)
    return convex


def _convex(item: pin.GeometryObject, robot: Robot) -> coal.CollisionGeometry:
    shape = item.geometry
    if isinstance(shape, _CONVEX):
        return shape
    if isinstance(shape, coal.BVHModelBase):
        hull = hull_of(np.array(shape.vertices()))
        if hull is not None:
            return hull
    raise ModelError(
        f"collision shape {item.name!r} of robot {robot.name!r} has no convex hull "
        f"({type(shape).__name__}); use a mesh with volume, or a primitive."
    )
