"""Calls of the public API with an argument of another type, shape or value.

A call must be refused with one sentence, or return. What an argument may be is not said here, but
the values of `NEVER` mean nothing anywhere: a call with one of them must be refused.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import io
import json
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from random import Random
from typing import Any

import casadi as ca
import numpy as np

import hovi
from hard.verdict import Mutant, Verdict, judge
from hovi.conditions.condition import with_function
from hovi.discrete.output.stored_torque import StoredTorque
from hovi.flows.legendre_transforms import legendre
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.segment_scenes import SegmentScenes
from hovi.scene.segmented_lagrangian import SegmentedLagrangian
from hovi.schemes import by_name, galerkin
from samples.cubic_motion import Cubic, cubic_motion
from samples.meshes import WEDGE
from samples.slider import SLIDER
from samples.world_files import CUPBOARD, JOINT_REQUEST, PLANNING_SCENE

Q, N, H = 2, 4, 0.1
BALL = {"kind": "sphere", "position": [0.0, 0.0, 0.0], "radius": 0.1}


class Nothing:
    """A type that no argument has."""

    def __repr__(self) -> str:
        return "Nothing()"


ITSELF: list[Any] = []
ITSELF.append(ITSELF)
NEVER: tuple[Any, ...] = (
    *(Nothing(), b"bytes", 1j, [Nothing()], np.complex128(1.0), np.full(2, 1j)),
    *(np.timedelta64(3, "ms"), np.array([1, 2], "m8[s]")),
)
WRONG: tuple[Any, ...] = (
    *NEVER,
    *({1: Nothing()}, {"elbow": Nothing()}),
    *(None, "x", "", "nan", 3, -1, 0, 2.5, True, 10**400, 10**30, float("nan"), float("inf")),
    *(1e300, -1e300, 5e-324, Fraction(1, 3), Decimal(1), [1e300, 1e300], {"elbow": 1e300}),
    *({"elbow": [1, 2, 3]}, {"elbow": "x"}, "a" * 300, "\ud800", memoryview(b"abc"), ITSELF),
    *(
        [],
        [[]],
        (),
        {},
        [None],
        ["x"],
        [[1.0], [2.0, 3.0]],
        {"a": 1},
        {"shoulder": None},
        {None: 1},
    ),
    *(
        np.zeros(0),
        np.zeros(3),
        np.zeros((1, 3)),
        np.zeros((5, 2)),
        np.full(2, np.nan),
        np.array("x"),
    ),
    *(np.full(3, 1e300), np.full(4, -1e308), np.full((2, 3), 1e300), np.full((3, 3), 1e200)),
    *(np.full((4, 4), 1e300), np.full(2, 5e-324), np.full(3, 5e-324), np.full((2, 2), 1e300)),
    *(np.zeros((2, 2, 2, 2)), np.array([None, 1]), np.zeros(2, complex), range(3), ..., set()),
)


@dataclass(frozen=True)
class Call:
    """A valid call: a function, positional arguments, and keywords."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...] = ()
    keywords: tuple[tuple[str, Any], ...] = ()

    @property
    def places(self) -> tuple[int | str, ...]:
        """Where an argument can be replaced."""
        return (*range(len(self.arguments)), *(name for name, _ in self.keywords))

    def replaced(self, place: int | str, value: Any) -> Call:
        """The call with another argument."""
        arguments, keywords = list(self.arguments), dict(self.keywords)
        if isinstance(place, int):
            arguments[place] = value
        else:
            keywords[place] = value
        return Call(self.function, tuple(arguments), tuple(keywords.items()))

    def __call__(self) -> Any:
        """Call it, without what it prints."""
        inside = contextlib.chdir(folder())  # "x" may be the path of a file to write
        with contextlib.redirect_stdout(io.StringIO()), inside:
            result = self.function(*self.arguments, **dict(self.keywords))
            close = getattr(result, "close", None)  # of a session with a server
            if callable(close):
                close()
            return result


def call(function: Callable[..., Any], *arguments: Any, **keywords: Any) -> Call:
    """A call."""
    return Call(function, arguments, tuple(keywords.items()))


def own(value: Any, method: str, *arguments: Any, **keywords: Any) -> Call:
    """The call of a method."""
    return call(getattr(value, method), *arguments, **keywords)


@cache
def folder() -> Path:
    """For files that calls write."""
    return Path(tempfile.mkdtemp(prefix="hovi-calls-"))


def build(make: type, **fields: Any) -> Call:
    """The call of a constructor by keywords."""
    return call(make, **fields)


@cache
def calls() -> dict[str, Call]:
    """The valid calls, by name."""
    found: dict[str, Call] = {}
    groups = (
        _models,
        _scenes,
        _kept,
        _grids,
        _motions,
        _problems,
        _plans,
        _orders,
        _segments_and_periods,
        _sequences,
        _symbolic,
        _flows,
        _groups,
        _files,
        _studies,
    )
    for group in groups:
        for each in group():
            name = _name(each)
            numbers = (f"{name} {i}" for i in range(2, 99))
            found[name if name not in found else next(n for n in numbers if n not in found)] = each
    return found


def _name(each: Call) -> str:
    name = each.function.__qualname__
    return name.removesuffix(".__init__")


@cache
def robot() -> hovi.Robot:
    return hovi.load_robot(hovi.example("two_link.urdf"))


@cache
def panda() -> hovi.Robot:
    return hovi.load_robot("panda")


@cache
def cart() -> hovi.Scene:
    path = folder() / "slider.urdf"
    path.write_text(SLIDER)
    return hovi.Scene(hovi.load_robot(path), [hovi.effects.Gravity()])


@cache
def pendulum() -> hovi.Robot:
    return hovi.load_robot(hovi.example("pendulum.urdf"))


@cache
def scene() -> hovi.Scene:
    return hovi.Scene(robot(), [hovi.effects.Gravity(9.8)])


@cache
def solution() -> hovi.Solution:
    return hovi.plan(scene(), [0.0, 0.0], [0.3, 0.7], 1.0, intervals=N, processes=1)


def problem() -> hovi.TrajectoryProblem:
    found = solution().problem
    assert found is not None
    return found


