"""Objects that a frame of the robot carries: links of their own, joined to it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.arguments import check_arguments_except
from hovi.checks.kinds import shown
from hovi.checks.names import require_name
from hovi.checks.shapes import numbers_of
from hovi.checks.tables import entries_of
from hovi.effects import Payload
from hovi.errors import InputError, expect, nearest
from hovi.planning.obstacles.obstacle import GRASPED_KEYS, Obstacle, obstacle_of_kind, pose_of
from hovi.planning.obstacles.primitives import Box, Capsule, Cylinder, Sphere
from hovi.robot.model import build_model
from hovi.robot.robot import Robot
from hovi.robot.source import text_hash
from hovi.robot.urdf.added_link import AddedLink, UrdfShape, with_link
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

MAX_GRASPED = 50
"""Maximum number of objects that a robot holds."""
MAX_MASS = 1e9
"""Largest mass, in [kg]."""
_ORIGIN = (0.0, 0.0, 0.0)
_SHAPES = (Box, Sphere, Cylinder, Capsule)
_KINDS = {each.__name__.lower(): each for each in _SHAPES}


@check_arguments_except("shape", "mass", "position", "rpy", "center", "inertia", "may_touch")
@dataclass(frozen=True)
class Grasped:
    """A rigid body that moves with a link of the robot, or with the point of a tool there.

    It becomes a link of its own, so that it is kept clear of obstacles, has a frame that goals may
    name, is part of the dynamics and is drawn.

    shape: a hovi.Box, Sphere, Cylinder or Capsule in the object's frame, its table such as
        {"kind": "box", "size": ..., "position": ...}, or several of them.
    frame: the link that carries it, or a frame of `tools` there. mass: in [kg].
    name: of its link and frame.
    position: of the object's frame in that frame, shape (3,), in [m].
    rpy: roll, pitch and yaw of the object's frame in that frame, shape (3,), in [rad].
    center: its center of mass in the object's frame, shape (3,), in [m].
    inertia: (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) about that center in the object's axes, in [kg m^2].
        Both are by default those of a homogeneous body of that shape.
    may_touch: names of obstacles and links from which it need not keep the margin: it may overlap
        them by TOUCH_DEPTH, a millimetre. Links that it overlaps at every configuration are not
        kept apart from it, with a warning unless they are named here.
    Raises InputError for other values.
    """

    shape: Obstacle | Mapping[str, Any] | Sequence[Obstacle | Mapping[str, Any]]
    frame: str
    mass: float
    name: str = "grasped"
    position: npt.ArrayLike = _ORIGIN
    rpy: npt.ArrayLike = _ORIGIN
    center: npt.ArrayLike | None = None
    inertia: npt.ArrayLike | None = None
    may_touch: Sequence[str] = ()

    def __post_init__(self) -> None:
        shapes = self.shape
        if isinstance(shapes, Obstacle | Mapping):
            shapes = (shapes,)
        listed = isinstance(shapes, Sequence) and len(shapes) > 0
        if listed:
            shapes = [self._of_table(x) if isinstance(x, Mapping) else x for x in shapes]
        if not listed or not all(isinstance(each, _SHAPES) for each in shapes):
            raise InputError(
                f"`shape` of {self._what} must be a table such as an obstacle's, or in Python it "
                "must be a hovi.Box, Sphere, Cylinder or Capsule, or a list of them, got "
                f"{self.shape!r:.200}."
            )
        object.__setattr__(self, "shape", tuple(shapes))
        if not self.name:
            raise InputError("a grasped object needs a name.")
        require_name(self.name, "a grasped object")
        mass = numbers_of("mass", self.mass)
        if mass.shape or not 0.0 < mass <= MAX_MASS:
            raise InputError(
                f"the mass of {self._what} must be positive, in kg, got {_shown(mass)}."
            )
        object.__setattr__(self, "mass", float(mass))
        for key, size in (("position", 3), ("rpy", 3), ("center", 3), ("inertia", 6)):
            if getattr(self, key) is not None:
                self._keep(key, size)
        names = (self.may_touch,) if isinstance(self.may_touch, str) else self.may_touch
        if not isinstance(names, Sequence) or not all(isinstance(name, str) for name in names):
            raise InputError(f"`may_touch` of {self._what} must be a list of names, got {names!r}.")
        object.__setattr__(self, "may_touch", tuple(names))
        if self.inertia is not None and np.linalg.eigvalsh(self._tensor)[0] < 0.0:
            raise InputError(f"`inertia` of {self._what} must not have a negative principal value.")

    def _of_table(self, table: Mapping[str, Any]) -> Obstacle:
        """A shape from a table in the words of a scene file. Raises InputError."""
        try:
            return obstacle_of_kind(table, _KINDS)
        except InputError as wrong:
            raise InputError(f"`shape` of {self._what}: {wrong}") from None

    @property
    def _what(self) -> str:
        return f"grasped object {self.name!r}"

    def _keep(self, key: str, size: int) -> None:
        numbers = numbers_of(key, getattr(self, key))
        if numbers.shape != (size,) or not (np.abs(numbers) <= MAX_MASS).all():
            raise InputError(f"`{key}` of {self._what} must be {size} finite numbers.")
        object.__setattr__(self, key, tuple(numbers.tolist()))

    @property
    def shapes(self) -> tuple[Obstacle, ...]:
        """Its shapes in the object's frame."""
        return self.shape  # type: ignore[return-value]

    @property
    def body(self) -> pin.Inertia:
        """Its mass, center and inertia about it, in the object's frame."""
        even = _homogeneous(self.shapes, self.mass)
        center = even.lever if self.center is None else np.asarray(self.center, dtype=np.float64)
        if self.inertia is None:
            return pin.Inertia(self.mass, center, even.inertia)
        return pin.Inertia(self.mass, center, self._tensor)

    @property
    def _tensor(self) -> Array:
        """The inertia that is given, shape (3, 3)."""
        xx, yy, zz, xy, xz, yz = np.asarray(self.inertia, dtype=np.float64)
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    @property
    def placement(self) -> pin.SE3:
        """The pose of the object's frame in the frame that carries it."""
        return pose_of(self.position, self.rpy)

    def payload(self) -> Payload:
        """The effect of its mass on a robot that carries it without being changed."""
        body = self.placement.act(self.body)
        inertia = np.asarray(body.inertia)
        parts = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        return Payload(
            self.frame, self.mass, tuple(body.lever.tolist()), inertia=tuple(parts.tolist())
        )

    def to_dict(self) -> dict[str, Any]:
        """The object as JSON-able data, with the keys of a scene file."""
        values = {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}
        shapes = [each.to_dict() for each in self.shapes]
        lists = {key: list(x) for key, x in values.items() if isinstance(x, tuple)}
        known = {key: x for key, x in (values | lists).items() if x is not None}
        return {**known, "shape": shapes if len(shapes) > 1 else shapes[0]}


