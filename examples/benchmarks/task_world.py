"""The world of a task by Pinocchio and Coal alone, without hovi: for checks and for other planners.

Obstacles, payloads and what is grasped are built from the scene file itself, and distances are
those of the robot's meshes as they are, where hovi takes their convex hulls.
"""

from __future__ import annotations

import tomllib
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

Array = npt.NDArray[np.float64]

TOUCH_DEPTH = 1e-3
"""By which a grasped object may overlap what it may touch, in [m]."""
COARSE_SAMPLES = 33
"""Configurations at which all pairs are measured that may be near."""
OVERLAP_SAMPLES = 128
"""Random configurations; pairs that overlap at all of them cannot be kept apart."""


@dataclass(frozen=True)
class World:
    """What moves and what is in its way.

    model: with the masses that it carries. geometry: the robot's shapes, what it holds and the
    obstacles; its pairs are those to be kept apart. allowances: by which a pair may be closer than
    the margin, shape (K,), in [m].
    """

    model: pin.Model
    geometry: pin.GeometryModel
    allowances: Array
    margin: float
    gravity: float

    def name_of(self, pair: int) -> str:
        """The names of the two shapes of a pair."""
        ends, items = self.geometry.collisionPairs[pair], self.geometry.geometryObjects
        return f"{items[ends.first].name} and {items[ends.second].name}"


def read_world(scene: Path, files: Mapping[str, Any], hulls: bool = False) -> World:
    """The world of a scene file.

    files: paths of the robot's "urdf" and "srdf" (or None), and its "packages".
    hulls: whether meshes are replaced by their convex hulls, which are faster.
    """
    data = tomllib.loads(scene.read_text())
    model, geometry = _robot(data, files)
    if hulls:
        for item in geometry.geometryObjects:
            if isinstance(item.geometry, coal.BVHModelBase):
                item.geometry.buildConvexHull(True, "Qt")
                item.geometry = item.geometry.convex
    links = geometry.ngeoms
    apart = _pairs_of_links(model, geometry, files) if data.get("self_collision") else []
    touching = _grasp(model, geometry, data.get("grasped", []))
    _carry(model, data.get("effects", {}))
    moved = [i for i in range(geometry.ngeoms) if geometry.geometryObjects[i].parentJoint != 0]
    held, pairs = range(links, geometry.ngeoms), [*apart]
    if data.get("self_collision"):
        pairs += [(i, k) for k in held for i in range(links) if _are_apart(model, geometry, i, k)]
    names: dict[int, str] = {}
    for obstacle in data.get("obstacles", []):
        shape, pose = shape_of(obstacle)
        number = geometry.addGeometryObject(
            pin.GeometryObject(f"{obstacle['name']}", 0, 0, pose, shape)
        )
        names[number] = obstacle["name"]
        pairs += [(i, number) for i in moved]
    for i, j in pairs:
        geometry.addCollisionPair(pin.CollisionPair(i, j))
    margin = float(data.get("margin", 0.01))
    free = [names.get(j) in touching.get(i, ()) for i, j in pairs]
    allowances = np.where(free, margin + TOUCH_DEPTH, 0.0)
    gravity = data.get("effects", {}).get("gravity", {}).get("acceleration", 0.0)
    model.gravity.linear = np.array([0.0, 0.0, -gravity])
    return World(model, geometry, allowances, margin, float(gravity))


def shape_of(table: Mapping[str, Any]) -> tuple[coal.CollisionGeometry, pin.SE3]:
    """The shape and the pose of the table of an obstacle, or of a grasped object's shape."""
    at = np.array(table.get("position", [0.0, 0.0, 0.0]), dtype=float)
    pose = pin.SE3(pin.rpy.rpyToMatrix(np.array(table.get("rpy", [0.0, 0.0, 0.0]), float)), at)
    kind = table["kind"]
    if kind == "box":
        return coal.Box(*map(float, table["size"])), pose
    if kind == "sphere":
        return coal.Sphere(float(table["radius"])), pose
    if kind == "cylinder":
        return coal.Cylinder(float(table["radius"]), float(table["length"])), pose
    if kind == "capsule":
        first, last = np.array(table["ends"], dtype=float)
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), last - first).matrix()
        shape = coal.Capsule(float(table["radius"]), float(np.linalg.norm(last - first)))
        return shape, pin.SE3(turn, (first + last) / 2)
    raise ValueError(f"no shape of kind {kind!r}")