def _models() -> list[Call]:
    q, rows = np.zeros(2), np.zeros((3, 2))
    return [
        call(hovi.example, "two_link.urdf"),
        call(hovi.chain, 3, length=1.0, mass=1.0),
        call(
            hovi.load_robot,
            hovi.example("two_link.urdf"),
            **{"package_dirs": (), "free_flyer": None, "locked": ("elbow",), "visual": None},
            **{"collision": None, "srdf": None, "mimic": False},
        ),
        call(hovi.load_robot, hovi.example("two_link.urdf"), locked={"elbow": 0.3}),
        call(
            *(hovi.load_robot, hovi.example("two_link.urdf")),
            tools={"tcp": {"frame": "tip", "position": [0.1, 0.0, 0.0], "rpy": [0.0, 0.1, 0.0]}},
        ),
        *(own(robot(), name, q, "q") for name in ("check_configuration", "check_velocity")),
        *(own(robot(), name, rows, rows) for name in ("integrate", "difference")),
        *(own(panda(), name, panda().neutral(), np.zeros(9)) for name in ("integrate",)),
        own(robot(), "frame_position", "tip", rows),
        own(robot(), "frame_positions", ("tip",), rows),
        own(robot(), "frame_pose", "tip", rows),
        own(robot(), "check_frame_moves", "tip"),
        own(robot(), "measured_frames", "tip"),
        own(robot(), "hint", "tipp", ("tip",)),
        own(robot(), "joint_at", 1),
        own(panda(), "pose", "default"),
        call(hovi.Robot.from_dict, robot().to_dict(), package_dirs=(), meshes={}),
        call(ConfigurationSpace, (2, "SO(2)")),
        own(ConfigurationSpace((2, "SE(3)")), "integrate", np.zeros((3, 9)), np.zeros((3, 8))),
        own(ConfigurationSpace((2, "SE(3)")), "difference", np.zeros((3, 9)), np.zeros((3, 9))),
    ]


def _scenes() -> list[Call]:
    e = hovi.effects
    effects = [
        build(e.AccelerationCost, weight={"elbow": 1.0}),
        build(e.Armature, inertia={"elbow": 1.0}, from_urdf=False),
        build(e.Custom, torque_of={"elbow": "t"}, cost="t"),
        build(e.Drag, frame="tip", area=0.1, density=1.2, linear=0.1, wind=(0, 0, 0), width=0.01),
        build(
            e.DryFriction,
            **{"coulomb": {"elbow": 1.0}, "static": {"elbow": 2.0}, "stribeck_velocity": 0.1},
            **{"width": 0.05, "from_urdf": False},
        ),
        build(e.CasadiCost, cost=_squared_torque()),
        build(e.EffortWeight, weight={"elbow": 2.0}),
        build(e.EffortWeight, from_urdf=True),
        build(e.EffortWeight, matrix=[[2.0, "sin(t)"], ["sin(t)", 1.0]]),
        build(e.Gravity, acceleration=9.81, direction=(0.0, 0.0, -1.0)),
        build(e.JerkCost, weight={"shoulder": 1.0, "elbow": 2.0}),
        build(e.JointLimitPotential, ranges={"elbow": (0, 1)}, slope=10.0, width=0.01, stops=False),
        build(e.JointSprings, stiffness={"elbow": 1.0}, rest=0.0),
        build(e.MovingBase, position=(0, 0, "t"), rotation=(0.0, 0.0, 0.0)),
        build(e.Payload, frame="tip", mass=1.0, center=(0, 0, 0), inertia=(1, 1, 1, 0, 0, 0)),
        build(e.PowerCost, weight={"elbow": 1.0}, width=0.1),
        build(e.ReferenceCost, reference={"elbow": "t"}, weight=1.0),
        build(e.RunningCost, terms={"tip": 'acceleration["tip", "x"]**2', "drives": "dot(tau, v)"}),
        build(e.VelocityCost, weight={"elbow": 1.0}),
        build(e.ViscousFriction, coefficient={"elbow": 1.0}, from_urdf=False),
        build(e.Wrench, frame="tip", force=(1, 0, 0), moment=(0, 0, "t"), axes="world"),
    ]
    return [
        *(call(_scene_with(each.function), **dict(each.keywords)) for each in effects),
        build(hovi.Scene, robot=robot(), effects=[], passive=("elbow",), begin=0.5, compile=False),
        build(hovi.Scene, robot=robot(), effects={"gravity": {"acceleration": 9.81}}),
        own(scene(), "effort_lagrangian", weight=[1.0, 2.0], regular=True),
        own(scene(), "inverse_dynamics", *[np.zeros((3, 2))] * 3, np.zeros(3)),
        own(scene(), "without", "gravity"),
        own(scene(), "from_time", 0.5),
        call(hovi.Scene.from_dict, scene().to_dict(), package_dirs=(), meshes={}),
        call(hovi.effects.register, hovi.effects.Gravity),
    ]


def _squared_torque() -> ca.Function:
    """(q, v, a, tau, t) -> tau_1^2 + tau_2^2."""
    q, v, a, tau = (ca.SX.sym(name, 2) for name in "qvau")
    return ca.Function("C", [q, v, a, tau, ca.SX.sym("t")], [ca.sumsqr(tau)])


def _scene_with(effect: Callable[..., Any]) -> Callable[..., hovi.Scene]:
    """A scene with an effect, which is checked with the robot of its scene."""

    @functools.wraps(effect)
    def with_effect(**fields: Any) -> hovi.Scene:
        return hovi.Scene(robot(), [effect(**fields)])

    return with_effect


