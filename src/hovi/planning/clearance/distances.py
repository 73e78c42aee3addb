"""Distances from a robot's links to obstacles and to each other, with their derivatives in q.

Coal computes the nearest points of two convex shapes by GJK, or the penetration depth where they
overlap by EPA: d = n . (w2 - w1), with n the unit normal from the first shape to the second;
negative where they overlap. To first order the nearest points move with their shapes:
d' = n^T (J_w2 - J_w1), exact wherever the pair of points is unique.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import ModelError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.robot.mimic_model import column_sums
from hovi.robot.robot import Robot
from hovi.robot.srdf import checked_pairs
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]

GJK_TOLERANCE = 1e-12
"""Tolerance of GJK and EPA; derivatives of curved shapes need one this small."""
MAX_GJK_ITERATIONS = 1_000
"""Maximum number of iterations of GJK and EPA; polyhedra take about a dozen."""
DIFFERENCE_STEP = 1e-4
"""Step of the finite differences for second derivatives, in [rad] or [m]."""


@dataclass(frozen=True)
class Pair:
    """Two shapes whose distance is bounded.

    link: a link of the robot. other: name of an obstacle or of another link. obstacle: which of
    the two.
    """

    link: str
    other: str
    obstacle: bool

    def __str__(self) -> str:
        """The pair as messages name it."""
        what = "obstacle" if self.obstacle else "link"
        return f"link {self.link!r} and {what} {self.other!r}"


class Distances:
    """Signed distances of all pairs that a clearance bounds.

    robot: with collision shapes; meshes are replaced by their convex hulls. Shapes that no joint
        moves are not paired with obstacles.
    pairs: the K pairs, in the order of the columns of all results.
    Raises ModelError where shapes are missing, or nothing can collide.
    """

    def __init__(self, robot: Robot, clearance: Clearance) -> None:
        self.robot = robot
        convex = convex_geometry(robot)
        geometry = convex.copy()  # adding obstacles moves the geometry's own objects in memory
        shapes = list(convex.geometryObjects)
        links = [str(robot.model.frames[shape.parentFrame].name) for shape in shapes]
        pairs: list[Pair] = []
        for obstacle in clearance.obstacles:
            item = pin.GeometryObject(obstacle.name, 0, 0, obstacle.placement(), obstacle.shape())
            number = geometry.addGeometryObject(item)
            for i, shape in enumerate(shapes):
                if shape.parentJoint != 0:
                    geometry.addCollisionPair(pin.CollisionPair(i, number))
                    pairs.append(Pair(links[i], obstacle.name, True))
        if clearance.self_collision:
            for i, j in checked_pairs(robot.model, convex, robot.semantics.disabled):
                geometry.addCollisionPair(pin.CollisionPair(i, j))
                pairs.append(Pair(links[i], links[j], False))
        if not pairs:
            raise ModelError(
                f"robot {robot.name!r} has no pair of shapes that can collide: its collision "
                "shapes are fixed in the world, or its SRDF disables every pair."
            )
        self.pairs = tuple(pairs)
        self.geometry = geometry
        self._data = robot.model.createData()
        self._initial = geometry.createData()
        for request in self._initial.distanceRequests:
            _set_precision(request)
        self._reset_solvers()
        self._signs = _signs(robot, geometry)
        self._sums = column_sums(robot.model) if robot.couplings else None

    def values(self, q: Array) -> Array:
        """Signed distances at configurations (P, nq), shape (P, K), in [m]."""
        self._reset_solvers()
        distances = np.empty((len(q), len(self.pairs)))
        for row, one in zip(distances, q, strict=True):
            raise_if_late()
            self._measure(one)
            row[:] = [result.min_distance for result in self._results]
        return distances

    def expand(self, q: Array, reach: float = np.inf) -> tuple[Array, Array]:
        """Signed distances (P, K), in [m], and their derivatives in the tangent space, (P, K, nv).

        reach: distance beyond which derivatives are not computed and left at zero, in [m].
        """
        self._reset_solvers()
        distances = np.empty((len(q), len(self.pairs)))
        contacts = _Contacts.none(len(q), len(self.pairs), self.robot.model.nvExtended)
        for p, one in enumerate(q):
            raise_if_late()
            self._measure(one)
            distances[p] = [result.min_distance for result in self._results]
            self._record(contacts, p, np.flatnonzero(distances[p] < reach))
        slopes = np.matmul(contacts.wrenches(), contacts.J) * self._signs
        return distances, slopes if self._sums is None else slopes @ self._sums

    def curvature(self, q: Array, force: Array) -> Array:
        """sum_k force_k d''_k at configurations (P, nq), shape (P, nv, nv).

        By finite differences of the first derivatives, since Coal provides no second ones: they
        include the sliding of the nearest points, and a kink within a step as its change of slope.
        force: shape (P, K); pairs whose force is zero are skipped.
        """
        P, nv = len(q), self.robot.nv
        active = np.flatnonzero(force.any(axis=1))
        if len(active) == 0:
            return np.zeros((P, nv, nv))
        pairs = [np.flatnonzero(row) for row in force[active]]
        steps = DIFFERENCE_STEP * np.vstack([np.zeros(nv), np.eye(nv)])  # (1 + nv, nv)
        moved = self.robot.integrate(
            np.repeat(q[active], 1 + nv, axis=0), np.tile(steps, (len(active), 1))
        )
        self._reset_solvers()
        contacts = _Contacts.none(len(moved), len(self.pairs), self.robot.model.nvExtended)
        for i, one in enumerate(moved):
            raise_if_late()
            chosen = pairs[i // (1 + nv)]
            self._place(one)
            for k in chosen:
                pin.computeDistance(self.geometry, self._places, int(k))
            self._record(contacts, i, chosen)
        weights = np.repeat(force[active], 1 + nv, axis=0)[:, :, None] * self._signs
        slopes = np.einsum("pka,paj,pkj->pj", contacts.wrenches(), contacts.J, weights)
        slopes = slopes if self._sums is None else slopes @ self._sums
        slopes = slopes.reshape(len(active), 1 + nv, nv)
        rows = (slopes[:, 1:] - slopes[:, :1]) / DIFFERENCE_STEP
        curvature = np.zeros((P, nv, nv))
        curvature[active] = 0.5 * (rows + rows.transpose(0, 2, 1))
        return curvature

    def _reset_solvers(self) -> None:
        """Discard the warm starts of Coal's solvers, which change the last digit of results."""
        self._places = self._initial.copy()
        self._results = list(self._places.distanceResults)

    def _measure(self, q: Array) -> None:
        pin.computeDistances(self.robot.model, self._data, self.geometry, self._places, q)

    def _place(self, q: Array) -> None:
        pin.updateGeometryPlacements(self.robot.model, self._data, self.geometry, self._places, q)

    def _record(self, contacts: _Contacts, p: int, pairs: npt.NDArray[np.intp]) -> None:
        """Store Jacobian, normals and nearest points of some pairs after a distance computation."""
        if len(pairs) == 0:
            return
        contacts.J[p] = pin.computeJointJacobians(self.robot.model, self._data)
        results = [self._results[k] for k in pairs]
        normals = np.array([result.normal for result in results])
        points = np.array([result.getNearestPoint1() for result in results])
        valid = np.abs(np.vecdot(normals, normals) - 1.0) < 1e-6
        for i in np.flatnonzero(~(valid & np.isfinite(points).all(axis=1))):
            normals[i], points[i] = self._between_centers(int(pairs[i]))
        contacts.normals[p, pairs], contacts.points[p, pairs] = normals, points

    def _between_centers(self, pair: int) -> tuple[Array, Array]:
        """Normal from center to center, for contacts where Coal returns none, and a point."""
        ends = self.geometry.collisionPairs[pair]
        first, second = (self._places.oMg[k].translation for k in (ends.first, ends.second))
        offset = np.asarray(second - first)
        length = float(np.linalg.norm(offset))
        n = offset / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
        return n, np.asarray(first)


