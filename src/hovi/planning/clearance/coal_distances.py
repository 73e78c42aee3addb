"""Distances by Coal, one configuration and one pair at a time.

Coal computes the nearest points of two convex shapes by GJK, or the penetration depth where they
overlap by EPA: d = n . (w2 - w1), with n the unit normal from the first shape to the second;
negative where they overlap. To first order the nearest points move with their shapes:
d' = n^T (J_w2 - J_w1), exact wherever the pair of points is unique.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache
from typing import Any

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.planning.obstacles.hull import hull_of
from hovi.planning.obstacles.obstacle_path import pose_from_row
from hovi.robot.mimic_model import column_sums
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

GJK_TOLERANCE = 1e-12
"""Tolerance of GJK and EPA; derivatives of curved shapes need one this small."""
MAX_GJK_ITERATIONS = 1_000
"""Maximum number of iterations of GJK and EPA; polyhedra take about a dozen."""
LOOSER_TOLERANCES = 1e-8, 1e-6
"""Tolerances with which a pair is measured again where EPA fails, as for boxes that just touch."""
FAILED = 1e100
"""Depth of an overlap in [m] that only a failed computation has."""
UNIT_LENGTH = 1e-6
"""Deviation of a normal's squared length from 1 from which it is none."""
SAME_CENTER = 1e-9
"""Distance of the centers of two shapes up to which they have no direction, in [m]."""
PRISM_SIDES = 180
"""Sides of the prism that replaces an overlapping cylinder: within 0.02 % of its radius."""
DIFFERENCE_STEP = 1e-4
"""Step of the finite differences for second derivatives, in [rad] or [m]."""


class CoalDistances:
    """Signed distances of some pairs of a geometry at one configuration, and their derivatives."""

    def __init__(
        self, robot: Robot, geometry: pin.GeometryModel, moving: Mapping[int, int] | None = None
    ) -> None:
        """moving: as for PairDistances."""
        self.robot = robot
        self.geometry = geometry
        self._moving = moving or {}
        self._data = robot.model.createData()
        self._initial = geometry.createData()
        for request in self._initial.distanceRequests:
            _set_precision(request)
        self._signs = _signs(robot, geometry)
        self._sums = column_sums(robot.model) if robot.couplings else None

    def reset(self) -> None:
        """Discard the warm starts of Coal's solvers, which change the last digit of results."""
        self.__dict__.pop("_places", None)
        self.__dict__.pop("_results", None)

    @cached_property
    def _places(self) -> pin.GeometryData:
        return self._initial.copy()

    @cached_property
    def _results(self) -> list[coal.DistanceResult]:
        return list(self._places.distanceResults)

    def values(self, q: Array, pairs: Index) -> Array:
        """Signed distances of pairs, by number, at a configuration (nq,), shape (k,), in [m]."""
        own, poses = q[: self.robot.nq], q[self.robot.nq :].reshape(-1, 7)
        pin.updateGeometryPlacements(self.robot.model, self._data, self.geometry, self._places, own)
        for shape, path in self._moving.items():
            at = pose_from_row(poses[path])
            self._places.oMg[shape] = at * self.geometry.geometryObjects[shape].placement
        for k in pairs:
            pin.computeDistance(self.geometry, self._places, int(k))
            d = self._results[k].min_distance
            if d < -FAILED or (d < 0.0 and k in self._with_cylinders):
                self._measure_again(int(k))
        return np.array([self._results[k].min_distance for k in pairs])

    @cached_property
    def _with_cylinders(self) -> frozenset[int]:
        shapes = [item.geometry for item in self.geometry.geometryObjects]
        ends = [(pair.first, pair.second) for pair in self.geometry.collisionPairs]
        cylinders = {i for i, shape in enumerate(shapes) if isinstance(shape, coal.Cylinder)}
        return frozenset(k for k, pair in enumerate(ends) if cylinders & set(pair))

    def _measure_again(self, pair: int) -> None:
        """Measure a pair that overlaps with prisms for cylinders, and looser if EPA fails."""
        ends = self.geometry.collisionPairs[pair]
        placed = list[Any]()
        for k in (ends.first, ends.second):
            at = self._places.oMg[k]
            shape = self.geometry.geometryObjects[k].geometry
            placed += [_prism_of(shape), coal.Transform3s(at.rotation, at.translation)]
        result = self._results[pair]
        for tolerance in (GJK_TOLERANCE, *LOOSER_TOLERANCES):
            request = coal.DistanceRequest()
            _set_precision(request, tolerance)
            result.clear()
            coal.distance(*placed, request, result)
            if result.min_distance > -FAILED:
                return

    def expand(self, q: Array, pairs: Index) -> tuple[Array, Array]:
        """Distances (k,) and their derivatives in the tangent space, (k, nv)."""
        distances = self.values(q, pairs)
        J = pin.computeJointJacobians(self.robot.model, self._data)
        slopes = (self._wrenches(pairs) @ J) * self._signs[pairs]
        return distances, slopes if self._sums is None else slopes @ self._sums

    def curvature(self, q: Array, pairs: Index, force: Array) -> Array:
        """sum_k force_k d''_k at a configuration (nq,), shape (nv, nv).

        By finite differences of the first derivatives, since Coal provides no second ones: they
        include the sliding of the nearest points, and a kink within a step as its change of slope.
        """
        steps = DIFFERENCE_STEP * np.eye(self.robot.nv)
        nq, all_q = self.robot.nq, np.repeat(q[None], len(steps), axis=0)
        moved = np.concatenate([self.robot.integrate(all_q[:, :nq], steps), all_q[:, nq:]], axis=1)
        here = force @ self.expand(q, pairs)[1]
        slopes = np.array([force @ self.expand(each, pairs)[1] for each in moved])
        rows = (slopes - here) / DIFFERENCE_STEP
        return np.asarray(0.5 * (rows + rows.T))

    def _wrenches(self, pairs: Index) -> Array:
        """Unit forces along the normals through the nearest points of the first shapes, (k, 6)."""
        results = [self._results[k] for k in pairs]
        normals = np.array([result.normal for result in results]).reshape(-1, 3)
        points = np.array([result.getNearestPoint1() for result in results]).reshape(-1, 3)
        valid = np.abs(np.vecdot(normals, normals) - 1.0) < UNIT_LENGTH
        for i in np.flatnonzero(~(valid & np.isfinite(points).all(axis=1))):
            normals[i], points[i] = self._between_centers(int(pairs[i]))
        return np.concatenate([normals, np.cross(points, normals)], axis=1)

    def _between_centers(self, pair: int) -> tuple[Array, Array]:
        """Normal from center to center, for contacts where Coal returns none, and a point."""
        ends = self.geometry.collisionPairs[pair]
        first, second = (self._places.oMg[k].translation for k in (ends.first, ends.second))
        offset = np.asarray(second - first)
        length = float(np.linalg.norm(offset))
        n = offset / length if length > SAME_CENTER else np.array([0.0, 0.0, 1.0])
        return n, np.asarray(first)


