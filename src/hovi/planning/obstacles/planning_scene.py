"""Obstacles from a planning scene of MoveIt, as YAML: `world: collision_objects: ...`."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import HoviError
from hovi.planning.obstacles.mesh import ConvexParts, parts_of
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.planning.obstacles.primitives import Box, Cylinder, Sphere
from hovi.planning.obstacles.triangle_mesh import TriangleMesh
from hovi.planning.obstacles.yaml_poses import pose_in, vector_in
from hovi.planning.obstacles.yaml_text import YamlNode, read_yaml
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

_IGNORED = (
    *("name", "robot_state", "robot_model_name", "fixed_frame_transforms", "is_diff"),
    *("allowed_collision_matrix", "link_padding", "link_scale", "object_colors"),
)
_OBJECT = (
    *("id", "header", "pose", "primitives", "primitive_poses", "meshes", "mesh_poses", "planes"),
    *("plane_poses", "operation", "type", "subframe_names", "subframe_poses"),
)
_PRIMITIVES = {"1": "box", "2": "sphere", "3": "cylinder", "4": "cone"}
_DIMENSIONS = {"box": 3, "sphere": 1, "cylinder": 2}
"""Number of lengths of each primitive."""
MAX_INDEX = 1e9
"""Largest number of a vertex."""
MAX_OBJECTS = 1_000
"""Maximum number of objects of a scene."""


@dataclass(frozen=True)
class _Placed:
    """A shape of an object: its node, its pose in the file's frame, and its name."""

    node: YamlNode
    at: pin.SE3
    name: str

    @property
    def place(self) -> tuple[Array, Array]:
        """Position and rpy."""
        return np.array(self.at.translation), np.array(pin.rpy.matrixToRpy(self.at.rotation))


def obstacles_of_planning_scene(path: Path, frame: pin.SE3, convex_parts: bool) -> list[Obstacle]:
    """The collision objects of a file, named after their ids.

    Attached objects, allowed collisions and padding are not read. frame: pose of the frame in
    which all of the objects are. Raises SceneError with file and line.
    """
    scene = read_yaml(path).mapping("world", *_IGNORED)
    world = scene.need("world").mapping("collision_objects", "octomap")
    _require_empty(world.get("octomap"))
    objects = world.need("collision_objects").items()
    if len(objects) > MAX_OBJECTS:
        raise objects[0].error(f"there may be at most {MAX_OBJECTS:,} objects")
    found, frames = list[Obstacle](), dict[str, YamlNode]()
    for node in objects:
        frames.setdefault(_frame_of(node), node)
        if len(frames) > 1:
            first, second = frames
            raise node.error(
                f"all objects must be in one frame, but there are {first!r} and {second!r}"
            )
        found += _obstacles(node, frame, convex_parts)
    return found


def _frame_of(node: YamlNode) -> str:
    header = node.mapping(*_OBJECT).get("header")
    name = None if header is None else header.mapping("frame_id", "stamp", "seq").get("frame_id")
    return "" if name is None else name.text()


def _obstacles(node: YamlNode, frame: pin.SE3, convex_parts: bool) -> Iterator[Obstacle]:
    """The obstacles of one object."""
    keys = node.mapping(*_OBJECT)
    name, operation, planes = keys.need("id").text(), keys.get("operation"), keys.get("planes")
    if operation is not None and operation.text().lower() not in ("0", "add"):
        raise operation.error("`operation` must be 0 or ADD in a scene that stands by itself")
    if planes is not None and planes.items():
        raise planes.error("planes have no inside: use an obstacle of kind 'half_space' instead")
    at = frame if keys.get("pose") is None else frame * pose_in(keys.need("pose"))
    placed = list(_placed(keys.get("primitives"), keys.get("primitive_poses"), at))
    meshes = list(_placed(keys.get("meshes"), keys.get("mesh_poses"), at))
    if not placed + meshes:
        raise node.error(f"object {name!r} has neither primitives nor meshes")
    for k, (shape, where) in enumerate(placed + meshes):
        label = name if k == 0 else f"{name} {k + 1}"
        each = _Placed(shape, where, label)
        try:
            yield _primitive(each) if k < len(placed) else _mesh(each, convex_parts)
        except HoviError as wrong:
            if str(wrong).startswith(node.where):
                raise
            raise shape.error(f"object {name!r}: {str(wrong).removesuffix('.')}") from None


def _placed(
    shapes: YamlNode | None, poses: YamlNode | None, at: pin.SE3
) -> Iterator[tuple[YamlNode, pin.SE3]]:
    """Each shape with its pose."""
    nodes = [] if shapes is None else shapes.items()
    given = [] if poses is None else poses.items()
    if len(nodes) != len(given) and shapes is not None:
        raise shapes.error(f"{len(nodes)} shapes need as many poses, got {len(given)}")
    for node, pose in zip(nodes, given, strict=True):
        yield node, at * pose_in(pose)


def _primitive(placed: _Placed) -> Obstacle:
    keys = placed.node.mapping("type", "dimensions", "polygon")
    given = keys.need("type").text().lower()
    kind = _PRIMITIVES.get(given, given)
    if kind not in _DIMENSIONS:
        raise keys.need("type").error(
            f"`type` must be 1 or box, 2 or sphere, 3 or cylinder, got {given!r}"
        )
    sizes = [each.number() for each in keys.need("dimensions").items()]
    if len(sizes) != _DIMENSIONS[kind]:
        raise keys.need("dimensions").error(
            f"a {kind} has {_DIMENSIONS[kind]} dimensions, got {len(sizes)}"
        )
    position, rpy = placed.place
    if kind == "box":
        return Box(sizes, position, rpy, name=placed.name)
    if kind == "sphere":
        return Sphere(position, sizes[0], name=placed.name)
    return Cylinder(sizes[1], sizes[0], position, rpy, name=placed.name)


def _mesh(placed: _Placed, convex_parts: bool) -> Obstacle:
    keys = placed.node.mapping("vertices", "triangles")
    vertices = np.array([vector_in(each) for each in keys.need("vertices").items()]).reshape(-1, 3)
    triangles = np.array([_corners(each) for each in keys.need("triangles").items()])
    triangles = triangles.astype(np.int64).reshape(-1, 3)
    if triangles.size and not (triangles.min() >= 0 and triangles.max() < len(vertices)):
        raise keys.need("triangles").error("`vertex_indices` must number the vertices from 0")
    digest = hashlib.sha256(vertices.tobytes() + triangles.astype("<i8").tobytes()).hexdigest()
    parts, radius = parts_of(TriangleMesh(placed.name, vertices, triangles, digest), convex_parts)
    return ConvexParts([part.tolist() for part in parts], radius, *placed.place, name=placed.name)


def _corners(node: YamlNode) -> list[float]:
    nodes = (
        node.mapping("vertex_indices").need("vertex_indices") if node.is_mapping else node
    ).items()
    numbers = [each.number() for each in nodes]
    if len(numbers) != 3 or any(x != int(x) or abs(x) > MAX_INDEX for x in numbers):
        raise node.error("a triangle must have three whole numbers")
    return numbers


def _require_empty(octomap: YamlNode | None) -> None:
    if octomap is not None and octomap.holds_items:
        raise octomap.error("octomaps are not read: use an obstacle of kind 'point_cloud'")
