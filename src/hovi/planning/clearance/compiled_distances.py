"""A robot's joints and shapes as arrays for the compiled distances.

Spheres, capsules, boxes, triangles and hulls are points with a radius; cylinders are a kind of
their own. Of other shapes, and of robots with other joints than those with fixed axes and whole
groups, only Coal knows the distances.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi._native import distances as native
from hovi.robot.mimic_model import CoordinateMap, uncoupled
from hovi.robot.robot import Robot
from hovi.robot.space.groups import SE2, SE3, SO2, SO3, Group
from hovi.robot.space.joint_kinds import kind_of
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

AXIS = 0
POINTS, CYLINDER, OTHER = range(3)
EXACT, FAR, UNKNOWN = range(3)
"""How a distance is known: to rounding, as a lower bound, or not at all."""
_GROUPS: dict[Group, int] = {SO2: 1, SE3: 2, SO3: 3, SE2: 4}
"""Numbers of the groups of joints in compiled code."""


class CompiledDistances:
    """Distances of the pairs of a geometry, for many configurations in one call.

    Points near each other should follow each other: each search begins where the one before ended.

    moving: as for PairDistances; each path is a floating joint more, whose derivatives are left
        out.
    """

    def __init__(
        self,
        robot: Robot,
        geometry: pin.GeometryModel,
        portable: bool = False,
        moving: Mapping[int, int] | None = None,
    ) -> None:
        """Raises NotImplementedError for a robot with joints that the compiled part lacks."""
        self._map = (
            CoordinateMap.of(robot.model, uncoupled(robot.model)) if robot.couplings else None
        )
        model = robot.model if self._map is None else uncoupled(robot.model)
        pairs = [(pair.first, pair.second) for pair in geometry.collisionPairs]
        self._nv = int(model.nv)
        self._nq, self._paths = int(robot.nq), len(set((moving or {}).values()))
        arguments = arguments_of(model, list(geometry.geometryObjects), pairs, moving or {})
        self._kernel = native.PairDistances(**arguments, portable=portable)

    def values(
        self,
        q: Array,
        chosen: Index,
        reach: float,
        wanted: Mask | None = None,
        rounding: Array | None = None,
        normals: Array | None = None,
    ) -> tuple[Array, Index]:
        """Distances of chosen pairs at configurations (P, nq), and how each is known, (P, k).

        reach: distance in [m], beyond which a lower bound of at least that is enough.
        wanted: which distances are, (P, k), all if None; others count as FAR at the reach.
        rounding, normals: see Distances.values.
        """
        distances = np.empty((len(q), len(chosen)))
        known = np.empty(distances.shape, dtype=np.int64)
        at = self._coordinates(q)
        self._kernel.values(at, chosen, reach, distances, known, wanted, rounding, normals)
        return distances, known

    def expand(
        self,
        q: Array,
        chosen: Index,
        reach: float,
        force: Array | None = None,
        wanted: Mask | None = None,
        rounding: Array | None = None,
        normals: Array | None = None,
    ) -> tuple[Array, Index, Array, Array]:
        """As values, with d' (P, k, nv) and the sum of force d'' (P, nv, nv), where exact.

        force: shape (P, k). wanted, rounding, normals: as for values.
        """
        P, k, nv = len(q), len(chosen), self._nv + 6 * self._paths
        distances, known = np.empty((P, k)), np.empty((P, k), dtype=np.int64)
        jacobian, curvature = np.empty((P, k, nv)), np.empty((P, nv, nv))
        self._kernel.expand(
            self._coordinates(q),
            chosen,
            reach,
            force,
            distances,
            known,
            jacobian,
            curvature,
            wanted,
            rounding,
            normals,
        )
        if self._paths:
            jacobian = np.ascontiguousarray(jacobian[:, :, : self._nv])
            curvature = np.ascontiguousarray(curvature[:, : self._nv, : self._nv])
        if self._map is None:
            return distances, known, jacobian, curvature
        G = self._map.matrix
        return distances, known, jacobian @ G, np.asarray(G.T @ curvature @ G)

    def _coordinates(self, q: Array) -> Array:
        q = np.ascontiguousarray(q, dtype=np.float64)
        if self._map is None:
            return q
        both = self._map.configurations(q[:, : self._nq]), q[:, self._nq :]
        return np.ascontiguousarray(np.concatenate(both, axis=1))


def arguments_of(
    model: pin.Model,
    shapes: Sequence[pin.GeometryObject],
    pairs: Sequence[tuple[int, int]],
    moving: Mapping[int, int] | None = None,
) -> dict[str, Any]:
    """What the compiled class is built from, for a model without mimic joints.

    moving: see CompiledDistances.
    Raises NotImplementedError for other joints than those with fixed axes and whole groups.
    """
    rows, carried = _joint_rows(model)
    first, paths = len(rows), moving or {}
    count = len(set(paths.values()))
    for k in range(count):
        at = int(model.nq) + 7 * k, int(model.nv) + 6 * k
        rows.append(_Row(-1, _GROUPS[SE3], *at, pin.SE3.Identity(), np.zeros(6)))
    joints = [carried[shape.parentJoint] for shape in shapes]
    for number, path in paths.items():
        joints[number] = first + path
    return {
        **{"nq": int(model.nq) + 7 * count, "nv": int(model.nv) + 6 * count},
        **_joint_arrays(rows),
        **_shape_arrays(shapes, joints),
        "pairs": np.array(pairs, dtype=np.int64).reshape(-1, 2),
    }


@dataclass(frozen=True, eq=False)
class _Row:
    """One joint. axis: displacement and rotation vector per unit of q, for joints with one axis."""

    parent: int
    kind: int
    coordinate: int
    column: int
    placement: pin.SE3
    axis: Array


def _joint_rows(model: pin.Model) -> tuple[list[_Row], list[int]]:
    """The joints, and the row that moves the body of each of Pinocchio's joints; -1: the world."""
    rows: list[_Row] = []
    moving = [-1]
    for index in range(1, model.njoints):
        joint = model.joints[index]
        kind = kind_of(joint)
        parent, placement = moving[model.parents[index]], model.jointPlacements[index]
        if kind.group is not None and kind.group is not SO2:
            axes, number = np.zeros((1, 6)), _GROUPS[kind.group]
        elif kind.kernel == "anywhere":
            axes, number = _axes(joint), AXIS if kind.group is None else _GROUPS[kind.group]
        else:
            raise NotImplementedError(f"{kind.label} joint {model.names[index]!r}")
        for k, axis in enumerate(axes):
            rows.append(_Row(parent, number, joint.idx_q + k, joint.idx_v + k, placement, axis))
            parent, placement = len(rows) - 1, pin.SE3.Identity()
        moving.append(parent)
    return rows, moving


