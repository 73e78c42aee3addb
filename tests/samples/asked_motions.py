"""Motions asked for in every way at once: one value of each axis.

A case is a robot, effects, limits, a goal, via points, a duration, a world, a grid, a number of
starts, a call, and a kind of arrays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import casadi as ca
import numpy as np

import hovi
from samples.pairwise import Case, Pair
from samples.small_robots import arm, with_shapes

Array = np.ndarray
TIME, STEPS = 1.25, 300


def two_link() -> hovi.Robot:
    return hovi.load_robot(hovi.example("two_link.urdf"))


ROBOTS: dict[str, Callable[[], hovi.Robot]] = {
    "two_link": two_link,
    "three joints": lambda: arm("three", ("revolute",) * 3),
    "continuous": lambda: arm("turning", ("revolute", "continuous")),
    "free-flyer": lambda: arm("flyer", ("revolute",) * 2, free_flyer=True),
    "passive": lambda: with_shapes("cart_pole.urdf"),
    "moving base": two_link,
}
PASSIVE = ("hinge",)
ROLLING = hovi.effects.MovingBase(position=("0.05*sin(3*t)", 0.0, 0.0), rotation=(0, "0.1*t", 0))


def _casadi_cost(nq: int, nv: int) -> ca.Function:
    q, v, a, tau = (ca.SX.sym(name, n) for name, n in zip("qvau", (nq, nv, nv, nv), strict=True))
    return ca.Function("C", [q, v, a, tau, ca.SX.sym("t")], [0.1 * ca.sumsqr(v)])


def effects_of(robot: hovi.Robot) -> dict[str, list[hovi.effects.Effect]]:
    """An effect of every kind for a robot."""
    e, tip = hovi.effects, robot.tip_frame
    joints = zip(list(robot.model.joints)[1:], list(robot.model.names)[1:], strict=True)
    plain = [name for joint, name in joints if joint.nq == joint.nv == 1]
    last = plain[-1]  # that has a position
    every: dict[str, list[hovi.effects.Effect]] = {
        "acceleration_cost": [e.AccelerationCost(0.01)],
        "armature": [e.Armature(0.05)],
        "casadi_cost": [e.CasadiCost(_casadi_cost(robot.nq, robot.nv))],
        "custom": [e.Custom({last: f'0.1*sin(v["{last}"])'}, f'0.1*v["{last}"]**2')],
        "drag": [e.Drag(tip, 0.05, wind=(0.0, 2.0, 0.0))],
        "dry_friction": [e.DryFriction(0.1, width=0.2)],
        "effort_weight": [e.EffortWeight({last: 2.0})],
        "effort_matrix": [e.EffortWeight(matrix=(2.0 * np.eye(robot.nv) + 0.1).tolist())],
        "jerk_cost": [e.JerkCost(1e-4)],
        "joint_limit_potential": [e.JointLimitPotential({last: (-2.0, 2.0)}, 10.0, 0.05)],
        "joint_springs": [e.JointSprings({last: 1.0}, {last: 0.0})],
        "moving_base": [ROLLING],
        "payload": [e.Payload(tip, 0.3)],
        "power_cost": [e.PowerCost(0.1, 0.5)],
        "reference_cost": [e.ReferenceCost({last: 0.2}, 1.0)],
        "running_cost": [e.RunningCost({"drives": "0.01*dot(tau, tau)"})],
        "velocity_cost": [e.VelocityCost(0.1)],
        "viscous_friction": [e.ViscousFriction(0.1)],
        "wrench": [e.Wrench(tip, (0.0, 0.0, -1.0))],
    }
    return every


GROUPS: dict[str, tuple[str, ...]] = {
    "nothing": (),
    "gravity": (),
    "rotors": ("armature", "viscous_friction"),
    "joints": ("dry_friction", "joint_springs"),
    "tool": ("payload", "drag"),
    "forces": ("wrench", "custom"),
    "rates": ("acceleration_cost", "velocity_cost", "power_cost"),
    "costs": ("effort_weight", "running_cost", "reference_cost"),
    "matrix": ("effort_matrix", "casadi_cost", "joint_limit_potential"),
    "jerk": ("jerk_cost",),
    "rolling": ("moving_base",),
}
"""Effects that act together, so that there are fewer combinations. Gravity is with all but one."""


def chosen_effects(robot: hovi.Robot, name: str) -> list[hovi.effects.Effect]:
    """Those of a group, or of one kind alone."""
    every = effects_of(robot)
    found = [each for kind in GROUPS.get(name, (name,)) for each in every[kind]]
    return found if name == "nothing" else [hovi.effects.Gravity(), *found]


RIGID_ALONE = {
    *(
        "nothing",
        "gravity",
        "rates",
        "costs",
        "matrix",
        "jerk",
        "acceleration_cost",
        "casadi_cost",
        "effort_weight",
        "effort_matrix",
    ),
    *("jerk_cost", "joint_limit_potential", "power_cost", "reference_cost", "running_cost"),
    *("velocity_cost",),
}
"""Effects that change no torque."""


def reversed_view(x: Array) -> Array:
    return np.array(x[::-1])[::-1]


def _read_only(x: Array) -> Array:
    copy = x.copy()
    copy.setflags(write=False)
    return copy


def _as_integers(x: Array) -> Array:
    whole = bool((x == np.round(x)).all())
    return x.astype(np.int64) if whole else x


ARRAYS: dict[str, Callable[[Array], Any]] = {
    "list": lambda x: x.tolist(),
    "tuple": lambda x: tuple(x.tolist()),
    "reversed": reversed_view,
    "strided": lambda x: np.repeat(x, 2)[::2],
    "read-only": _read_only,
    "single": lambda x: x.astype(np.float32),
    "integers": _as_integers,
    "other bytes": lambda x: x.astype(">f8"),
    "unmasked": lambda x: np.ma.array(x, mask=np.zeros(len(x), bool)),
}
AXES: dict[str, tuple[str, ...]] = {
    "robot": tuple(ROBOTS),
    "effect": tuple(GROUPS),
    "limits": ("urdf", "none", "own", "margin"),
    "smooth": ("no", "yes"),
    "goal": (
        *("configuration", "state", "dict", "position", "pose", "axis", "free"),
        *("periodic", "segments"),
    ),
    "via": ("none", "configuration", "frame"),
    "duration": ("fixed", "text", "free"),
    "world": ("empty", "obstacle", "moving obstacle", "self-collision"),
    "grid": ("default", "tolerance", "intervals", "scheme"),
    "starts": ("1", "2"),
    "call": ("plan", "replan", "advance", "sample", "simulate", "study"),
    "arrays": tuple(ARRAYS),
}


USUAL = {
    **{"robot": "three joints", "effect": "gravity", "limits": "urdf", "smooth": "no"},
    **{"goal": "configuration", "via": "none", "duration": "fixed", "world": "empty"},
    **{"grid": "intervals", "starts": "1", "call": "plan", "arrays": "list"},
}
"""A value of each axis that goes with all others."""
REFUSED: tuple[tuple[str, str, str, str], ...] = (
    *(("via", via, "goal", "periodic") for via in ("configuration", "frame")),
    *(("goal", "periodic", "robot", name) for name in ("passive", "continuous", "free-flyer")),
    *(("robot", "free-flyer", *other) for other in (("smooth", "yes"), ("effect", "jerk"))),
    ("robot", "free-flyer", "effect", "rolling"),
    ("smooth", "yes", "effect", "jerk"),
    *(
        ("robot", name, "world", "self-collision")
        for name in ("two_link", "moving base", "passive")
    ),
)
"""Pairs of values that are refused, whatever the others are."""
LEFT_OUT: set[Pair] = {frozenset([(a, x), (b, y)]) for a, x, b, y in REFUSED}


@cache
def robot_of(name: str) -> hovi.Robot:
    return ROBOTS[name]()


@dataclass(frozen=True)
class Asked:
    """What a case asks for. q0, q1: ends. middle: between them. d: from q0 to q1."""

    case: Case

    @property
    def robot(self) -> hovi.Robot:
        return robot_of(self.case["robot"])

    @property
    def scene(self) -> hovi.Scene:
        robot, effects = self.robot, chosen_effects(self.robot, self.case["effect"])
        if self.case["robot"] == "moving base" and ROLLING not in effects:
            effects.append(ROLLING)
        passive = PASSIVE if self.case["robot"] == "passive" else ()
        return hovi.Scene(robot, effects, passive=passive, compile=False)

    @property
    def d(self) -> Array:
        """In eighths, which single precision keeps."""
        if self.case["robot"] == "passive":
            return np.array([0.5, 0.0])
        return np.where(np.arange(self.robot.nv) % 2 == 0, 0.25, -0.375)

    @property
    def q0(self) -> Array:
        return self.robot.neutral()

    @property
    def q1(self) -> Array:
        exact = self.robot.integrate(self.q0, self.d)
        return exact.astype(np.float32).astype(float) if self.robot.nq == self.robot.nv else exact

    @property
    def middle(self) -> Array:
        return self.robot.integrate(self.q0, 0.5 * self.d)

    def array(self, x: Array) -> Any:
        """Numbers as the kind of arrays of the case; not as single precision of unit norms."""
        kind = self.case["arrays"]
        if kind == "single" and self.robot.nq != self.robot.nv:
            kind = "reversed"
        return ARRAYS[kind](np.array(x, dtype=float))

    @property
    def limits(self) -> Any:
        own = {"base": "none", "v": 4.0, "tau": 80.0}
        return {"own": own, "margin": {"margin": 0.1}}.get(self.case["limits"], self.case["limits"])

    @property
    def bounds(self) -> Iterator[tuple[str, Array, Array]]:
        """(kind, lower, upper), of q by entry, of v and tau by coordinate."""
        model, kind = self.robot.model, self.case["limits"]
        nq, nv = model.nq, model.nv
        if kind == "none":
            return
        if kind == "own":
            yield "v", np.full(nv, -4.0), np.full(nv, 4.0)
            yield "tau", np.full(nv, -80.0), np.full(nv, 80.0)
            return
        lower, upper = np.full(nq, -np.inf), np.full(nq, np.inf)
        for joint in list(model.joints)[1:]:
            if joint.nq == joint.nv == 1:
                lower[joint.idx_q] = model.lowerPositionLimit[joint.idx_q]
                upper[joint.idx_q] = model.upperPositionLimit[joint.idx_q]
        share = 0.1 if kind == "margin" else 0.0  # at each end
        fastest, strongest = model.velocityLimit, model.effortLimit
        rates = ("v", -fastest, fastest), ("tau", -strongest, strongest)
        for name, low, high in (("q", lower, upper), *rates):
            limited = (high > low) & (high < 1e15) & (low > -1e15)
            low, high = np.where(limited, low, -np.inf), np.where(limited, high, np.inf)
            room = share * np.where(limited, high, 0.0) - share * np.where(limited, low, 0.0)
            yield name, low + room, high - room

    @property
    def goal(self) -> Any:
        robot, q1, last = self.robot, self.q1, self.robot.coordinate_names[-1]
        kind, tip = self.case["goal"], robot.tip_frame
        pose = robot.frame_pose(tip, q1)
        if kind == "state":
            return hovi.State(self.array(q1), self.array(0.125 * np.sign(self.d)))
        if kind == "dict":
            return self._table(q1)
        if kind == "position":
            return hovi.FrameGoal(tip, position=self.array(pose[:3, 3]))
        if kind == "pose":
            return hovi.FrameGoal(tip, pose=np.asfortranarray(pose))
        if kind == "axis":
            return hovi.FrameGoal(tip, axis=(self.array(np.eye(3)[0]), self.array(pose[:3, 0])))
        if kind == "free":
            return hovi.State(self.array(q1), free=(last,), free_velocity=(last,))
        if kind == "periodic":
            return hovi.Periodic(self.array(np.zeros(robot.nv)))
        return self.array(q1)

    def _table(self, q: Array) -> dict[str, Any]:
        model = self.robot.model
        joints = zip(list(model.names)[1:], list(model.joints)[1:], strict=True)
        return {
            name: q[j.idx_q : j.idx_q + j.nq].tolist() if j.nq > 1 else float(q[j.idx_q])
            for name, j in joints
        }

    @property
    def options(self) -> dict[str, Any]:
        ball = hovi.Sphere(self.array(np.array([0.0, 4.0, 4.0])), 0.25, name="ball")
        path = {"times": [0.0, 5.0], "positions": [[0.0, 0.0, 0.0], [0.0, 0.5, 0.0]]}
        worlds: dict[str, dict[str, Any]] = {
            "empty": {"self_collision": False},
            "obstacle": {"obstacles": [ball], "self_collision": False},
            "moving obstacle": {
                "obstacles": [hovi.Sphere([0.0, 4.0, 4.0], 0.25, path=path, name="ball")],
                "self_collision": False,
            },
            "self-collision": {"self_collision": True},
        }
        grids: dict[str, dict[str, Any]] = {
            "default": {},
            "tolerance": {"tolerance": 1e-2},
            "intervals": {"intervals": 8},
            "scheme": {"scheme": "galerkin-2x8", "intervals": 6},
        }
        chosen = {
            **{"limits": self.limits, "starts": int(self.case["starts"]), "processes": 1},
            **{"smooth": self.case["smooth"] == "yes", "max_iterations": STEPS},
            "continuation": False,
            **worlds[self.case["world"]],
            **grids[self.case["grid"]],
        }
        if self.case["duration"] == "free":
            chosen["time_weight"] = 30.0
        tip, middle = self.robot.tip_frame, self.middle
        if self.case["via"] == "configuration":
            chosen["via"] = [hovi.Via(TIME / 2, hovi.State(self.array(middle)))]
        if self.case["via"] == "frame":
            at = self.array(self.robot.frame_position(tip, middle))
            chosen["via"] = [{"time": "625 ms", "frame": tip, "position": at}]
        return chosen

    @property
    def duration(self) -> Any:
        texts = {"fixed": TIME, "text": "1250 ms", "free": (0.6 * TIME, 2.0 * TIME)}
        return texts[self.case["duration"]]


def planned(asked: Asked) -> hovi.Solution:
    """The first motion of a case."""
    scene, start = asked.scene, asked.array(asked.q0)
    if asked.case["goal"] == "periodic":
        return _period(asked)
    if asked.case["goal"] == "segments":
        middle = {"goal": asked.array(asked.middle), "duration": 0.5 * TIME}
        last = hovi.Segment(asked.goal, asked.duration, effects=[hovi.effects.VelocityCost(0.01)])
        return hovi.plan_sequence(scene, start, [middle, last], **asked.options)
    return hovi.plan(scene, start, asked.goal, asked.duration, **asked.options)


def _period(asked: Asked) -> hovi.Solution:
    """A period, with what a problem takes of the options."""
    scheme = hovi.schemes.galerkin(2, derivatives=asked.scene.order, points=8)
    grid = hovi.Grid.uniform(TIME, 8, scheme)
    ld = hovi.DiscreteLagrangian(asked.scene.effort_lagrangian(), grid)
    limits = hovi.as_limits(asked.robot, asked.limits, asked.scene.order)
    start = hovi.State(asked.array(asked.q0), asked.array(0.25 * np.sign(asked.d)))
    via = hovi.PlanOptions(**asked.options).via
    return hovi.solve(hovi.TrajectoryProblem(ld, start, asked.goal, limits=limits, via=via))
