"""Distances between the collision meshes of a robot's links, by Coal and without hovi's hulls."""

from __future__ import annotations

from itertools import combinations

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

FAR = 0.03
"""Distance of bounding balls beyond which a pair is not measured, in [m]."""


class MeshDistances:
    """Distances of all pairs of shapes on joints of which neither is the parent of the other.

    Pairs of links that the robot's SRDF disables are left out, and those named in `left_out`.
    """

    def __init__(self, robot: Robot, left_out: frozenset[frozenset[str]] = frozenset()) -> None:
        self._robot, self._geometry = robot, robot.collision.copy()
        model, shapes = robot.model, self._geometry.geometryObjects
        disabled = robot.semantics.disabled | left_out
        links = [str(model.frames[shape.parentFrame].name) for shape in shapes]
        joints = [shape.parentJoint for shape in shapes]
        parents = list(model.parents)
        self._balls = []
        for shape in shapes:
            shape.geometry.computeLocalAABB()
            center = shape.placement.act(np.array(shape.geometry.aabb_center))
            self._balls.append((center, float(shape.geometry.aabb_radius)))
        self.pairs = [
            (i, j)
            for i, j in combinations(range(len(shapes)), 2)
            if joints[i] != joints[j]
            and parents[joints[i]] != joints[j]
            and parents[joints[j]] != joints[i]
            and frozenset((links[i], links[j])) not in disabled
        ]
        self.links = links

    def least(self, q: Array) -> float:
        """The least distance at configurations (M, nq), in [m]: 0 where meshes overlap."""
        return min(self.at(each)[0] for each in q)

    def at(self, q: Array) -> tuple[float, tuple[str, str]]:
        """The least distance at a configuration, in [m], and its links; FAR or more if far."""
        model, data = self._robot.model, self._robot.model.createData()
        pin.forwardKinematics(model, data, q)
        least, links = np.inf, ("", "")
        shapes = self._geometry.geometryObjects
        for i, j in self.pairs:
            at = [data.oMi[shapes[k].parentJoint] for k in (i, j)]
            centers = [place.act(self._balls[k][0]) for place, k in zip(at, (i, j), strict=True)]
            apart = float(np.linalg.norm(centers[1] - centers[0]))
            d = apart - self._balls[i][1] - self._balls[j][1]
            if d <= FAR:
                places = [place * shapes[k].placement for place, k in zip(at, (i, j), strict=True)]
                d = _distance(*(shapes[k].geometry for k in (i, j)), *places)
            if d < least:
                least, links = d, (self.links[i], self.links[j])
        return least, links


def _distance(
    first: coal.CollisionGeometry, second: coal.CollisionGeometry, a: pin.SE3, b: pin.SE3
) -> float:
    at = [coal.Transform3s(each.rotation, each.translation) for each in (a, b)]
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    if coal.collide(first, at[0], second, at[1], request, result):
        return 0.0
    distance = coal.DistanceResult()
    coal.distance(first, at[0], second, at[1], coal.DistanceRequest(), distance)
    return float(max(distance.min_distance, 0.0))
