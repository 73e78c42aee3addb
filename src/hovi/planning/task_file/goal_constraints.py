"""Goals from messages moveit_msgs/Constraints: joint values, or the pose of a link."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.state import State
from hovi.errors import InputError, nearest
from hovi.planning.obstacles.yaml_poses import UNIT_TOLERANCE, pose_in, vector_in
from hovi.planning.obstacles.yaml_text import YamlMapping, YamlNode
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.robot.robot import Robot
from hovi.robot.tip_frame import is_moved
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

CONSTRAINTS = "joint_constraints", "position_constraints", "orientation_constraints"
_JOINT = "joint_name", "position", "tolerance_above", "tolerance_below", "weight"
_POSITION = "header", "link_name", "target_point_offset", "constraint_region", "weight"
_TOLERANCES = tuple(f"absolute_{axis}_axis_tolerance" for axis in "xyz")
_ORIENTATION = (
    *("header", "orientation", "link_name", "parameterization", "weight"),
    *_TOLERANCES,
)
_REGION = "primitives", "primitive_poses", "meshes", "mesh_poses"
_CENTERED = {"1": "box", "box": "box", "2": "sphere", "sphere": "sphere"}
_CENTERED |= {"3": "cylinder", "cylinder": "cylinder"}
"""Primitives whose pose is their center."""
FREE = math.pi
"""Tolerance of an angle from which on it is free, in [rad]."""
WORLD = "", "world"
"""Names of the frame in which the robot's model stands."""
FAR = 1e9
"""Largest coordinate of a position, in [m]."""
MOVED = 1e-6
"""Largest change of a joint that stays where it is, in [rad] or [m]."""


@dataclass(frozen=True, eq=False)
class Given:
    """What a goal is read for.

    robot: the robot. start: positions of its joints by name. moving: joints that the group moves.
    """

    robot: Robot
    start: dict[str, Any]
    moving: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Turned:
    """An orientation of a link.

    matrix: the link's axes in the world, (3, 3). about: its axis about which it is free, (3,).
    """

    matrix: Array
    about: Array | None

    @property
    def keys(self) -> dict[str, Any]:
        """What a frame goal says of it."""
        if self.about is None:
            return {"rotation": self.matrix}
        return {"axis": (self.about, self.matrix @ self.about)}

    def places(self, point: Array) -> bool:
        """Whether it says where a point of the link (3,) is relative to the link's origin."""
        return self.about is None or not np.any(np.cross(point, self.about))


def goal_in(node: YamlNode, given: Given) -> State | FrameGoal:
    """The goal of a message Constraints: the center of each of its regions.

    Joints of the group that joint constraints leave out are free. An orientation that may turn by
    FREE or more about one axis of the link is the direction of that axis.
    Raises SceneError with file and line, also for constraints that no goal of hovi has.
    """
    keys = node.mapping("name", *CONSTRAINTS, "visibility_constraints")
    refuse(keys, "visibility_constraints", "goals have no visibility: leave it out")
    joints, positions, orientations = (_items(keys, name) for name in CONSTRAINTS)
    if joints and (positions or orientations):
        raise node.error(
            "a goal is of joints or of a link: leave out joint_constraints, or the others"
        )
    if joints:
        return _of_joints(joints, given)
    if not positions and not orientations:
        raise node.error("the goal has no constraints: give it those of joints or of a link")
    for listed, name in ((positions, CONSTRAINTS[1]), (orientations, CONSTRAINTS[2])):
        if len(listed) > 1:
            raise listed[1].error(f"there may be one of {name}")
    return _of_link(positions, orientations, given)


def refuse(keys: YamlMapping, name: str, why: str) -> None:
    """Raise SceneError for a field that says anything: a list with items, a text or a number."""
    node = keys.get(name)
    if node is None:
        return
    scalar = not node.is_mapping and node.node.id == "scalar"
    if node.holds_items or (scalar and node.text() not in ("", "0", "0.0", "false")):
        raise node.error(f"`{name}` is not supported, as {why}")


def fixed_frame(header: YamlNode | None, robot: Robot) -> pin.SE3:
    """The pose in the world of the frame that a header names. Raises SceneError."""
    keys = None if header is None else header.mapping("seq", "stamp", "frame_id")
    named = None if keys is None else keys.get("frame_id")
    name = "" if named is None else named.text().removeprefix("/")
    if named is None or (name in WORLD and name not in robot.frame_names):
        return pin.SE3.Identity()
    if name not in robot.frame_names:
        known = nearest(name[:80], robot.frame_names).removesuffix(".")
        raise named.error(f"the robot has no frame {name[:80]!r}: {known}")
    if is_moved(robot.model, name):
        raise named.error(
            f"the frame {name!r} moves with the robot: give the goal in {robot.frame_names[1]!r} "
            "or another frame that does not"
        )
    return pin.SE3(robot.frame_pose(name, robot.neutral()))


def _items(keys: YamlMapping, name: str) -> list[YamlNode]:
    node = keys.get(name)
    return [] if node is None else node.items()