def _axes(joint: pin.JointModel) -> Array:
    """One row (linear, angular) for each coordinate, shape (nv, 6), at any configuration."""
    data = joint.createData()
    joint.calc(data, np.zeros(joint.idx_q + joint.nq))
    return np.asarray(data.S, dtype=np.float64).reshape(6, -1).T


def _joint_arrays(rows: Sequence[_Row]) -> dict[str, Any]:
    integers = {
        "parents": [row.parent for row in rows],
        "kinds": [row.kind for row in rows],
        "coordinates": [row.coordinate for row in rows],
        "columns": [row.column for row in rows],
    }
    return {
        **{name: np.array(values, dtype=np.int64) for name, values in integers.items()},
        "rotations": _stacked([row.placement.rotation for row in rows], (3, 3)),
        "translations": _stacked([row.placement.translation for row in rows], (3,)),
        "axes": _stacked([row.axis for row in rows], (6,)),
    }


def _stacked(rows: Sequence[Array], shape: tuple[int, ...]) -> Array:
    return np.ascontiguousarray(np.array(rows, dtype=np.float64).reshape(-1, *shape))


@dataclass(frozen=True, eq=False)
class _Core:
    """A shape as everything within a radius of a core.

    points: that the core is the hull of, shape (M, 3). cylinder: its radius and half its length.
    sphere: center and radius of a sphere around the shape, shape (4,). neighbors: of each point on
    the hull; none where they are not known.
    """

    kind: int
    radius: float
    points: Array
    cylinder: tuple[float, float]
    sphere: Array
    neighbors: Sequence[Sequence[int]] = ()