def _kept() -> list[Call]:
    c, few = hovi.conditions, {"name": "kept", "during": (0.2, 0.8)}
    poses = {"times": [0.0, 0.5, 1.0], "positions": [[0.3, 0.0, 0.1 * i] for i in range(3)]}
    found = [
        build(c.Upright, frame="tip", axis=([0, 0, 1], [1, 0, 0]), within="5 deg", tolerance=1e-4),
        build(c.OnLine, frame="tip", direction=[1, 0, 0], point=[0.3, 0, 0], within="5 mm", **few),
        build(c.OnPlane, frame="tip", normal=[0, 0, 1], point=[0.3, 0, 0], tolerance="0.01 mm"),
        build(c.KeepOrientation, frame="tip", rpy=[0.1, 0.2, 0.3], within=0.1, tolerance=1e-4),
        build(c.KeepOrientation, frame="tip", quaternion_xyzw=[0, 0, 0, 1]),
        build(c.KeepOrientation, frame="tip", quaternion_wxyz=[1, 0, 0, 0]),
        build(c.KeepPose, frame="tip", axes=["x", "ry"], position=[0.3, 0, 0], rpy=[0, 0, 0]),
        build(c.Together, frame="upper_arm", other="tip", position=[0.3, 0, 0], rpy=[0, 0.1, 0]),
        build(c.Follow, frame="tip", **poses, rpy=np.zeros((3, 3)), tolerance=1e-5, angle=1e-4),
        build(c.ToolSpeed, frame="tip", linear="250 mm/s", angular=0.5),
        build(c.ToolAcceleration, frame="tip", linear=2.0),
        build(c.Formula, formula="q['elbow']", lower=-1.0, upper=1.0, scale=2.0, unit="rad"),
        build(c.Formula, formula="v", equals=[0.1, 0.2], tolerance=1e-5),
        build(c.CasadiRow, expression=lambda v: v[0] + v[1], level=1, equals=0.1, tolerance=1e-5),
    ]
    return [call(_conditions_of(each.function), **dict(each.keywords)) for each in found]


def _conditions_of(kind: Callable[..., Any]) -> Callable[..., Any]:
    """The conditions of what is kept on a robot, from one end of a motion to the other."""

    @functools.wraps(kind)
    def conditions(**given: Any) -> Any:
        ends = hovi.conditions.EndPoses(_pose, _pose)
        kept = kind(**given).resolved(ends)
        return [with_function(each, robot()) for each in kept.conditions(robot())]

    return conditions


def _pose(frame: str) -> hovi.conditions.Pose:
    return hovi.conditions.Pose(np.eye(3), np.array([0.3, 0.0, 0.1]))


def _grids() -> list[Call]:
    grid, scheme = problem().ld.grid, by_name("galerkin-2")
    tau = np.zeros((N, 3, 2))
    return [
        build(hovi.Grid, steps=np.full(N, H), schemes=(scheme,) * N),
        call(hovi.Grid.uniform, 1.0, 4, scheme),
        own(grid, "stretched", 2.0),
        own(grid, "halved", np.array([True, False, True, False])),
        own(grid, "enriched", 2),
        own(grid, "node_at", 0.5),
        own(grid, "with_nodes", [0.3]),
        call(by_name, "galerkin-2"),
        call(galerkin, 2, derivatives=2, points=4),
        *(call(getattr(hovi.schemes, name), 2) for name in ("gamma", "inverse_gamma")),
        call(hovi.schemes.end_basis, np.array([0.5]), 2),
        *(
            call(getattr(hovi.schemes, name), scheme)
            for name in ("is_regular", "regularity_matrix", "require_regular")
        ),
        own(scheme, "rows", np.array([0.5])),
        build(
            hovi.schemes.Scheme,
            **{"name": "own", "order": 4, "points": scheme.points, "weights": scheme.weights},
            table=scheme.table,
        ),
        call(StoredTorque, tau),
    ]


def _motions() -> list[Call]:
    trajectory, ld = solution().trajectory, problem().ld
    path, jets = trajectory.path, problem().ld.jets(trajectory.path)
    expansion, step = ld.expand(path), np.zeros((N, 6, 2))
    k, s = np.array([0, 1]), np.array([0.0, 1.0])
    points = [np.zeros((len(jets[0][0]), 2))]
    return [
        build(hovi.DiscretePath, q=path.q, v=path.v, z=path.z, inner=path.inner),
        build(hovi.DiscreteLagrangian, lagrangian=ld.lagrangian, grid=ld.grid),
        *(own(ld, name, path, jets) for name in ("values", "action")),
        own(ld, "expand", path, "nodal", points, None, jets),
        own(ld, "gradient", path, "regular", jets),
        *(own(ld, name, path) for name in ("jets", "turns")),
        *(own(ld, name, path, None) for name in ("momenta", "duration_derivative")),
        *(own(ld, name, path, None, jets) for name in ("derivatives", "point_gradients")),
        own(ld, "predict", expansion, step, "nodal"),
        own(ld, "point_steps", step, "nodal", expansion),
        call(
            _state_on_robot,
            **{"q": [0.0, 1.0], "v": [0.0, 0.0], "free": ("elbow",), "free_velocity": ("elbow",)},
            turns={},
        ),
        own(hovi.State([0.0, 1.0]), "on", robot(), "start"),
        own(hovi.State([0.0, 1.0]), "free_on", robot(), "start"),
        own(hovi.State([0.0, 1.0]), "turns_on", robot(), "start"),
        own(hovi.State([0.0, 1.0]), "angles_on", robot()),
        own(hovi.State([0.0, 1.0]), "turns_made", robot(), np.array([0.0, 1.0])),
        build(
            hovi.Trajectory,
            **{"grid": trajectory.grid, "path": path, "momenta": trajectory.momenta},
            **{"scene": trajectory.scene, "metadata": {}, "torque": None},
        ),
        *(
            own(trajectory, name, [0.0, 0.5])
            for name in ("sample", "configurations", "jet", "positions")
        ),
        *(own(trajectory, f"{name}_intervals", k, s) for name in ("jet", "sample", "positions")),
        call(hovi.extremes, trajectory),
        call(hovi.limit_sets),
        own(hovi.limit_sets()["panda"], "beyond", 2),
        own(hovi.limit_sets()["panda"], "on", _panda()),
    ]


@cache
def _panda() -> hovi.Robot:
    """An arm with a limit set."""
    return hovi.load_robot("panda")


def _state_on_robot(**fields: Any) -> object:
    """A state, which is checked with a robot."""
    state = hovi.State(**fields)
    return state.on(robot(), "start"), state.free_on(robot(), "start"), state.turns_on(robot(), "")


