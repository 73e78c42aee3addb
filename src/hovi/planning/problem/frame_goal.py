"""Task-space goals: pose, position, orientation or axis of a frame."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, fields, replace
from functools import cached_property, lru_cache
from typing import Any, TypeVar

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.arguments import check_arguments
from hovi.checks.directions import unit_vector
from hovi.checks.kinds import shown
from hovi.checks.shapes import numbers_of
from hovi.conditions.frame_rows import axis_rows, rotation_rows
from hovi.conditions.function import Curvature, Function, Points, Slopes, linear
from hovi.dynamics.point_function import PointFunction
from hovi.dynamics.symbolic_dynamics import functions_of
from hovi.errors import InputError, nearest, warn
from hovi.planning.problem.frame_velocity import FrameVelocity
from hovi.planning.problem.goal_agreement import Target, require_agreement
from hovi.planning.problem.goal_region import (
    AXES,
    Bound,
    Side,
    Within,
    angle_of,
    bounds_of,
    held,
    room_of,
)
from hovi.robot.model import frame_named
from hovi.robot.robot import Robot
from hovi.robot.space.orientation import ORIENTATIONS, rotation_from
from hovi.robot.space.tangent import Symbols, hessian, jacobian
from hovi.robot.tip_frame import moves_frame
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Owner = TypeVar("Owner")

KEPT = 8
"""Number of configurations at which the equations of a frame goal are kept."""
MAX_ANGLE_ERROR = 1e-6
"""Angle in [rad] above which a frame whose equations hold is half a turn away from its goal."""
PROBES = 3
"""Number of random configurations at which equations of goals are looked at for dependent ones."""
DEPENDENT = 1e-9
"""Length of what a row adds to those before it that counts as nothing, relative to all rows."""
_TURNS = ("rotation", *ORIENTATIONS, "axis")
"""What a frame goal says of its orientation: one of them at most."""
_OTHER_POSES = {
    (3,): "for a position alone write position=...",
    (3, 3): "for a rotation alone write rotation=...",
    (6,): "for three angles write position=..., rpy=...",
    (7,): "for a quaternion write position=..., quaternion_xyzw=... or quaternion_wxyz=...",
}
"""What to write for numbers of another shape than that of a pose."""
LEAST_LENGTH = 1e-6
"""Smallest length of an axis."""
EXACT, ROUNDED = 1e-12, 2e-3
"""Largest entries of R^T R - 1 of a rotation that is taken as it is, and of one whose entries are
rounded to three digits, for which the nearest rotation is taken."""


def _check_names(owner: type[Owner]) -> type[Owner]:
    """A decorator: names that no argument of a frame goal has raise InputError."""
    initialize: Callable[..., None] = vars(owner)["__init__"]
    names = {each.name for each in fields(owner)}  # type: ignore[arg-type]

    @functools.wraps(initialize)
    def initialized(*args: Any, **given: Any) -> None:
        for name in given:
            if name not in names:
                raise InputError(f"a frame goal has no `{name}`: {nearest(name, names)}")
        initialize(*args, **given)

    setattr(owner, "__init__", initialized)  # noqa: B010 - type checkers know no such assignment
    return owner


@check_arguments
@_check_names
@dataclass(frozen=True, eq=False)
class FrameGoal:
    """A target pose, position, orientation or axis direction of a frame of the robot.

    frame: name of the frame.
    pose: a homogeneous matrix (4, 4) or a pinocchio.SE3; sets position and rotation.
    position: of the frame's origin in the world, shape (3,), in [m].
    rotation: of the frame's axes in the world, shape (3, 3).
    rpy: the same as roll, pitch and yaw in [rad]: Rz(yaw) Ry(pitch) Rx(roll), as in a URDF.
    quaternion_xyzw, quaternion_wxyz: the same as a unit quaternion, in that order.
    axis: (direction in the frame, direction in the world), two vectors of shape (3,); or
        {"frame": direction, "world": direction}.
    free_velocity: joints whose velocity at the goal is free, by name or ALL; the others are at
        rest.
    guess: configuration (nq,) from which inverse kinematics starts.
    within: the region around `position` in which the frame may end, wherever the motion costs
        least: the radius of a ball, in [m] or as a text such as "10 mm"; or half of the three edges
        of a box, along the axes of the world, 0 where the position is exact.
    within_angle: the largest angle from the rotation or the axis, in [rad] or as "5 deg".
    box_frame: the frame along whose axes the box is; the world by default.
    velocity: of the frame's origin at the goal, along the axes of the world, shape (3,), in [m/s];
        the joints that move the frame are free to have any velocity with it. At rest by default.
    angular_velocity: of its turn, likewise, shape (3,), in [rad/s].
    also: goals of other frames that are reached at the same time, as in a list of goals.
    sides: where the bounds of the region are held, as a plan finds them; at the middle by default.
    Whatever was given, `position`, `rotation` and `axis` hold the goal.
    Raises InputError for a matrix that is no rotation, an axis or a quaternion without length, an
    argument of another name, or an empty goal.
    """

    frame: str
    pose: Any = None
    position: npt.ArrayLike | None = None
    rotation: npt.ArrayLike | None = None
    axis: tuple[npt.ArrayLike, npt.ArrayLike] | Mapping[str, npt.ArrayLike] | None = None
    rpy: npt.ArrayLike | None = field(default=None, kw_only=True)
    quaternion_xyzw: npt.ArrayLike | None = field(default=None, kw_only=True)
    quaternion_wxyz: npt.ArrayLike | None = field(default=None, kw_only=True)
    free_velocity: Sequence[str] = field(default=(), kw_only=True)
    guess: npt.ArrayLike | None = field(default=None, kw_only=True)
    within: Within | None = field(default=None, kw_only=True)
    within_angle: float | str | None = field(default=None, kw_only=True)
    box_frame: str | None = field(default=None, kw_only=True)
    velocity: npt.ArrayLike | None = field(default=None, kw_only=True)
    angular_velocity: npt.ArrayLike | None = field(default=None, kw_only=True)
    also: Sequence[FrameGoal] = field(default=(), kw_only=True)
    sides: Sequence[Side] = field(default=(), kw_only=True, repr=False)

    def __post_init__(self) -> None:
        turned = [name for name in _TURNS if getattr(self, name) is not None]
        if len(turned) > 1:
            raise InputError(
                f"a frame goal takes a rotation or an axis, not both: leave out {turned[0]} or "
                f"{turned[1]}."
            )
        if self.pose is not None:
            if self.position is not None or turned:
                raise InputError(
                    "a frame goal takes a pose, or a position with a rotation or an axis, not both."
                )
            matrix = _numbers("pose", getattr(self.pose, "homogeneous", self.pose))
            if matrix.shape != (4, 4):
                hint = _OTHER_POSES.get(matrix.shape)
                raise InputError(
                    f"a pose must be a matrix of shape (4, 4), got {matrix.shape}"
                    + (f"; {hint}" if hint else ".")
                )
            if not np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]):
                raise InputError(f"the last row of a pose must be 0, 0, 0, 1, got {matrix[3]}.")
            object.__setattr__(self, "position", matrix[:3, 3])
            object.__setattr__(self, "rotation", matrix[:3, :3])
            object.__setattr__(self, "pose", None)
        for name in ORIENTATIONS:
            if getattr(self, name) is not None:
                object.__setattr__(self, "rotation", rotation_from(name, getattr(self, name)))
                object.__setattr__(self, name, None)
        if self.position is None and self.rotation is None and self.axis is None:
            raise InputError("a frame goal needs a pose, a position, a rotation or an axis.")
        if self.position is not None:
            object.__setattr__(self, "position", _vector("position", self.position))
        if self.rotation is not None:
            object.__setattr__(self, "rotation", _rotation(self.rotation))
        if self.axis is not None:
            object.__setattr__(self, "axis", _axis(self.axis))
        if isinstance(self.free_velocity, str):
            object.__setattr__(self, "free_velocity", (self.free_velocity,))
        for name in ("velocity", "angular_velocity"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _vector(name, getattr(self, name)))
        self._check_region()
        if self.also:
            self._take_over_others()

    def _check_region(self) -> None:
        """Raise InputError for a region of nothing, and for bounds that are none."""
        for name, of, given in (
            ("within", "a position", self.position is not None),
            ("within_angle", "a rotation or an axis", bool(self._turn_equations)),
        ):
            if getattr(self, name) is not None and not given:
                raise InputError(f"`{name}` of a frame goal is around {of}: give one, too.")
        if self.box_frame is not None and len(self._room or ()) != len(AXES):
            raise InputError(
                "`box_frame` of a frame goal needs a box: give `within` three lengths."
            )
        if len(self.sides) not in (0, len(self.bounds)) or not set(self.sides) <= set(Side):
            raise InputError(
                f"`sides` of a frame goal are found by plans, one for each of {len(self.bounds)} "
                f"bounds, got {shown(self.sides)}: leave them out."
            )

    @cached_property
    def bounds(self) -> tuple[Bound, ...]:
        """The bounds of the region of its own frame, in the order of its equations."""
        angle = None if self.within_angle is None else angle_of(self.within_angle)
        position = 0 if self.position is None else len(AXES)
        return tuple(bounds_of(self._room, angle, position, self._turn_equations))

    @property
    def _room(self) -> tuple[float, ...] | None:
        return None if self.within is None else room_of(self.within)

    @property
    def _turn_equations(self) -> int:
        return 3 if self.rotation is not None else 2 if self.axis is not None else 0

    @property
    def regional(self) -> bool:
        """Whether a frame has a region."""
        return any(each.bounds for each in self.parts)

    @property
    def moving(self) -> tuple[FrameGoal, ...]:
        """The parts whose frames have a velocity at the goal."""
        given = ("velocity", "angular_velocity")
        return tuple(x for x in self.parts if any(getattr(x, key) is not None for key in given))

    @property
    def exact(self) -> bool:
        """Whether it is reached in a configuration at rest, without a region."""
        return not (self.regional or self.moving)

    def free_velocities(self, robot: Robot) -> tuple[str, ...]:
        """The joints whose velocity at the goal is free: those that move frames with a velocity."""
        masks = [moves_frame(robot.model, each.frame) for each in self.moving]
        own = [x for x in robot.joint_names if any(m[robot.entries_of(x)].any() for m in masks)]
        return tuple(dict.fromkeys((*own, *self.free_velocity)))

    def velocities(self, robot: Robot) -> tuple[FrameVelocity, ...]:
        """The velocities that frames have, as functions c(q, v) that vanish there."""
        asked = ((x.frame, x.velocity, x.angular_velocity) for x in self.moving)
        return tuple(
            FrameVelocity.asked(
                robot, frame, *(None if y is None else np.asarray(y) for y in given)
            )
            for frame, *given in asked
        )

    @property
    def middle(self) -> FrameGoal:
        """The same with all bounds held at their middle."""
        return replace(self, sides=(), also=[replace(each, sides=()) for each in self.also])

    def _take_over_others(self) -> None:
        """Set what is common to all goals: velocities that are free, and a guess."""
        require_goals(self.also)
        others = tuple(part for each in self.also for part in each.parts)
        free = dict.fromkeys(joint for each in (self, *others) for joint in each.free_velocity)
        guesses = [each.guess for each in (self, *others) if each.guess is not None]
        object.__setattr__(self, "also", others)
        object.__setattr__(self, "free_velocity", tuple(free))
        object.__setattr__(self, "guess", guesses[0] if guesses else None)

    @property
    def parts(self) -> tuple[FrameGoal, ...]:
        """The goals of all frames, of which each is looked at for its own frame alone."""
        return (self, *self.also)

    @property
    def alone(self) -> FrameGoal:
        """That of its own frame."""
        return replace(self, also=()) if self.also else self

    def moves(self, robot: Robot) -> Mask:
        """Which entries of v move one of the frames, (nv,)."""
        masks = [moves_frame(robot.model, each.frame) for each in self.parts]
        return np.asarray(np.any(masks, axis=0))

    @property
    def frames(self) -> str:
        """The frames in words, such as "frame 'tool0'"."""
        names = [repr(each.frame) for each in self.parts]
        return f"frame{'s' * (len(names) > 1)} {' and '.join(names)}"

    def check(self, robot: Robot) -> None:
        """Raise InputError for frames that the robot does not have, or that no joint moves.

        Also for goals of frames of one link that contradict each other.
        """
        for each in self.parts:
            robot.check_frame_moves(each.frame)
            if each.box_frame is not None:
                frame_named(robot.model, each.box_frame)
        exact = [x for x in self.parts if not x.bounds]  # regions may overlap
        targets = [Target(x.frame, x.position, x.rotation, x.directions) for x in exact]
        for one, other in itertools.combinations(targets, 2):
            require_agreement(robot, one, other)

    def difference(self, robot: Robot) -> PoseDifference:
        """The goal as a function c(q) that vanishes where it is reached."""
        self.check(robot)
        return PoseDifference(self, robot)

    def condition(self, robot: Robot) -> PoseDifference:
        """`difference` by its former name."""
        warn("`condition` of a frame goal is now `difference`: use it.", DeprecationWarning)
        return self.difference(robot)

    @property
    def directions(self) -> tuple[Array, Array] | None:
        """The axis: unit vectors (3,) in the frame and in the world; None if there is none."""
        if self.axis is None:
            return None
        inner, world = (np.asarray(each) for each in _axis(self.axis))
        return inner, world

    def to_tables(self) -> dict[str, Any] | list[dict[str, Any]]:
        """As the table [goal] of a scene file, or the tables [[goal]] of several frames."""
        if not self.also:
            return self.to_table()
        alone = [replace(self, also=(), free_velocity=()), *self.also]
        tables = [each.to_table() for each in alone]
        if self.free_velocity:
            tables[0]["free_velocity"] = list(self.free_velocity)
        return tables

    def to_table(self) -> dict[str, Any]:
        """As the table of a goal of one frame in a scene file, without the guess."""
        table: dict[str, Any] = {"frame": self.frame}
        if self.position is not None:
            table["position"] = _floats(self.position)
        if self.rotation is not None:
            table["rpy"] = _floats(pin.rpy.matrixToRpy(np.asarray(self.rotation)))
        if self.directions is not None:
            inner, world = self.directions
            table["axis"] = {"frame": _floats(inner), "world": _floats(world)}
        for key in ("within", "within_angle", "box_frame", "velocity", "angular_velocity"):
            if getattr(self, key) is not None:
                table[key] = _plain(getattr(self, key))
        if self.free_velocity:
            table["free_velocity"] = list(self.free_velocity)
        return table

    @property
    def equations(self) -> int:
        """Number of equations: 3 for a position, 3 for a rotation, 2 for an axis."""
        return sum(x._turn_equations + 3 * (x.position is not None) for x in self.parts)

    def miss(self, robot: Robot, q: Array) -> tuple[float, float]:
        """Distance in [m] and angle in [rad] of the frame at q (nq,); 0 for parts left free.

        From the region if there is one. Of several frames, the largest ones.
        """
        found = [each._miss(robot, q) for each in self.parts]
        return max(distance for distance, _ in found), max(angle for _, angle in found)

    def _miss(self, robot: Robot, q: Array) -> tuple[float, float]:
        """That of its own frame."""
        (offset, angle), room = self.off(robot, q), self._room
        if room is None:
            distance = _norm(offset)
        elif len(room) == 1:
            distance = max(0.0, _norm(offset) - room[0])
        else:
            distance = _norm(np.maximum(np.abs(offset) - room, 0.0))
        least = 0.0 if self.within_angle is None else angle_of(self.within_angle)
        return distance, max(0.0, angle - least)

    def off(self, robot: Robot, q: Array) -> tuple[Array, float]:
        """The offset of its own frame at q (nq,), in [m] along the box, and the angle in [rad].

        0 for what is left free.
        """
        pose = robot.frame_pose(self.frame, q)
        R, p = pose[:3, :3], pose[:3, 3]
        offset = np.zeros(3) if self.position is None else p - np.asarray(self.position)
        if self.box_frame is not None:
            offset = robot.frame_pose(self.box_frame, q)[:3, :3].T @ offset
        angle = 0.0
        if self.rotation is not None:
            angle = _norm(pin.log3(np.asarray(self.rotation).T @ R))
        if self.directions is not None:
            inner, world = self.directions
            angle = float(np.arctan2(_norm(np.cross(R @ inner, world)), (R @ inner) @ world))
        return offset, angle

    def miss_in_words(self, robot: Robot, q: Array) -> str:
        """The distance and the angle by which the frame misses its goal at q (nq,)."""
        return ", ".join(each._miss_in_words(robot, q) for each in self.parts)

    def _miss_in_words(self, robot: Robot, q: Array) -> str:
        distance, angle = self._miss(robot, q)
        parts = [f"{distance:.3g} m"] * (self.position is not None)
        parts += [f"{angle:.3g} rad"] * (self.rotation is not None or self.axis is not None)
        return f"frame {self.frame!r} misses it by {' and '.join(parts)}"


MAX_LEFT_OUT = 1e-6
"""Largest distance from a goal some of whose rows are left out, in [m]: other roots of the others
have their values, too."""


@dataclass(frozen=True, eq=False)
class PoseDifference(Function):
    """The equations of a frame goal: position - target, then the sine of the rotation error.

    A rotation error by theta about a unit axis u gives sin(theta) u = sum_i R_i x R*_i / 2 over
    the columns; an axis gives its two components orthogonal to the target. Both also vanish at
    half a turn, which `is_spurious` detects.

    left_out: rows that follow from those before them, by their numbers.
    """

    goal: FrameGoal
    robot: Robot
    left_out: tuple[int, ...] = ()

    def __getstate__(self) -> dict[str, Any]:
        """The state without what is cached, which is computed anew where it was sent to."""
        return {"goal": self.goal, "robot": self.robot, "left_out": self.left_out}

    @property
    def needs(self) -> frozenset[str]:
        """The configuration alone."""
        return frozenset({"q"})

    @property
    def size(self) -> int:
        """Number of equations."""
        return int(self._symbols[1].shape[0])

    def values(self, at: Points) -> Array:
        """c, shape (P, size)."""
        return np.stack([self._linear_at(q.tobytes())[0] for q in at.q])

    def slopes(self, at: Points) -> Slopes:
        """The Jacobian of c in q."""
        return {"q": np.stack([self._linear_at(q.tobytes())[1] for q in at.q])}

    def curvature(self, at: Points, weights: Array) -> Curvature:
        """sum_i weights_i d2 c_i."""
        return {("q", "q"): self._curvature(at.q, weights)[0]}

    @property
    def independent(self) -> PoseDifference:
        """The same without rows that follow from those before them at every configuration."""
        random, v = np.random.default_rng(0), np.zeros(self.robot.nv)
        turned = [random.uniform(-1.0, 1.0, self.robot.nv) for _ in range(PROBES)]
        slopes = [
            linear(self, self.robot.integrate(self.robot.neutral(), x), v)[1][:, 0] for x in turned
        ]
        kept = {i for J in slopes for i in _independent_rows(J)}
        follow = tuple(i for i in range(self.size) if i not in kept)
        return replace(self, left_out=follow) if follow else self

    def is_spurious(self, at: Points) -> bool:
        """Whether a frame is half a turn away, or where rows that are left out do not hold."""
        distance, angle = self.goal.miss(self.robot, at.q[0])
        return angle > MAX_ANGLE_ERROR or (bool(self.left_out) and distance > MAX_LEFT_OUT)

    def describe(self, at: Points, missed: Array) -> str:
        """The distance and the angle by which the frame misses its goal."""
        return self.goal.miss_in_words(self.robot, at.q[0])

    @cached_property
    def _linear_at(self) -> Callable[[bytes], tuple[Array, Array]]:
        """c and its Jacobian by the numbers of q: at the last ones several terms ask for them."""

        def evaluated(numbers: bytes) -> tuple[Array, Array]:
            c, J = self._linear(np.frombuffer(numbers)[None])
            return c.reshape(self.size), J.reshape(self.size, self.robot.nv)

        return lru_cache(maxsize=KEPT)(evaluated)

    @cached_property
    def _symbols(self) -> tuple[Symbols, ca.SX]:
        """(q, v, a, t) and c."""
        sizes = {"q": self.robot.nq, "v": self.robot.nv, "a": self.robot.nv, "t": 1}
        q, v, a, t = (ca.SX.sym(name, size) for name, size in sizes.items())
        return (q, v, a, t), self._equations(q)

    def _equations(self, q: ca.SX) -> ca.SX:
        placed = functions_of(self.robot).frame_placement
        found = list[ca.SX]()
        for each in self.goal.parts:
            box = None if each.box_frame is None else placed(each.box_frame)(q)[0]
            R, p = placed(each.frame)(q)
            found.append(_rows(each, R, p, box))
        rows = ca.vertcat(*found)
        return rows[[i for i in range(rows.shape[0]) if i not in self.left_out]]

    @cached_property
    def _linear(self) -> PointFunction:
        symbols, c = self._symbols
        J = jacobian(c, symbols, self.robot.curved_space)[:, : self.robot.nv]
        return PointFunction(ca.Function("c", [symbols[0]], [c, J]))

    @cached_property
    def _curvature(self) -> PointFunction:
        symbols, c = self._symbols
        n, weights = self.robot.nv, ca.SX.sym("weights", c.shape[0])
        H = hessian(ca.dot(weights, c), symbols, self.robot.curved_space)[0][:n, :n]
        return PointFunction(ca.Function("ddc", [symbols[0], weights], [H]))


def _independent_rows(J: Array) -> Iterator[int]:
    """The rows of a matrix that do not follow from those before them."""
    basis = np.zeros((0, J.shape[1]))
    for i, row in enumerate(J):
        rest = row - basis.T @ (basis @ row)
        rest -= basis.T @ (basis @ rest)
        size = np.linalg.norm(rest)
        if size > DEPENDENT * np.linalg.norm(J):
            basis = np.vstack([basis, rest / size])
            yield i


def all_of(goals: Sequence[FrameGoal]) -> FrameGoal:
    """The goals of several frames as one, which is reached where all of them are.

    Raises InputError for an empty list, and for entries of another kind.
    """
    require_goals(goals)
    first, *others = goals
    return replace(first, also=(*first.also, *others)) if others else first


def require_goals(goals: Sequence[Any]) -> None:
    """Raise InputError unless there is a goal, and all of them are of frames."""
    if not goals or not all(isinstance(each, FrameGoal) for each in goals):
        raise InputError(
            "several goals at once are a list of hovi.FrameGoal, one for each frame, got "
            f"{shown(goals)}."
        )


def _rows(goal: FrameGoal, R: ca.SX, p: ca.SX, box: ca.SX | None) -> ca.SX:
    """The equations of one frame, with its axes R (3, 3) and its origin p (3,) in the world.

    box: the axes of a box; None for those of the world.
    """
    rows, turn = [], ca.SX(0.0)
    if goal.position is not None:
        offset = p - ca.DM(np.asarray(goal.position))
        rows.append(offset if box is None else box.T @ offset)
    if goal.rotation is not None:
        target = np.asarray(goal.rotation)
        rows.append(rotation_rows(R, target))
        turn = (3.0 - ca.trace(ca.DM(target.T) @ R)) / 2.0
    if goal.directions is not None:
        inner, world = goal.directions
        rows.append(axis_rows(R, inner, world))
        turn = 1.0 - ca.dot(ca.DM(world), R @ ca.DM(inner))
    return held(ca.vertcat(*rows), turn, goal.bounds, goal.sides)


def _numbers(name: str, value: Any) -> Array:
    return numbers_of(f"the {name} of a frame goal", value)


def _vector(name: str, value: npt.ArrayLike) -> Array:
    vector = _numbers(name, value)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(f"the {name} of a frame goal must be three finite numbers, got {value!r}.")
    return vector


def _axis(given: Any) -> tuple[npt.ArrayLike, ...]:
    """Two directions, from a pair or from a table of them. Raises InputError."""
    if isinstance(given, Mapping):
        if given.keys() != {"frame", "world"}:
            raise InputError("the axis of a frame goal needs two directions, `frame` and `world`.")
        given = given["frame"], given["world"]
    if len(given) != 2:
        raise InputError("an axis must be a pair: a direction in the frame and one in the world.")
    return tuple(_direction(each) for each in given)


def _direction(value: npt.ArrayLike) -> Array:
    vector = _vector("axis", value)
    if math.hypot(*vector) < LEAST_LENGTH:
        raise InputError("the axis of a frame goal has length zero; give a direction.")
    return unit_vector(vector)


def _rotation(value: npt.ArrayLike) -> Array:
    matrix = _numbers("rotation", value)
    fits = matrix.shape == (3, 3) and (np.abs(matrix) <= 1 + ROUNDED).all()
    off = float(np.max(np.abs(matrix.T @ matrix - np.eye(3)))) if fits else np.inf
    if off > ROUNDED:
        found = f", and is off by {off:.2g}" if fits else ""
        raise InputError(
            "the rotation of a frame goal must be an orthonormal (3, 3) matrix, to three digits"
            f"{found}; got {value!r}."
        )
    if np.linalg.det(matrix) < 0:
        raise InputError("the rotation of a frame goal is a reflection; reverse one of its axes.")
    if off <= EXACT:
        return matrix
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ right)


def _norm(x: npt.ArrayLike) -> float:
    return math.hypot(*np.asarray(x))


def _floats(values: Any) -> list[float]:
    return [float(each) for each in np.asarray(values)]


def _plain(value: Any) -> Any:
    """A number, a text or a list of both, as TOML takes them."""
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(each) for each in value]
    return value if isinstance(value, str) else float(value)