def core_of(shape: coal.CollisionGeometry) -> _Core:
    """The core of a shape of Coal."""
    swept = float(shape.getSweptSphereRadius()) if hasattr(shape, "getSweptSphereRadius") else 0.0
    if isinstance(shape, coal.Cylinder):
        r, h = float(shape.radius), float(shape.halfLength)
        sphere = np.array([0.0, 0.0, 0.0, np.hypot(r, h) + swept])
        return _Core(CYLINDER, swept, np.zeros((0, 3)), (r, h), sphere)
    found = _points_of(shape)
    if found is None:
        shape.computeLocalAABB()
        sphere = np.append(shape.aabb_center, shape.aabb_radius + swept)
        return _Core(OTHER, swept, np.zeros((0, 3)), (0.0, 0.0), sphere)
    points, radius = found
    radius += swept
    sphere = _sphere_around(points, radius)
    return _Core(POINTS, radius, points, (0.0, 0.0), sphere, _neighbors(shape, len(points)))


def _neighbors(shape: coal.CollisionGeometry, points: int) -> list[list[int]]:
    if isinstance(shape, coal.Convex):
        return [list(shape.neighbors(i)) for i in range(points)]
    return [[] for _ in range(points)]


def _points_of(shape: coal.CollisionGeometry) -> tuple[Array, float] | None:
    """Points and radius of a shape; None for a shape of another kind."""
    if isinstance(shape, coal.Sphere):
        return np.zeros((1, 3)), float(shape.radius)
    if isinstance(shape, coal.Capsule):
        return np.outer([-1.0, 1.0], [0.0, 0.0, shape.halfLength]), float(shape.radius)
    if isinstance(shape, coal.Box):
        signs = np.stack(np.meshgrid(*3 * ([-1.0, 1.0],), indexing="ij"), axis=-1)
        return signs.reshape(8, 3) * np.asarray(shape.halfSide), 0.0
    if isinstance(shape, coal.TriangleP):
        return np.array([shape.a, shape.b, shape.c], dtype=np.float64), 0.0
    if isinstance(shape, coal.ConvexBase):
        return np.array(shape.points(), dtype=np.float64).reshape(-1, 3), 0.0
    return None


def _sphere_around(points: Array, radius: float) -> Array:
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return np.append(center, np.linalg.norm(points - center, axis=1).max() + radius)


def _shape_arrays(shapes: Sequence[pin.GeometryObject], joints: Sequence[int]) -> dict[str, Any]:
    cores = [core_of(shape.geometry) for shape in shapes]
    neighbors = [near for core in cores for near in core.neighbors]
    integers = {
        "shape_joints": list(joints),
        "shape_kinds": [core.kind for core in cores],
        "point_counts": [len(core.points) for core in cores],
        "neighbor_counts": [len(near) for near in neighbors],
        "neighbors": [point for near in neighbors for point in near],
    }
    return {
        **{name: np.array(values, dtype=np.int64) for name, values in integers.items()},
        "shape_rotations": _stacked([shape.placement.rotation for shape in shapes], (3, 3)),
        "shape_translations": _stacked([shape.placement.translation for shape in shapes], (3,)),
        "shape_sizes": _stacked([np.array([c.radius, *c.cylinder]) for c in cores], (3,)),
        "shape_spheres": _stacked([core.sphere for core in cores], (4,)),
        "points": np.concatenate([core.points for core in cores]).reshape(-1, 3),
    }