@cache
def _world_files() -> Path:
    """A folder with a mesh and the files of a cupboard and of a planning scene."""
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    (folder / "channel.obj").write_text(WEDGE)
    (folder / "cupboard.urdf").write_text(CUPBOARD)
    (folder / "kitchen.yaml").write_text(PLANNING_SCENE)
    (folder / "request.yaml").write_text(JOINT_REQUEST)
    return folder


def _obstacles() -> list[Call]:
    folder, at = _world_files(), {"position": [2.0] * 3, "rpy": [0.0] * 3}
    corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]
    return [
        build(hovi.Cylinder, radius=0.1, length=0.3, **at, name="post"),
        build(
            hovi.ObstaclePath,
            **{"times": [0.0, 1.0], "positions": corners[:2], "rpy": corners[:2]},
        ),
        call(hovi.ObstaclePath.of, {"times": [0.0, 1.0], "positions": corners[:2]}),
        own(hovi.ObstaclePath([0.0, 1.0], corners[:2]), "poses", np.array([0.3])),
        own(hovi.ObstaclePath([0.0, 1.0], corners[:2]), "pose", 0.3),
        build(hovi.Sphere, position=[1.0, 0.0, 0.0], radius=0.1, path=None),
        build(hovi.HalfSpace, normal=[0.0, 0.0, 1.0], position=[0.0, 0.0, -3.0], name="floor"),
        build(hovi.ConvexHull, points=corners, **at, name="wedge"),
        build(hovi.ConvexParts, parts=[corners, corners], radius=0.01, **at, name="parts"),
        build(hovi.Mesh, file=folder / "channel.obj", **at, scale=1.0, convex_parts=False),
        build(hovi.PointCloud, points=corners, radius=0.01, cell=0.0, **at, name="cloud"),
        call(
            hovi.load_obstacles,
            folder / "cupboard.urdf",
            **{"name": "a", **at, "joints": {"hinge": 0.3}, "package_dirs": ()},
            **{"convex_parts": False, "path": None},
        ),
        call(hovi.load_obstacles, folder / "kitchen.yaml", **at),
        call(
            *(hovi.load_motion_plan_request, folder / "request.yaml", hovi.Scene(panda()), 1.0),
            **{"start": "default", "limits": "urdf"},
            planning_scene=folder / "kitchen.yaml",
        ),
        build(
            hovi.Grasped,
            **{"shape": hovi.Sphere([0.0] * 3, 0.1), "frame": "forearm", "mass": 1.0, **at},
            **{"center": [0.0] * 3, "inertia": [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]},
            **{"may_touch": ["ball"], "name": "apple"},
        ),
        call(hovi.holding, robot(), _apple()),
        own(_apple(), "payload"),
        build(hovi.Clearance, obstacles=(), may_touch=[("apple", "forearm")]),
    ]


@cache
def _apple() -> hovi.Grasped:
    return hovi.Grasped(hovi.Sphere([0.0] * 3, 0.1), "forearm", 1.0, "apple")