@check_arguments_except("robot", "grasped")
def holding(
    robot: Robot, grasped: Grasped | Mapping[str, Any] | Sequence[Grasped | Mapping[str, Any]]
) -> Robot:
    """A robot that holds objects: each is a link, joined to the one that carries it.

    grasped: a hovi.Grasped, a table in the words of a scene file, or a list of these. The same
        robot and objects give the same Robot.
    Raises InputError for a frame that is no link or tool, a name that exists, and a robot without
    a URDF.
    """
    expect(robot, Robot, "a robot of hovi.load_robot")
    return robot_holding(robot, as_grasped(grasped))


def as_grasped(objects: Any) -> tuple[Grasped, ...]:
    """Grasped objects as a tuple. Raises InputError for anything else, and for equal names."""
    if isinstance(objects, Grasped | Mapping):
        objects = (objects,)
    listed = isinstance(objects, Sequence)
    right = listed and all(isinstance(each, Grasped | Mapping) for each in objects)
    if not right or len(objects) > MAX_GRASPED:
        raise InputError(
            f"grasped must be a list of up to {MAX_GRASPED} hovi.Grasped, got {objects!r:.200}."
        )
    objects = [
        _from_table(each, i) if isinstance(each, Mapping) else each
        for i, each in enumerate(objects)
    ]
    names = [each.name for each in objects]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two grasped objects have the name {name!r}; give each its own name.")
    return tuple(objects)


def _shown(mass: Array) -> str:
    """A mass in a message."""
    return shown(mass) if mass.shape else f"{float(mass):g}"