def _prism_of(shape: coal.CollisionGeometry) -> coal.CollisionGeometry:
    """The prism in a cylinder, or any other shape itself."""
    if not isinstance(shape, coal.Cylinder):
        return shape
    prism = _prism(float(shape.radius), float(shape.halfLength))
    prism.setSweptSphereRadius(shape.getSweptSphereRadius())
    return prism


@lru_cache(maxsize=256)
def _prism(radius: float, half: float) -> coal.ConvexBase:
    angles = np.linspace(0.0, 2.0 * np.pi, PRISM_SIDES, endpoint=False)
    ring = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    ends = [np.column_stack([ring, np.full(PRISM_SIDES, z)]) for z in (-half, half)]
    return hull_of(np.concatenate(ends))


def _set_precision(request: coal.DistanceRequest, tolerance: float = GJK_TOLERANCE) -> None:
    """A tolerance, and an initial guess that does not depend on earlier queries."""
    request.gjk_initial_guess = coal.GJKInitialGuess.DefaultGuess
    request.gjk_tolerance = request.epa_tolerance = tolerance
    request.gjk_max_iterations = request.epa_max_iterations = MAX_GJK_ITERATIONS


def _signs(robot: Robot, geometry: pin.GeometryModel) -> Array:
    """Per pair, 1 for velocities that move its second shape only, -1 its first only, (K, nv).

    Columns for every joint, mimic joints included.
    """
    moved_by = np.zeros((robot.model.njoints, robot.model.nvExtended))
    for joint in range(1, robot.model.njoints):
        for support in list(robot.model.supports[joint])[1:]:
            joint_model = robot.model.joints[support]
            first = joint_model.idx_vExtended
            moved_by[joint, first : first + joint_model.nvExtended] = 1.0
    parents = [shape.parentJoint for shape in geometry.geometryObjects]
    pairs = geometry.collisionPairs
    return np.array([moved_by[parents[p.second]] - moved_by[parents[p.first]] for p in pairs])