def _of_joints(listed: list[YamlNode], given: Given) -> State:
    goal, held = dict[str, Any](given.start), given.robot.source.held
    found = set[str]()
    for node in listed:
        keys = node.mapping(*_JOINT)
        named = keys.need("joint_name")
        name, value = named.text(), keys.need("position").number()
        for key in _JOINT[2:4]:
            tolerance = keys.get(key)
            if tolerance is not None and tolerance.number() < 0:
                raise tolerance.error(f"`{key}` must be 0 or more, as a goal is in its range")
        if name in found:
            raise named.error(f"joint {name!r} has two constraints: leave one of them out")
        found.add(name)
        if name in held:
            if abs(value - held[name]) > MOVED:
                raise named.error(f"joint {name!r} is locked at {held[name]:g}, the goal moves it")
        elif name not in given.robot.joint_names:
            raise named.error(
                f"the robot has no joint {name[:80]!r}: {given.robot.hint(name).removesuffix('.')}"
            )
        elif name not in given.moving and not _is(value, given.start[name]):
            raise named.error(
                f"joint {name!r} is not in the group, and the goal moves it: leave it out"
            )
        else:
            goal[name] = value
    return State(goal, free=[name for name in given.moving if name not in found])


def _is(value: float, position: Any) -> bool:
    """Whether a position, of a joint with one coordinate, is a value."""
    return bool(np.size(position) == 1 and abs(value - float(np.ravel(position)[0])) <= MOVED)


def _of_link(positions: list[YamlNode], orientations: list[YamlNode], given: Given) -> FrameGoal:
    """A goal of a position, an orientation or the direction of an axis, or of two of them."""
    link = _link([*positions, *orientations], given.robot)
    turned = _rotation(orientations[0], given.robot) if orientations else None
    keys = {} if turned is None else turned.keys
    if not positions:
        return FrameGoal(link, **keys)
    target, point = _position(positions[0], given.robot)
    if np.any(point):
        if turned is None or not turned.places(point):
            raise positions[0].error(
                "`target_point_offset` needs an orientation constraint that says where that point "
                "of the link is"
            )
        target = target - turned.matrix @ point
    return FrameGoal(link, position=target, **keys)


def _link(constraints: list[YamlNode], robot: Robot) -> str:
    """The one link that constraints are on. Raises SceneError."""
    nodes = [each.mapping(*_POSITION, *_ORIENTATION).need("link_name") for each in constraints]
    names = [node.text() for node in nodes]
    if len(set(names)) > 1:
        raise nodes[1].error(f"a goal is of one link, got {names[0][:80]!r} and {names[1][:80]!r}")
    try:
        robot.check_frame_moves(names[0])
    except InputError as wrong:
        raise nodes[0].error(str(wrong).removesuffix(".")) from None
    return names[0]


def _position(node: YamlNode, robot: Robot) -> tuple[Array, Array]:
    """The center of the region in the world, and the point of the link that goes there, (3,)."""
    keys = node.mapping(*_POSITION)
    frame = fixed_frame(keys.get("header"), robot)
    region = keys.need("constraint_region")
    parts = region.mapping(*_REGION)
    refuse(parts, "meshes", "a goal is the center of a primitive: use a sphere")
    shapes, poses = _items(parts, "primitives"), _items(parts, "primitive_poses")
    if len(shapes) != 1 or len(poses) != 1:
        raise region.error(
            f"a region must be one primitive with its pose, got {len(shapes)} and {len(poses)}"
        )
    shape = shapes[0].mapping("type", "dimensions", "polygon")
    kind = shape.need("type").text().lower()
    if kind not in _CENTERED:
        raise shape.need("type").error(
            f"`type` must be 1 or box, 2 or sphere, 3 or cylinder, got {kind[:80]!r}"
        )
    for size in shape.need("dimensions").items():
        if size.number() < 0:
            raise size.error("a dimension must be 0 or more")
    offset = keys.get("target_point_offset")
    point = np.zeros(3) if offset is None else np.array(vector_in(offset))
    center = np.array(pose_in(poses[0]).translation)
    if max(np.abs(center).max(), np.abs(point).max()) > FAR:
        raise node.error(f"positions must be within {FAR:g} m")
    return np.array(frame * center), point


def _rotation(node: YamlNode, robot: Robot) -> _Turned:
    """The orientation in the world. Raises SceneError, also if it is free about several axes.

    At the center of the region the other two angles are zero, in either parameterization, so that
    an axis about which the link is free has its direction.
    """
    keys = node.mapping(*_ORIENTATION)
    frame, turn = fixed_frame(keys.get("header"), robot), keys.need("orientation")
    x, y, z, w = vector_in(turn, "xyzw")
    length = math.hypot(x, y, z, w)
    if not abs(length - 1.0) < UNIT_TOLERANCE:
        raise turn.error(f"`orientation` must be a unit quaternion, but its length is {length:.4g}")
    free = []
    for axis, key in enumerate(_TOLERANCES):
        tolerance = keys.get(key)
        if tolerance is not None and tolerance.number() < 0:
            raise tolerance.error(f"`{key}` must be 0 or more")
        if tolerance is not None and tolerance.number() >= FREE:
            free.append(axis)
    if len(free) > 1:
        raise node.error(
            f"the orientation is free about {len(free)} axes, and may be about one: narrow the "
            "others, or leave the constraint out where it may be any"
        )
    unit = pin.Quaternion(w / length, x / length, y / length, z / length)
    return _Turned(frame.rotation @ unit.matrix(), np.eye(3)[free[0]] if free else None)
