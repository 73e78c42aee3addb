"""Distances between a robot's links and obstacles, or each other, with their derivatives in q.

Coal finds the two nearest points of two convex shapes, or where they overlap the way out that is
shortest, by GJK and EPA: d = n . (w2 - w1), with n the unit normal from the first shape to the
second, negative where they overlap. To first order the nearest points move with their shapes:
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

Array = npt.NDArray[np.float64]

EXACT = 1e-12
"""Tolerance of GJK and EPA: derivatives of curved shapes need it."""
MOST_STEPS = 1_000
"""Of GJK and EPA; polyhedra take a dozen."""

STEP = 1e-4
"""Of the differences that give second derivatives, in [rad] or [m]."""


@dataclass(frozen=True)
class Pair:
    """Two shapes whose distance counts.

    link: the robot's. other: an obstacle's name, or another link's.
    """

    link: str
    other: str
    obstacle: bool

    def __str__(self) -> str:
        """As messages call it."""
        what = "obstacle" if self.obstacle else "link"
        return f"link {self.link!r} and {what} {self.other!r}"


class Distances:
    """Signed distances of all pairs that a clearance is about.

    robot: with collision shapes; meshes count as their convex hulls. Shapes that no joint moves
        are not held against obstacles.
    pairs: which pairs, in the order of the columns of everything here.
    Raises ModelError where shapes are missing, or nothing can collide.
    """

    def __init__(self, robot: Robot, clearance: Clearance) -> None:
        self.robot = robot
        convex = convex_geometry(robot)
        geometry = convex.copy()  # whose own objects move in memory as it grows
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
            raise ModelError(f"no collision shape of robot {robot.name!r} can come near anything.")
        self.pairs = tuple(pairs)
        self.geometry = geometry
        self._data = robot.model.createData()
        self._blank = geometry.createData()
        for request in self._blank.distanceRequests:
            _sharpen(request)
        self._forget()
        self._moves = _moves(robot, geometry)
        self._sums = column_sums(robot.model) if robot.couplings else None

    def values(self, q: Array) -> Array:
        """Signed distances at configurations (P, nq), shape (P, K), in [m]."""
        self._forget()
        distances = np.empty((len(q), len(self.pairs)))
        for row, one in zip(distances, q, strict=True):
            self._measure(one)
            row[:] = [result.min_distance for result in self._results]
        return distances

    def expand(self, q: Array, reach: float = np.inf) -> tuple[Array, Array]:
        """Signed distances (P, K), in [m], and their derivatives in the tangent space, (P, K, nv).

        reach: distance beyond which derivatives are left at zero, in [m].
        """
        self._forget()
        distances = np.empty((len(q), len(self.pairs)))
        contacts = _Contacts.none(len(q), len(self.pairs), self.robot.model.nvExtended)
        for p, one in enumerate(q):
            self._measure(one)
            distances[p] = [result.min_distance for result in self._results]
            self._read(contacts, p, np.flatnonzero(distances[p] < reach))
        slopes = np.matmul(contacts.wrenches(), contacts.J) * self._moves
        return distances, slopes if self._sums is None else slopes @ self._sums

    def curvature(self, q: Array, force: Array) -> Array:
        """sum_k force_k d''_k at configurations (P, nq), shape (P, nv, nv).

        By differences of the first derivatives, since Coal has no second ones: they see how the
        nearest points slide, and a step across a kink sees its angle.
        force: shape (P, K); pairs whose force is zero are passed over.
        """
        P, nv = len(q), self.robot.nv
        pushed = np.flatnonzero(force.any(axis=1))
        if len(pushed) == 0:
            return np.zeros((P, nv, nv))
        pairs = [np.flatnonzero(row) for row in force[pushed]]
        steps = STEP * np.vstack([np.zeros(nv), np.eye(nv)])  # (1 + nv, nv)
        moved = self.robot.integrate(
            np.repeat(q[pushed], 1 + nv, axis=0), np.tile(steps, (len(pushed), 1))
        )
        self._forget()
        contacts = _Contacts.none(len(moved), len(self.pairs), self.robot.model.nvExtended)
        for i, one in enumerate(moved):
            chosen = pairs[i // (1 + nv)]
            self._place(one)
            for k in chosen:
                pin.computeDistance(self.geometry, self._places, int(k))
            self._read(contacts, i, chosen)
        pulls = np.repeat(force[pushed], 1 + nv, axis=0)[:, :, None] * self._moves
        slopes = np.einsum("pka,paj,pkj->pj", contacts.wrenches(), contacts.J, pulls)
        slopes = slopes if self._sums is None else slopes @ self._sums
        slopes = slopes.reshape(len(pushed), 1 + nv, nv)
        rows = (slopes[:, 1:] - slopes[:, :1]) / STEP
        curvature = np.zeros((P, nv, nv))
        curvature[pushed] = 0.5 * (rows + rows.transpose(0, 2, 1))
        return curvature

    def _forget(self) -> None:
        """Coal's solvers remember where they ended, which shows in the last digit."""
        self._places = self._blank.copy()
        self._results = list(self._places.distanceResults)

    def _measure(self, q: Array) -> None:
        pin.computeDistances(self.robot.model, self._data, self.geometry, self._places, q)

    def _place(self, q: Array) -> None:
        pin.updateGeometryPlacements(self.robot.model, self._data, self.geometry, self._places, q)

    def _read(self, contacts: _Contacts, p: int, pairs: npt.NDArray[np.intp]) -> None:
        """Keep the normals and nearest points of some pairs where they were measured last."""
        if len(pairs) == 0:
            return
        contacts.J[p] = pin.computeJointJacobians(self.robot.model, self._data)
        results = [self._results[k] for k in pairs]
        normals = np.array([result.normal for result in results])
        points = np.array([result.getNearestPoint1() for result in results])
        sound = np.abs(np.vecdot(normals, normals) - 1.0) < 1e-6
        for i in np.flatnonzero(~(sound & np.isfinite(points).all(axis=1))):
            normals[i], points[i] = self._between_centers(int(pairs[i]))
        contacts.normals[p, pairs], contacts.points[p, pairs] = normals, points

    def _between_centers(self, pair: int) -> tuple[Array, Array]:
        """A normal for shapes that touch in a way that has none: from center to center."""
        ends = self.geometry.collisionPairs[pair]
        first, second = (self._places.oMg[k].translation for k in (ends.first, ends.second))
        way = np.asarray(second - first)
        length = float(np.linalg.norm(way))
        n = way / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
        return n, np.asarray(first)


