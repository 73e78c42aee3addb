"""Pairs of links that are too near by their convex hulls alone, not by their meshes.

A motion between such configurations cannot keep them apart by the distances of hulls, and their
meshes are no reason against it: the pairs are left out, and named.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import Pair, distances_between
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

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
        d = distances.values(at[None], apart.margin + 1e-3)[0]
        for k in np.flatnonzero(d < apart.margin):
            pair = distances.pairs[k]
            links = pair.link, pair.other
            if links in found or frozenset(links) in touching:
                continue
            meshes = mesh_distance(robot, pair, at)
            if meshes > 0 and (d[k] <= 0 or meshes >= apart.margin):
                found[links] = HullOverlap(links, where, float(d[k]), meshes)
    return tuple(found.values())


def mesh_distance(robot: Robot, pair: Pair, q: Array) -> float:
    """Distance of the given shapes of two links at a configuration (nq,); 0 where they overlap."""
    data, geometry = robot.model.createData(), robot.collision
    assert geometry is not None
    pin.forwardKinematics(robot.model, data, q)
    frames = robot.model.frames
    placed: dict[str, list[tuple[coal.CollisionGeometry, coal.Transform3s]]] = {}
    for shape in geometry.geometryObjects:
        name = str(frames[shape.parentFrame].name)
        if name in (pair.link, pair.other):
            at = data.oMi[shape.parentJoint] * shape.placement
            transform = coal.Transform3s(at.rotation, at.translation)
            placed.setdefault(name, []).append((shape.geometry, transform))
    ends = placed.get(pair.link, []), placed.get(pair.other, [])
    return min((_distance(*a, *b) for a in ends[0] for b in ends[1]), default=np.inf)


def met_sentence(motion: Trajectory, overlap: HullOverlap) -> str:
    """When a motion brings the meshes of a pair that is left out into each other; "" if never."""
    robot = motion.robot
    assert robot is not None
    pair = Pair(*overlap.links, obstacle=False)
    t = np.linspace(0.0, motion.duration, SAMPLES)
    for at, q in zip(t, motion.configurations(t), strict=True):
        if mesh_distance(robot, pair, q) == 0.0:
            first, second = overlap.links
            return f"The motion brings {first!r} and {second!r} into each other at t = {at:.3g} s."
    return ""


def _distance(
    first: coal.CollisionGeometry,
    at: coal.Transform3s,
    second: coal.CollisionGeometry,
    there: coal.Transform3s,
) -> float:
    overlap = coal.CollisionResult()
    if _contains(first, at, second, there) or _contains(second, there, first, at):
        return 0.0
    if coal.collide(first, at, second, there, coal.CollisionRequest(), overlap):
        return 0.0
    result = coal.DistanceResult()
    coal.distance(first, at, second, there, coal.DistanceRequest(), result)
    return float(max(result.min_distance, 0.0))


def _contains(
    mesh: coal.CollisionGeometry,
    at: coal.Transform3s,
    other: coal.CollisionGeometry,
    there: coal.Transform3s,
) -> bool:
    """Whether a point of another shape is in a closed mesh, whose triangles alone Coal looks at.

    By the winding number: the solid angles of the triangles sum to 4 pi inside.
    [JacobsonKavanSorkineHornung2013]
    """
    if not isinstance(mesh, coal.BVHModelBase):
        return False
    inner = at.getRotation().T @ (there.getRotation() @ _point_of(other) + there.getTranslation())
    corners = np.array(mesh.vertices()) - (inner - at.getRotation().T @ at.getTranslation())
    a, b, c = np.moveaxis(corners[_triangles(mesh)], 1, 0)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    volume = np.vecdot(a, np.cross(b, c))
    rest = la * lb * lc + np.vecdot(a, b) * lc + np.vecdot(b, c) * la + np.vecdot(c, a) * lb
    return bool(abs(np.arctan2(volume, rest).sum()) > np.pi)


def _point_of(shape: coal.CollisionGeometry) -> Array:
    """A point of a shape, (3,), in [m]."""
    if isinstance(shape, coal.BVHModelBase):
        return np.array(shape.vertices()[0])
    return np.array(shape.points()[0] if isinstance(shape, coal.ConvexBase) else np.zeros(3))


def _triangles(mesh: coal.BVHModelBase) -> npt.NDArray[np.intp]:
    """Numbers of the vertices of every triangle, (M, 3)."""
    triangles = (mesh.tri_indices(k) for k in range(mesh.num_tris))
    return np.array([[each[0], each[1], each[2]] for each in triangles], dtype=np.intp)