def least_clearance(world: World, q: Array) -> tuple[float, str]:
    """The least distance at configurations (M, nq) along a motion, in [m], and between what.

    Over all of them, but only those are measured at which a pair can be nearer than the nearest one
    so far: between two configurations no point of a shape moves further than its center and its
    radius times the change of its rotation. Allowances are added.
    """
    search = _Least(world, q)
    for k in search.nearest_first():
        search.through(k)
    return search.least, "" if search.pair < 0 else world.name_of(search.pair)


class _Least:
    """The search of `least_clearance`."""

    def __init__(self, world: World, q: Array) -> None:
        self.least, self.pair, self._world = np.inf, -1, world
        data, placed = world.model.createData(), world.geometry.createData()
        items, count = world.geometry.geometryObjects, len(q)
        self._at, self._turn = np.empty((len(items), count, 3)), np.empty((len(items), count, 3, 3))
        for i, each in enumerate(q):
            pin.updateGeometryPlacements(world.model, data, world.geometry, placed, each)
            for k, pose in enumerate(placed.oMg):
                self._at[k, i], self._turn[k, i] = pose.translation, pose.rotation
        self._middle, self._radius = np.empty_like(self._at), np.empty(len(items))
        for k, item in enumerate(items):
            item.geometry.computeLocalAABB()
            self._radius[k] = item.geometry.aabb_radius
            self._middle[k] = self._at[k] + self._turn[k] @ item.geometry.aabb_center

    def nearest_first(self) -> list[int]:
        """The pairs by how near they come at a few configurations; the nearest sets the least."""
        count = self._at.shape[1]
        some = np.unique(np.linspace(0, count - 1, COARSE_SAMPLES).astype(int))
        known = []
        for pair, ends in enumerate(self._world.geometry.collisionPairs):
            apart = self._middle[ends.first, some] - self._middle[ends.second, some]
            bound = np.linalg.norm(apart, axis=1)
            bound -= self._radius[ends.first] + self._radius[ends.second]
            nearest = float(bound.min()) + float(self._world.allowances[pair])
            if nearest < self.least:
                nearest = min(self._measured(pair, int(i)) for i in some)
            known.append(nearest)
        return [int(k) for k in np.argsort(known)]

    def through(self, pair: int) -> None:
        """Go through all configurations with one pair."""
        todo = [(0, self._at.shape[1])]
        while todo:
            first, end = todo.pop()
            middle = (first + end) // 2
            d = self._measured(pair, middle)
            near = first + np.flatnonzero(d - self._moved(pair, middle, first, end) < self.least)
            for part in (near[near < middle], near[near > middle]):
                if len(part):
                    todo.append((int(part[0]), int(part[-1]) + 1))

    def _measured(self, pair: int, i: int) -> float:
        """The distance of a pair at a configuration, which may be the least so far."""
        ends, items = self._world.geometry.collisionPairs[pair], self._world.geometry
        placed = []
        for k in (ends.first, ends.second):
            pose = coal.Transform3s(self._turn[k, i], self._at[k, i])
            placed += [items.geometryObjects[k].geometry, pose]
        found = coal.distance(*placed, coal.DistanceRequest(), coal.DistanceResult())
        d = float(found) + float(self._world.allowances[pair])
        if d < self.least:
            self.least, self.pair = d, pair
        return d

    def _moved(self, pair: int, middle: int, first: int, end: int) -> Array:
        """How far the points of both shapes are at most from where they are in the middle."""
        ends = self._world.geometry.collisionPairs[pair]
        moved = np.zeros(end - first)
        for k in (ends.first, ends.second):
            at, turn = self._middle[k, first:end], self._turn[k, first:end]
            moved += np.linalg.norm(at - self._middle[k, middle], axis=1)
            turned = np.linalg.norm(turn - self._turn[k, middle], axis=(1, 2)) / np.sqrt(2.0)
            moved += self._radius[k] * turned  # |R - R'| = sqrt(2) 2 sin(angle/2)
        return moved


