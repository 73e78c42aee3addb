"""Pairs of links that are too near by their convex hulls alone, not by their meshes.

A motion between such configurations cannot keep them apart by the distances of hulls, and their
meshes are no reason against it: the pairs are left out, and named.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import cached_property

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import distances_between
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

LOOKED_BEYOND = 1e-3
"""Distance beyond the margin up to which hulls are measured, in [m]."""
SAMPLES = 129
"""Number of samples of a motion at which the meshes of pairs that are left out are looked at."""


@dataclass(frozen=True)
class HullOverlap:
    """Two links that are not kept apart.

    links: their names. where: says at which configuration, as "the start". hulls, meshes: their
    distance there, in [m]; that of hulls is negative where they overlap.
    """

    links: tuple[str, str]
    where: str
    hulls: float
    meshes: float

    def __str__(self) -> str:
        """What is left out and why, as a sentence."""
        first, second = self.links
        how = "overlap" if self.hulls <= 0 else f"are {self.hulls:.3g} m apart"
        return (
            f"Links {first!r} and {second!r} are not kept apart: at {self.where} their convex "
            f"hulls {how}, while their meshes are {self.meshes:.3g} m apart."
        )


def hull_overlaps(
    robot: Robot, clearance: Clearance, q: Mapping[str, Array]
) -> tuple[HullOverlap, ...]:
    """The pairs of links that are left out of a motion through some configurations.

    Those whose hulls overlap at one of them while their meshes do not, or violate the margin while
    their meshes do not: by Coal on the shapes as they were given.
    q: configurations (nq,) by what they are, such as "the start".
    """
    apart = clearance
    if clearance.obstacles or clearance.may_touch or not clearance.self_collision:
        apart = dataclasses.replace(clearance, obstacles=(), may_touch=(), self_collision=True)
    distances, touching = distances_between(robot, apart), set(map(frozenset, clearance.may_touch))
    found = dict[tuple[str, str], HullOverlap]()
    for where, at in q.items():
        d = distances.values(at[None], apart.margin + LOOKED_BEYOND)[0]
        for k in np.flatnonzero(d < apart.margin):
            pair = distances.pairs[k]
            links = pair.link, pair.other
            if links in found or frozenset(links) in touching:
                continue
            meshes = _GivenLinks.of(robot, *links).distance(at)
            if meshes > 0 and (d[k] <= 0 or meshes >= apart.margin):
                found[links] = HullOverlap(links, where, float(d[k]), meshes)
    return tuple(found.values())


def met_sentence(motion: Trajectory, overlap: HullOverlap) -> str:
    """When a motion brings the meshes of a pair that is left out into each other; "" if never."""
    robot = motion.robot
    assert robot is not None
    t = np.linspace(0.0, motion.duration, SAMPLES)
    q = motion.configurations(t)
    links = _GivenLinks.of(robot, *overlap.links)
    for k in np.flatnonzero(_hull_distances(robot, overlap.links, q) <= 0.0):
        if links.distance(q[k]) == 0.0:
            first, second = overlap.links
            return (
                f"The motion brings {first!r} and {second!r} into each other at t = {t[k]:.3g} s."
            )
    return ""


def _hull_distances(robot: Robot, links: tuple[str, str], q: Array) -> Array:
    """Distances of two links' hulls at configurations (P, nq), in [m]; -inf if not a known pair."""
    distances = distances_between(robot, Clearance(self_collision=True))
    pairs = [frozenset((pair.link, pair.other)) for pair in distances.pairs]
    if frozenset(links) not in pairs:
        return np.full(len(q), -np.inf)
    k = pairs.index(frozenset(links))
    wanted = np.zeros((len(q), len(pairs)), dtype=bool)
    wanted[:, k] = True
    return distances.values(q, 0.0, wanted)[:, k]