def _from_table(table: Mapping[str, Any], number: int) -> Grasped:
    """An object from a table in the words of a scene file. Raises InputError."""
    keys = [each.name for each in dataclasses.fields(Grasped)]
    return Grasped(**entries_of(table, f"grasped[{number}]", keys, GRASPED_KEYS))


def scene_holding(scene: Scene, objects: tuple[Grasped, ...], massless: bool = False) -> Scene:
    """The scene with a robot that holds objects, the same one for the same objects.

    massless: whether they have shapes alone, as what is carried in a part of a motion.
    """
    return _scene_holding(scene, objects, massless) if objects else scene


@lru_cache(maxsize=16)
def _scene_holding(scene: Scene, objects: tuple[Grasped, ...], massless: bool) -> Scene:
    return dataclasses.replace(scene, robot=robot_holding(scene.robot, objects, massless))


@lru_cache(maxsize=16)
def robot_holding(robot: Robot, objects: tuple[Grasped, ...], massless: bool = False) -> Robot:
    """The robot with the links of objects: see `holding`. massless: see `scene_holding`."""
    text = robot.source.urdf
    if text is None:
        raise InputError(
            f"robot {robot.name!r} was given as a pinocchio.Model, to which no grasped object can "
            "be added; load it from a URDF."
        )
    links = [frame.name for frame in robot.model.frames if frame.type == pin.FrameType.BODY]
    tools = {each.name: each for each in robot.source.tools}
    for each in objects:
        if each.name in robot.frame_names:
            raise InputError(
                f"robot {robot.name!r} has a frame {each.name!r} already: give the grasped object "
                "another name."
            )
        link, placement = each.frame, each.placement
        while link in tools:
            link, placement = tools[link].frame, tools[link].placement * placement
        if link not in links:
            names = [*links, *tools]
            raise InputError(
                f"grasped object {each.name!r} must be held by a link or a tool of robot "
                f"{robot.name!r}, which has no {link!r}: {nearest(link, names)}"
            )
        text = with_link(text, robot.source.reference, _link(each, link, placement, massless))
    source = dataclasses.replace(robot.source, urdf=text, sha256=text_hash(text))
    return Robot(robot.name, build_model(source), source)


def _link(grasped: Grasped, parent: str, placement: pin.SE3, massless: bool) -> AddedLink:
    return AddedLink(
        name=grasped.name,
        parent=parent,
        placement=placement,
        body=None if massless else grasped.body,
        shapes=[part for each in grasped.shapes for part in _urdf_shapes(each)],
    )


def _urdf_shapes(shape: Obstacle) -> list[UrdfShape]:
    """A shape in the elements of a URDF, which has no capsules: a cylinder between two balls."""
    ((_, placement),) = shape.bodies()
    if isinstance(shape, Box):
        size = " ".join(repr(x) for x in np.asarray(shape.size).tolist())
        return [UrdfShape("box", {"size": size}, placement)]
    if isinstance(shape, Sphere):
        return [UrdfShape("sphere", {"radius": repr(shape.radius)}, placement)]
    if isinstance(shape, Cylinder):
        sizes = {"radius": repr(shape.radius), "length": repr(shape.length)}
        return [UrdfShape("cylinder", sizes, placement)]
    assert isinstance(shape, Capsule)
    ends = np.asarray(shape.ends, dtype=np.float64)
    sizes = {"radius": repr(shape.radius), "length": repr(float(np.linalg.norm(ends[1] - ends[0])))}
    balls = [
        UrdfShape("sphere", {"radius": repr(shape.radius)}, pin.SE3(np.eye(3), end)) for end in ends
    ]
    return [UrdfShape("cylinder", sizes, placement), *balls]


def _homogeneous(shapes: Sequence[Obstacle], mass: float) -> pin.Inertia:
    """The inertia of bodies of equal density, in their common frame; overlaps count twice."""
    bodies = [body for each in shapes for body in each.bodies()]
    volumes = [float(body.shape.computeVolume()) for body in bodies]
    total = pin.Inertia.Zero()
    for (shape, placement), volume in zip(bodies, volumes, strict=True):
        density = mass / sum(volumes)
        tensor = density * np.asarray(shape.computeMomentofInertiaRelatedToCOM())
        center = np.asarray(shape.computeCOM())
        total += placement.act(pin.Inertia(density * volume, center, tensor))
    return total