def _robot(data: Mapping[str, Any], files: Mapping[str, Any]) -> tuple[Any, Any]:
    urdf, folders = str(files["urdf"]), list(files["packages"])
    model = pin.buildModelFromUrdf(urdf)
    geometry = pin.buildGeomFromUrdf(model, urdf, pin.COLLISION, package_dirs=folders)
    locked = data.get("locked", [])
    positions = locked if isinstance(locked, dict) else dict.fromkeys(locked, 0.0)
    q = pin.neutral(model)
    for name, value in positions.items():
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 1:
            q[joint.idx_q] = value
    numbers = [model.getJointId(name) for name in positions]
    return pin.buildReducedModel(model, geometry, numbers, q) if numbers else (model, geometry)


def _grasp(
    model: pin.Model, geometry: pin.GeometryModel, tables: Sequence[Mapping[str, Any]]
) -> dict[int, list[str]]:
    """Add the shapes and masses of grasped objects; what each may touch, by number of shape."""
    touching = {}
    for table in tables:
        frame = model.frames[model.getFrameId(table["frame"])]
        angles = np.array(table.get("rpy", [0.0, 0.0, 0.0]), float)
        offset = np.array(table.get("position", [0.0, 0.0, 0.0]), float)
        pose = frame.placement * pin.SE3(pin.rpy.rpyToMatrix(angles), offset)
        shape, at = shape_of(table["shape"])
        item = pin.GeometryObject(table["name"], frame.parentJoint, 0, pose * at, shape)
        touching[geometry.addGeometryObject(item)] = list(table.get("may_touch", []))
        size = table["shape"]["size"]
        body = pin.Inertia.FromBox(float(table["mass"]), *map(float, size))
        model.appendBodyToJoint(frame.parentJoint, body, pose * at)
    return touching


def _carry(model: pin.Model, effects: Mapping[str, Any]) -> None:
    """Add the mass of the effect `payload`, a point."""
    if "payload" not in effects:
        return
    table = effects["payload"]
    frame = model.frames[model.getFrameId(table["frame"])]
    center = np.array(table.get("center", [0.0, 0.0, 0.0]), dtype=float)
    body = pin.Inertia(float(table["mass"]), center, np.zeros((3, 3)))
    model.appendBodyToJoint(frame.parentJoint, body, frame.placement)


def _pairs_of_links(
    model: pin.Model, geometry: pin.GeometryModel, files: Mapping[str, Any]
) -> list[tuple[int, int]]:
    """Pairs of the robot's shapes to be kept apart.

    On joints of which neither is the other's parent, not disabled in the SRDF, and apart at one of
    many configurations.
    """
    disabled = set()
    if files.get("srdf"):
        for each in ElementTree.parse(files["srdf"]).getroot().iterfind("disable_collisions"):
            disabled.add(frozenset((each.get("link1"), each.get("link2"))))
    links = [model.frames[item.parentFrame].name for item in geometry.geometryObjects]
    pairs = [
        (i, j)
        for j in range(geometry.ngeoms)
        for i in range(j)
        if _are_apart(model, geometry, i, j) and frozenset((links[i], links[j])) not in disabled
    ]
    work = geometry.copy()
    for i, j in pairs:
        work.addCollisionPair(pin.CollisionPair(i, j))
    data, placed, random = model.createData(), work.createData(), np.random.default_rng(0)
    always = np.ones(len(pairs), dtype=bool)
    for _ in range(OVERLAP_SAMPLES):
        q = pin.integrate(model, pin.neutral(model), random.uniform(-np.pi, np.pi, model.nv))
        pin.computeCollisions(model, data, work, placed, q, False)
        always &= [bool(result.isCollision()) for result in placed.collisionResults]
        if not always.any():
            break
    return [pair for pair, overlap in zip(pairs, always, strict=True) if not overlap]


def _are_apart(model: pin.Model, geometry: pin.GeometryModel, i: int, j: int) -> bool:
    """Whether two shapes are on joints of which neither is the other's parent."""
    a, b = (geometry.geometryObjects[k].parentJoint for k in (i, j))
    return bool(a != b and model.parents[a] != b and model.parents[b] != a)