@dataclass(frozen=True, eq=False)
class _GivenShape:
    """A shape of a link as it was given.

    joint: index of the one that moves it. placement: relative to that joint.
    corners: of a mesh's triangles, (M, 3, 3), in [m]; None for another shape.
    """

    joint: int
    placement: pin.SE3
    shape: coal.CollisionGeometry
    corners: Array | None

    def at(self, data: pin.Data) -> coal.Transform3s:
        """Where it is, relative to the world."""
        there = data.oMi[self.joint] * self.placement
        return coal.Transform3s(there.rotation, there.translation)

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """The least and the largest coordinates of its corners, (3,) each, in [m]."""
        assert self.corners is not None
        return self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))

    @property
    def point(self) -> Array:
        """A point of it, (3,), in [m]."""
        if self.corners is not None:
            return np.asarray(self.corners[0, 0])
        shape = self.shape
        return np.array(shape.points()[0] if isinstance(shape, coal.ConvexBase) else np.zeros(3))


@dataclass(frozen=True, eq=False)
class _GivenLinks:
    """The shapes of two links as they were given."""

    robot: Robot
    first: list[_GivenShape]
    second: list[_GivenShape]

    @classmethod
    def of(cls, robot: Robot, *links: str) -> _GivenLinks:
        """Those of a robot's links by name."""
        geometry = robot.collision
        assert geometry is not None
        found: dict[str, list[_GivenShape]] = {name: [] for name in links}
        for each in geometry.geometryObjects:
            name = str(robot.model.frames[each.parentFrame].name)
            if name in found:
                shape = each.geometry
                of_link = _GivenShape(each.parentJoint, each.placement, shape, _corners(shape))
                found[name].append(of_link)
        return cls(robot, *(found[name] for name in links))

    def distance(self, q: Array) -> float:
        """Their distance at a configuration (nq,), in [m]; 0 where they overlap."""
        data = self.robot.model.createData()
        pin.forwardKinematics(self.robot.model, data, q)
        ends = [[(each, each.at(data)) for each in link] for link in (self.first, self.second)]
        return min((_distance(*a, *b) for a in ends[0] for b in ends[1]), default=np.inf)


def _distance(
    first: _GivenShape, at: coal.Transform3s, second: _GivenShape, there: coal.Transform3s
) -> float:
    overlap, result = coal.CollisionResult(), coal.DistanceResult()
    if coal.collide(first.shape, at, second.shape, there, coal.CollisionRequest(), overlap):
        return 0.0
    if _contains(first, at, second, there) or _contains(second, there, first, at):
        return 0.0
    coal.distance(first.shape, at, second.shape, there, coal.DistanceRequest(), result)
    return float(max(result.min_distance, 0.0))


def _contains(
    mesh: _GivenShape, at: coal.Transform3s, other: _GivenShape, there: coal.Transform3s
) -> bool:
    """Whether a point of another shape is in a closed mesh, whose triangles alone Coal looks at.

    By the winding number: the solid angles of the triangles sum to 4 pi inside.
    [JacobsonKavanSorkineHornung2013]
    """
    if mesh.corners is None:
        return False
    inner = at.getRotation().T @ (
        there.getRotation() @ other.point + there.getTranslation() - at.getTranslation()
    )
    if (inner < mesh.box[0]).any() or (inner > mesh.box[1]).any():
        return False
    a, b, c = np.moveaxis(mesh.corners - inner, 1, 0)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    volume = np.vecdot(a, np.cross(b, c))
    rest = la * lb * lc + np.vecdot(a, b) * lc + np.vecdot(b, c) * la + np.vecdot(c, a) * lb
    return bool(abs(np.arctan2(volume, rest).sum()) > np.pi)


def _corners(shape: coal.CollisionGeometry) -> Array | None:
    """The corners of a mesh's triangles, (M, 3, 3), in [m]; None for another shape."""
    if not isinstance(shape, coal.BVHModelBase):
        return None
    triangles = (shape.tri_indices(k) for k in range(shape.num_tris))
    numbers = np.array([[each[0], each[1], each[2]] for each in triangles], dtype=np.intp)
    return np.asarray(np.array(shape.vertices())[numbers])
