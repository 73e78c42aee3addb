"""Distances of a robot's shapes from given ones by Coal's own calls, pair by pair."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

import hovi

Array = npt.NDArray[np.float64]
Placed = tuple[coal.CollisionGeometry, pin.SE3]


def shape_distance(first: Placed, second: Placed) -> float:
    """The signed distance of two placed shapes, in [m]."""
    ends = [coal.Transform3s(at.rotation, at.translation) for _, at in (first, second)]
    args = first[0], ends[0], second[0], ends[1], coal.DistanceRequest(), coal.DistanceResult()
    return float(coal.distance(*args))


def from_world(
    robot: hovi.Robot,
    q: Array,
    world: Callable[[int], Sequence[Placed]] | Sequence[Placed],
    geometry: pin.GeometryModel | None = None,
) -> Array:
    """Distances of every moving shape from every shape of the world, shape (P, shapes, world).

    q: configurations, shape (P, nq). world: shapes, or those at each configuration.
    geometry: of the robot; its collision shapes as they are, meshes included, by default.
    """
    shapes = robot.collision if geometry is None else geometry
    assert shapes is not None
    data, places = robot.model.createData(), shapes.createData()
    rows = []
    for p, one in enumerate(q):
        pin.updateGeometryPlacements(robot.model, data, shapes, places, one)
        others = world(p) if callable(world) else world
        rows.append(
            [
                [shape_distance((item.geometry, places.oMg[i]), other) for other in others]
                for i, item in enumerate(shapes.geometryObjects)
                if item.parentJoint != 0
            ]
        )
    return np.array(rows)