@dataclass(frozen=True, eq=False)
class _Contacts:
    """Normals and nearest points of the first shapes, (P, K, 3), and joint Jacobians (P, 6, nv).

    Columns for every joint, those that mimic others included.
    """

    normals: Array
    points: Array
    J: Array

    @classmethod
    def none(cls, points: int, pairs: int, nv: int) -> _Contacts:
        """Nothing yet: pairs that are not read have no derivatives."""
        zero = np.zeros((points, pairs, 3))
        return cls(zero, zero.copy(), np.zeros((points, 6, nv)))

    def wrenches(self) -> Array:
        """Unit forces along the normals through the points, (P, K, 6)."""
        n, w = self.normals, self.points
        return np.concatenate([n, np.cross(w, n)], axis=2)


@lru_cache(maxsize=16)
def distances_between(robot: Robot, clearance: Clearance) -> Distances:
    """The distances that a clearance of a robot is about, built once for both objects."""
    return Distances(robot, clearance)


def _sharpen(request: coal.DistanceRequest) -> None:
    """Exact results, whatever came before."""
    request.gjk_initial_guess = coal.GJKInitialGuess.DefaultGuess
    request.gjk_tolerance = request.epa_tolerance = EXACT
    request.gjk_max_iterations = request.epa_max_iterations = MOST_STEPS


def _moves(robot: Robot, geometry: pin.GeometryModel) -> Array:
    """Which velocities move the second shape of each pair (1), the first (-1) or both, (K, nv).

    Of every joint, those that mimic others included.
    """
    carried = np.zeros((robot.model.njoints, robot.model.nvExtended))
    for joint in range(1, robot.model.njoints):
        for support in list(robot.model.supports[joint])[1:]:
            mover = robot.model.joints[support]
            first = mover.idx_vExtended
            carried[joint, first : first + mover.nvExtended] = 1.0
    parents = [shape.parentJoint for shape in geometry.geometryObjects]
    pairs = geometry.collisionPairs
    return np.array([carried[parents[p.second]] - carried[parents[p.first]] for p in pairs])