@dataclass(frozen=True, eq=False)
class _Contacts:
    """Normals and nearest points of the first shapes, (P, K, 3), and joint Jacobians (P, 6, nv).

    The Jacobians have columns for every joint, mimic joints included.
    """

    normals: Array
    points: Array
    J: Array

    @classmethod
    def none(cls, points: int, pairs: int, nv: int) -> _Contacts:
        """All zero: pairs that are not recorded have zero derivatives."""
        zero = np.zeros((points, pairs, 3))
        return cls(zero, zero.copy(), np.zeros((points, 6, nv)))

    def wrenches(self) -> Array:
        """Unit forces along the normals through the points, (P, K, 6)."""
        n, w = self.normals, self.points
        return np.concatenate([n, np.cross(w, n)], axis=2)


@lru_cache(maxsize=16)
def distances_between(robot: Robot, clearance: Clearance) -> Distances:
    """The distances that a clearance bounds for a robot, cached."""
    return Distances(robot, clearance)


def _set_precision(request: coal.DistanceRequest) -> None:
    """Tight tolerances, and an initial guess that does not depend on earlier queries."""
    request.gjk_initial_guess = coal.GJKInitialGuess.DefaultGuess
    request.gjk_tolerance = request.epa_tolerance = GJK_TOLERANCE
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