def _problems() -> list[Call]:
    limits, task = problem().limits, _task()
    assert limits is not None
    start, goal = hovi.State([0.0, 0.0]), hovi.State([0.3, 0.7])
    frame_goal = hovi.FrameGoal("tip", position=[0.2, 0.0, 0.0])
    sphere = hovi.Sphere([5.0, 0.0, 0.0], 0.1)
    return [
        build(hovi.Sphere, position=[1.0, 0.0, 0.0], radius=0.1, name="ball"),
        build(hovi.Capsule, ends=[[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], radius=0.1, name="post"),
        build(hovi.Box, size=[1.0] * 3, position=[2.0] * 3, rpy=[0.0] * 3, name="box"),
        *_obstacles(),
        build(hovi.Clearance, obstacles=(sphere,), margin=0.01, self_collision=False),
        call(hovi.Clearance.from_dict, hovi.Clearance((sphere,)).to_dict()),
        build(hovi.Limits, lower=limits.lower, upper=limits.upper, tolerance=1e-6),
        call(hovi.Limits.from_dict, limits.to_dict()),
        call(hovi.as_limits, robot(), {"base": "none", "v": 1.0}, order=2),
        call(hovi.as_limits, robot(), {"base": "urdf", "v": "50 %", "tau": ["5 %", 2.0]}, order=2),
        own(limits, "with_margin", 0.1),
        own(limits, "excess", np.zeros((3, 4, 2))),
        build(hovi.Limits, lower=-np.ones((6, 2)), upper=np.ones((6, 2)), tolerance=1e-6),
        build(
            hovi.FrameGoal,
            **{"frame": "tip", "position": [0.2, 0.0, 0.0], "rotation": np.eye(3)},
            **{"free_velocity": ("elbow",), "guess": [0.0, 0.0]},
        ),
        build(hovi.FrameGoal, frame="tip", axis=([1, 0, 0], [0, 0, 1])),
        build(hovi.FrameGoal, frame="tip", axis={"frame": [1, 0, 0], "world": [0, 0, 1]}),
        build(hovi.FrameGoal, frame="tip", pose=np.eye(4)),
        build(hovi.FrameGoal, frame="tip", position=[0.2, 0.0, 0.0], also=[frame_goal]),
        build(
            hovi.FrameGoal,
            **{"frame": "tip", "position": [0.2, 0.0, 0.0], "within": ["10 mm", 0.0, 0.02]},
            **{"axis": ([1, 0, 0], [0, 0, 1]), "within_angle": "5 deg", "box_frame": "forearm"},
        ),
        build(hovi.FrameGoal, frame="tip", rpy=[0.1, 0.2, 0.3]),
        build(
            hovi.FrameGoal,
            **{"frame": "tip", "position": [0.2, 0.0, 0.0], "velocity": [0.1, 0.0, 0.0]},
            angular_velocity=[0.0, 0.1, 0.0],
        ),
        build(hovi.FrameGoal, frame="tip", quaternion_xyzw=[0.0, 0.0, 0.0, 1.0]),
        build(hovi.FrameGoal, frame="tip", quaternion_wxyz=[1.0, 0.0, 0.0, 0.0]),
        call(
            hovi.inverse_kinematics,
            *(panda(), _hand_goal()),
            **{"near": np.zeros(9), "limits": "urdf", "obstacles": (sphere,), "margin": 0.01},
            **{"self_collision": False, "most": 2, "seeds": 50},
        ),
        call(
            *(hovi.inverse_kinematics, robot(), {"frame": "tip", "position": [0.3, 0, -2]}),
            **{"near": {"shoulder": 0.1, "elbow": 0.2}, "seeds": 20},
            obstacles=[{"kind": "sphere", "position": [5.0, 0.0, 0.0], "radius": 0.1}],
        ),
        own(frame_goal, "check", robot()),
        own(frame_goal, "difference", robot()),
        build(hovi.Via, time=0.5, goal=goal),
        build(hovi.Via, time="free", goal=goal),
        build(hovi.Between, lower=-1.0, upper=[1.0, 2.0]),
        build(hovi.Equal, value=[0.1, 0.2]),
        build(hovi.AtTimes, times=[0.3, 0.6]),
        build(hovi.Points, q=np.zeros((3, 2)), v=np.zeros((3, 2)), t=np.zeros(3)),
        call(hovi.Condition, "tau * v", hovi.Between(-1.0, 1.0), unit="W", tolerance=1e-5),
        call(hovi.Tolerance.of, "1 mm", robot()),
        own(hovi.Tolerance.of("1 mm", robot()), "in_words", 1e-3, "tip"),
        build(
            hovi.TrajectoryProblem,
            **{"ld": problem().ld, "start": start, "goal": goal, "limits": limits},
            **{"via": (hovi.Via(0.5, goal),), "clearance": hovi.Clearance()},
        ),
        own(problem(), "between", start, goal),
        own(problem(), "on", problem().ld.grid),
        own(problem(), "trajectory", solution().trajectory.path),
        build(
            hovi.Task,
            **{each: getattr(task, each) for each in ("scene", "start", "goal")},
            duration=1.0,
            options=task.options,
            name="task",
        ),
        own(task, "with_options", intervals=4),
        own(task.options, "with_changes", intervals=4),
        own(task.options, "on", scene()),
    ]


@cache
def _with_hand() -> hovi.Scene:
    return hovi.Scene(panda(), [hovi.effects.Gravity()])


def _arm_alone() -> dict[str, float]:
    """A goal that leaves out the fingers, which stay where they start."""
    return {joint: 0.0 for joint in panda().joint_names if "finger" not in joint}


@cache
def _hand_goal() -> hovi.FrameGoal:
    return hovi.FrameGoal("panda_hand", position=[0.4, 0.1, 0.4], axis=([0, 0, 1], [0, 0, -1]))


def _task() -> hovi.Task:
    options = hovi.PlanOptions(intervals=N, processes=1, max_iterations=2, time_limit=1.0)
    return hovi.Task(scene(), hovi.State([0.0, 0.0]), hovi.State([0.3, 0.7]), 1.0, options)


def _plans() -> list[Call]:
    quick = {"max_iterations": 2, "time_limit": 1.0, "intervals": N, "processes": 1, "starts": 1}
    options = {
        **{"time_weight": 0.0, "via": (), "scheme": "galerkin-2", "limits": "none", "seed": 0},
        **{
            "tolerance": None,
            "obstacles": (),
            "grasped": (),
            "margin": 0.01,
            "self_collision": False,
        },
        **{"guess": "cubic", "turns": None, "weight": None, "continuation": False},
        **{"group": None},
    }
    unwatched = {"progress": None, "options": None, "on_iterate": None, "cancel": None}
    ends, limits = ([0.0, 0.0], [0.3, 0.7]), hovi.as_limits(robot(), {"base": "none", "v": 1.0})
    return [
        call(hovi.plan, scene(), *ends, 1.0, **unwatched, **quick, **options),
        call(hovi.plan, scene(), *ends, (0.5, 1.0), **quick),
        call(hovi.plan, scene(), *ends, 1.0, smooth=True, **quick),
        call(hovi.plan, _with_hand(), np.zeros(9), np.zeros(9), 1.0, group="arm", **quick),
        *(
            call(hovi.plan, _with_hand(), np.zeros(9), goal, 1.0, group="arm", **quick)
            for goal in (_arm_alone(), {"q": _arm_alone()}, hovi.State(_arm_alone()))
        ),
        call(
            hovi.plan, scene(), hovi.FrameGoal("tip", position=[0.3, 0, -2]), ends[1], 1.0, **quick
        ),
        call(
            *(hovi.plan, scene(), {"q": {"shoulder": 0.0, "elbow": 0.0}, "v": {"elbow": 0.1}}),
            *({"frame": "tip", "position": [0.3, 0, -2]}, "1 s"),
            via=[{"time": "300 ms", "q": {"shoulder": 0.1, "elbow": 0.2}}],
            **quick,
        ),
        own(
            hovi.State({"shoulder": 0.0, "elbow": 0.0}, {"elbow": 0.1}),
            *("resolved", robot(), "start"),
        ),
        build(hovi.PlanOptions, **quick, **options),
        call(
            hovi.plan_task,
            _task(),
            **{"progress": None, "on_iterate": None, "cancel": None, "intervals": 2},
        ),
        call(
            hovi.solve,
            problem(),
            "cubic",
            **{"max_iterations": 2, "time_limit": 1.0, "escape_saddles": True, "report": None},
            method=None,
        ),
        call(hovi.solve, problem(), max_iterations=2, method=hovi.methods.SequentialQuadratic()),
        build(hovi.methods.SequentialQuadratic, solver="piqp"),
        own(solution(), "replan", [0.0, 0.0], [0.3, 0.6], None),
        own(solution(), "replan", goal=[0.3, 0.6], time_limit=1.0, max_iterations=2),
        own(
            *(solution(), "replan", {"q": [0.0, 0.0]}, {"shoulder": 0.3, "elbow": 0.6}),
            **{"time_limit": "1 s", "max_iterations": 2},
        ),
        own(
            *(solution(), "advance", 0.1, {"q": [0.05, 0.1], "v": [0.1, 0.1]}, [0.3, 0.6]),
            **{"duration": 0.8, "time_limit": 1.0},
        ),
        own(solution(), "margins"),
        own(solution().factor, "slopes", "goal"),
        own(solution().factor, "cost_slopes", "start"),
        own(solution().factor, "cost_curvature", "goal"),
        build(hovi.LimitMargins, names=("a", "b"), margin=np.zeros((4, 2)), limits=limits),
        build(hovi.Margins, limits=None, distance=0.1, segments={}),
        call(hovi.certify, solution(), "tip", estimate=False),
        call(hovi.estimate_error, solution(), "tip"),
    ]


def _orders() -> list[Call]:
    """Boundary value problems of order 3, and stationary points of order 1."""
    rest, moved = hovi.State([0.0, 0.0], a=[0.0, 0.0]), hovi.State([0.3, 0.7])
    scheme, free = galerkin(1, derivatives=3), ("q[0]",)
    ld = hovi.DiscreteLagrangian(hovi.spline(2, 3), hovi.Grid.uniform(1.0, N, scheme))
    third = hovi.TrajectoryProblem(ld, rest, moved)
    found = hovi.solve(third)
    path = found.trajectory.path
    first = hovi.DiscreteLagrangian(hovi.spline(2, 1), hovi.Grid.uniform(1.0, N, galerkin(1, 1)))
    ends = hovi.State([0.0, 0.0]), hovi.State([0.3, 0.7])
    return [
        build(hovi.TrajectoryProblem, ld=ld, start=rest, goal=moved, limits=None, clearance=None),
        own(rest, "jet_on", third.coordinates, "start"),
        own(rest, "require_order", 3, "start"),
        call(_ends_of_order_3, a=[0.0, 0.0], free_acceleration=free, v=[0.0, 0.0], jerk=None),
        call(hovi.solve, third, found.trajectory, seek="minimum"),
        call(hovi.solve, hovi.TrajectoryProblem(first, *ends), "cubic", seek="stationary"),
        own(found, "replan", None, [0.3, 0.6]),
        own(found, "advance", 0.01, rest, [0.3, 0.6], duration=None),
        own(found.trajectory, "jet", [0.0, 0.5], 3),
        own(found.trajectory, "jet_intervals", [0, 1], [0.0, 1.0], 3),
        build(
            hovi.DiscretePath,
            **{"q": path.q, "v": path.v, "z": path.z, "inner": path.inner, "higher": path.higher},
        ),
        *(own(ld, name, path) for name in ("values", "action", "gradient", "derivatives")),
    ]


def _segments_and_periods() -> list[Call]:
    """Motions in two segments, and periodic ones."""
    ld, ends = problem().ld, (hovi.State([0.0, 0.0]), hovi.State([0.3, 0.7]))
    limits = problem().limits
    assert limits is not None
    of_segments = hovi.TrajectoryProblem.of_segments
    both = of_segments([ld, ld], *ends, [limits, None])
    lagrangian = both.ld.lagrangian
    assert isinstance(lagrangian, SegmentedLagrangian)
    assert both.limits is not None
    motion = hovi.solve(of_segments([ld, ld], *ends)).trajectory
    assert motion.segments is not None
    jet, t = [np.zeros((3, 2))] * 3, np.array([0.5, 1.5, 1.0])
    return [
        call(
            of_segments,
            **{"segments": [ld, ld], "start": ends[0], "goal": ends[1], "limits": [limits, None]},
            **{"via": (hovi.Via(1.0, ends[0]),), "clearance": None},
        ),
        call(hovi.Grid.joined, [ld.grid, ld.grid]),
        call(hovi.Limits.of_segments, [limits, limits], [1.0]),
        own(both.limits, "on", both.ld.grid.t),
        own(both.limits, "with_margin", 0.1),
        build(SegmentedLagrangian, lagrangians=lagrangian.lagrangians, ends=lagrangian.ends),
        *(own(lagrangian, name, *jet, t=t) for name in ("value", "evaluate", "output")),
        own(lagrangian, "segments_of", both.ld.grid.t),
        build(SegmentScenes, scenes=motion.segments.scenes, intervals=(N, N)),
        call(SegmentScenes.from_tables, motion.segments.to_tables()),
        own(motion, "sample", [0.5, 1.5]),
        own(motion, "save", folder() / "segments.npz"),
        call(_period, displacement=[6.0, 0.0], held=("elbow",)),
        own(hovi.Periodic([6.0, 0.0]), "ends", ends[0], robot(), 2, False),
    ]


def _sequences() -> list[Call]:
    """Segments, and their plans as one motion."""
    load = hovi.effects.Payload(frame="tip", mass=0.5)
    segments = [
        hovi.Segment([0.3, 0.7], 0.5),
        hovi.Segment([0.0, 0.0], 0.5, effects=[load], name="carry"),
    ]
    quick: dict[str, Any] = {"intervals": N, "processes": 1, "limits": "none"}
    task = hovi.Task.of_segments(scene(), hovi.State([0.0, 0.0]), segments)
    return [
        build(
            hovi.Segment,
            **{"goal": [0.3, 0.7], "duration": 0.5, "effects": [load], "limits": "none"},
            name="carry",
        ),
        call(
            hovi.plan_sequence,
            *(scene(), [0.0, 0.0], segments),
            **{"progress": None, "options": None, "on_iterate": None, "cancel": None, **quick},
        ),
        call(
            hovi.Task.of_segments,
            *(scene(), hovi.State([0.0, 0.0]), segments),
            **{"options": None, "name": "pick"},
        ),
        call(
            *(hovi.plan_sequence, scene(), {"q": [0.0, 0.0]}),
            [{"goal": {"q": [0.3, 0.7]}, "duration": "500 ms"}, {"goal": [0, 0], "duration": 1.0}],
            **quick,
        ),
        call(
            *(hovi.plan_sequence, _with_hand(), np.zeros(9)),
            [{"goal": _arm_alone(), "duration": 1.0}],
            **{"group": "arm", "max_iterations": 2, "time_limit": 1.0, **quick},
        ),
        call(hovi.holding, robot(), {"frame": "forearm", "mass": 1.0, "shape": BALL}),
        call(hovi.plan_task, task, progress=None, intervals=2),
        call(hovi.save_task, task, folder() / "sequence.toml"),
    ]


def _period(**fields: Any) -> object:
    """A periodic goal of the arm's effort."""
    return hovi.TrajectoryProblem(problem().ld, hovi.State([0.0, 0.0]), hovi.Periodic(**fields))


def _ends_of_order_3(**fields: Any) -> object:
    """A state as an end of a motion of order 3."""
    ld = hovi.DiscreteLagrangian(hovi.spline(2, 3), hovi.Grid.uniform(1.0, N, galerkin(1, 3)))
    return hovi.TrajectoryProblem(ld, hovi.State([0.0, 0.0], **fields), hovi.State([0.3, 0.7]))


def _symbolic() -> list[Call]:
    body, scheme = hovi.symbolic.rigid_body(scene()), galerkin(1)
    return [
        *(
            call(getattr(hovi.symbolic, f), scene())
            for f in ("rigid_body", "torques", "lagrangian")
        ),
        call(hovi.symbolic.discrete_lagrangian, scene(), scheme, H),
        call(hovi.symbolic.euler_lagrange, hovi.spline(2), scheme, H),
        own(body, "frame_placement", "tip"),
        own(body, "frame_jacobian", "tip"),
    ]


def _flows() -> list[Call]:
    arm = scene().effort_lagrangian()
    mechanics = hovi.mechanics(scene())
    jet = np.array([[0.4, -0.3], [0.6, -0.8], [1.2, 0.5], [-2.0, 1.5]])
    x, p = legendre(arm, *jet)
    one = hovi.SchemeLagrangian(arm, by_name("galerkin-1"), H)
    exact = hovi.ExactDiscreteLagrangian(arm, H, tolerance=1e-8)
    segment = one.from_start(x[None], p[None])
    x1 = segment.x1[0]
    symbols = [ca.SX.sym(name, 2) for name in "qva"]
    turn = hovi.Symmetry(lambda q: ca.vertcat(-q[1], q[0]), 2)
    pushed = scene().effort_lagrangian()
    found = [
        build(hovi.SchemeLagrangian, lagrangian=arm, scheme=by_name("galerkin-1"), h=H),
        build(hovi.ExactDiscreteLagrangian, lagrangian=arm, h=H, tolerance=1e-8),
        call(hovi.SchemeLagrangian.of, hovi.DiscreteLagrangian(arm, problem().ld.grid)),
        build(hovi.CasadiLagrangian, jet=symbols, expression=ca.sumsqr(symbols[2]) / 2, space=None),
        call(hovi.spline, 2, derivatives=2),
        call(hovi.mechanics, scene()),
        call(hovi.riemannian_cubic, scene()),
        call(hovi.legendre, arm, *jet),
        call(hovi.hamiltonian, arm, x[None], p[None]),
        call(hovi.conjugate_time, hovi.spline(2), x, p, 0.2),
        call(hovi.variational_order, arm, by_name("galerkin-0"), [0.02, 0.01], *jet[:, None]),
        call(
            hovi.flow, one, x, p, 3, t0=0.0, force=False, tolerance=1e-6, symmetries={"turn": turn}
        ),
        call(hovi.discrete_hamiltonian_flow, one, x, p, "momentum"),
        call(hovi.discrete_lagrangian_map, one, x, x1),
        call(hovi.euler_lagrange_residual, one, x, x1, x1),
        call(hovi.regularity, one, x, x1),
        call(hovi.inverse_legendre_minus, one, x, p),
        call(hovi.inverse_legendre_plus, one, x, p),
        call(hovi.legendre_minus, one, x, x1),
        call(hovi.legendre_plus, one, x, x1),
        build(hovi.Symmetry, generator=lambda q: q, n=2),
        own(turn, "lift", x[None]),
        own(turn, "momentum", x[None], p[None]),
        own(turn, "defect", arm, *jet[:3, None]),
        call(hovi.base_translation, cart(), [1, 0, 0]),
        call(hovi.base_rotation, hovi.Scene(pendulum()), [0, -1, 0], point=[0, 0, 0]),
        call(hovi.simulate, scene(), [0.1, 0.0], 0.1, None, intervals=5, inner_modes=1),
        call(
            hovi.play,
            scene(),
            solution().trajectory,
            "none",
            **{"bandwidth": 10.0, "intervals": 8, "inner_modes": 1},
        ),
        *(own(mechanics, name, *jet[:2, None]) for name in ("value", "evaluate", "expand")),
        *(own(pushed, name, *jet[:3, None]) for name in ("value", "evaluate", "gradient")),
        own(pushed, "reweighted", np.ones(2)),
    ]
    for ld in (one, exact):
        found += [
            own(ld, "from_start", x[None], p[None], 0.0, None),
            own(ld, "from_end", x[None], p[None], 0.0),
            own(ld, "joining", x[None], x1[None], 0.0),
            own(ld, "value", x[None], x1[None]),
            own(ld, "between", x[None], segment.w, 0.0),
        ]
    return found


def _groups() -> list[Call]:
    """Mechanics of a plane body with a turning joint: L_d between points, symmetries, a problem."""
    space = ConfigurationSpace(("SE(2)", "SO(2)"))
    q, v = ca.SX.sym("q", 6), ca.SX.sym("v", 4)
    L = hovi.CasadiLagrangian([q, v], ca.sumsqr(v) / 2 + q[2] + ca.sin(q[4]), space)
    grid = hovi.Grid.uniform(1.0, N, galerkin(1, 1))
    ld = hovi.DiscreteLagrangian(L, grid)
    one = hovi.ChartedLagrangian(L, space, galerkin(1, 1), H)
    x = np.array([[0.1, 0.2, 1.0, 0.0, 0.0, 1.0]])
    p = np.array([[0.3, -0.2, 0.4, 0.5]])
    segment = one.from_start(x[None], p[None])
    x1 = segment.x1[0]
    slide = hovi.Symmetry(lambda q: ca.vertcat(q[2], -q[3], 0, 0), 4, space)
    ends = hovi.State(x[0]), hovi.State(x1[0], free=["q[3]"])
    path = hovi.TrajectoryProblem(ld, *ends).guess("cubic")
    found = [
        build(hovi.ChartedLagrangian, lagrangian=L, space=space, scheme=galerkin(1, 1), h=H),
        call(hovi.ChartedLagrangian.of, ld),
        build(hovi.TrajectoryProblem, ld=ld, start=ends[0], goal=ends[1]),
        *(own(ld, name, path) for name in ("values", "action", "gradient", "derivatives")),
        build(hovi.Symmetry, generator=lambda q: ca.vertcat(q[2], -q[3], 0, 0), n=4, space=space),
        own(slide, "lift", x[None]),
        own(slide, "momentum", x[None], p[None]),
        own(slide, "defect", L, x, p),
        call(hovi.flow, one, x, p, 3, symmetries={"slide": slide}),
        call(hovi.discrete_hamiltonian_flow, one, x, p, "plus"),
        call(hovi.regularity, one, x, x1),
        call(hovi.conjugate_time, L, x, p, 0.2),
        call(hovi.variational_order, L, galerkin(0, 1), [0.03, 0.02, 0.01], x, p),
        own(hovi.ExactDiscreteLagrangian(L, H), "joining", x[None], x1[None], 0.0),
    ]
    for name, arguments in {
        "from_start": (x[None], p[None], 0.0, None),
        "from_end": (x1[None], p[None], 0.0),
        "joining": (x[None], x1[None], 0.0),
        "between": (x[None], segment.w, 0.0),
        "value": (x[None], x1[None]),
    }.items():
        found.append(own(one, name, *arguments))
    return found


def _studies() -> list[Call]:
    values = {"field": "duration", "values": [1.0, 1.1]}
    study = hovi.Study(hovi.example("two_link_reach"), [values])
    toml, out = folder() / "study.toml", folder() / "study"
    toml.write_text('scene = "two_link_reach"\n')
    made = [
        build(
            hovi.Study,
            scene="two_link_reach",
            vary=[values],
            **{"seed": 0, "warm": False, "motions": True, "samples": 0, "sample_format": "zarr"},
        ),
        call(hovi.Study.read, toml),
    ]
    if find_spec("pyarrow") is None or find_spec("pandas") is None:
        return made  # of the extra `study`
    study.run(out)
    return [
        *made,
        own(study, "run", out, 1, scheduler=None, replace=False, progress=None),
        *(call(load, out) for load in (hovi.Study.load, hovi.Study.load_runs)),
        call(hovi.Study.motion, out, study.cells.key(0), package_dirs=()),
    ]


def _resting(name: str) -> hovi.Trajectory:
    """A motion of an arm from rest to rest."""
    scene = hovi.Scene(hovi.load_robot(name))
    start = np.full(scene.robot.nv, 0.01)
    cubic = Cubic.resting(start, start, 0.5)
    return cubic_motion(scene, 0.5, ["galerkin-2"] * 2, cubic=cubic)[0]


def _files() -> list[Call]:
    trajectory = solution().trajectory
    npz, toml = folder() / "motion.npz", folder() / "task.toml"
    trajectory.save(npz)
    task = hovi.Task(scene(), hovi.State([0.0, 0.0]), hovi.State([0.3, 0.7]), 1.0)
    hovi.save_task(task, toml)
    return [
        own(task, "require_one_motion", "a test"),
        own(trajectory, "save", npz, meshes=True),
        call(hovi.Trajectory.load, npz, package_dirs=()),
        call(hovi.load_task, toml),
        call(hovi.save_task, task, toml),
        call(hovi.write_csv, trajectory, folder() / "motion.csv", rate=100.0),
        call(
            *(hovi.export, [trajectory], folder() / "all.csv", "csv"),
            **{"rate": 50.0, "efforts": False, "gap": 0.0, "lookahead_time": None, "gain": None},
        ),
        own(trajectory, "to_robot_trajectory", folder() / "robot.json", 50.0),
        own(
            *(_resting("ur5"), "to_urscript", folder() / "all.script", 50.0),
            **{"lookahead_time": 0.1, "gain": 300.0},
        ),
        own(_resting("panda"), "to_franka", folder() / "franka.csv", 1000.0),
        own(trajectory, "to_numpy", folder() / "all.npz", 50.0),
        own(trajectory, "to_joint_trajectory", folder() / "all.json", 50.0, efforts=True),
        own(trajectory, "to_mcap", folder() / "all.mcap", 50.0),
        own(trajectory, "to_mujoco", folder() / "all.xml", 50.0),
        call(hovi.plot, trajectory, folder() / "motion.svg", compare=[trajectory]),
        call(
            hovi.replay,
            trajectory,
            **{"speed": 1.0, "loop": False, "trace": False, "open_browser": False},
            **{"html": folder() / "motion.html", "announce": print, "compare": [trajectory]},
        ),
        call(hovi.write_report, trajectory, folder() / "report.html"),
    ]


# The fuzzer


def mutate(random: Random) -> Mutant:
    """A call: its name, where another argument is given, and which, as JSON."""
    name = random.choice([name for name, each in calls().items() if each.places])
    place = random.choice(calls()[name].places)
    return Mutant(json.dumps([name, place, random.randrange(len(WRONG))]).encode())


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Call it. Bytes that are not such a call are nothing to judge, and refused."""
    try:
        name, place, number = json.loads(mutant.content)
        number = int(number) % len(WRONG)
        known = place in calls()[name].places
    except (ValueError, TypeError, LookupError, OverflowError, RecursionError):
        known = False
    return verdict_on(name, place, number) if known else (Verdict.REFUSED, "not a call")


def verdict_on(name: str, place: int | str, number: int) -> tuple[Verdict, str]:
    """The verdict on a valid call with another argument."""
    value = WRONG[number]
    meaningless = any(value is each for each in NEVER)
    reason = f"{value!r} was accepted" if meaningless else ""
    changed = calls()[name].replaced(place, value)
    found, why = judge(changed, lambda result: "", reason)
    return found, f"{name}, {place}: {why}"
