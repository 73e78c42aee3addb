"""Motions asked for with two features at once, of 22: what is planned, and what is done with it.

Each feature is one setting of a motion of a small arm; those of a pair act together, on the least
robot that has both.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin

import hovi
from hovi.system.dataclass import dataclass
from samples.asked_motions import TIME, USUAL, Array, Asked
from samples.small_robots import BALL, LENGTH, RADIUS, arm, with_shapes

SETTINGS: dict[str, dict[str, str]] = {
    "limits": {"limits": "urdf"},
    "smooth": {"smooth": "yes"},
    "free duration": {"duration": "free"},
    "via": {"via": "configuration"},
    "frame goal": {"goal": "position"},
    "obstacle": {},
    "moving obstacle": {},
    "self-collision": {},
    "segments": {},
    "time-dependent effect": {},
    "cost": {},
    "grasped": {},
    "starts": {"starts": "2"},
    "tolerance": {"grid": "tolerance"},
    "replan": {},
    "advance": {},
    "friction": {},
    "free velocity": {},
    "payload": {},
    "free-flyer": {},
    "continuous joints": {},
    "passive joint": {"robot": "passive"},
}
"""The axes of `Asked` that a feature sets; the others are read from the features themselves."""
FEATURES = tuple(SETTINGS)
PAIRS = tuple(itertools.combinations(FEATURES, 2))
ROBOT_FEATURES = "free-flyer", "continuous joints", "passive joint"
ROBOTS: dict[tuple[str, ...], Callable[[], hovi.Robot]] = {
    (): lambda: arm("three", ("revolute",) * 3),
    ("free-flyer",): lambda: arm("flyer", ("revolute",) * 2, free_flyer=True),
    ("continuous joints",): lambda: arm("turning", ("revolute", "continuous")),
    ("passive joint",): lambda: with_shapes("cart_pole.urdf", "rail", 0.3),
    ("free-flyer", "continuous joints"): lambda: arm(
        "turning_flyer", ("revolute", "continuous"), free_flyer=True
    ),
    ("free-flyer", "passive joint"): lambda: arm("flyer", ("revolute",) * 2, free_flyer=True),
    ("continuous joints", "passive joint"): lambda: arm("turning", ("revolute", "continuous")),
}
SCHEME, INTERVALS = "galerkin-2x8", 16
"""With fewer points the quadrature of the effort on a floating base is rough."""
MARGIN, GAP, OBSTACLE = 0.01, 0.005, 0.05
"""Distance to keep, room that the middle of a motion has beyond it, radius of obstacles, in [m]."""
HELD_MASS, HELD_RADIUS = 0.2, 0.03
VISCOUS, COULOMB, WIDTH, LOAD = 0.1, 0.1, 0.2, 0.3
WRENCH = ("2*sin(4*t)", 0.0, "-1.5*cos(3*t)")
FLIGHT = 0.5
"""Length of the way of the moving obstacle in the time of a motion, in [m]."""


@cache
def robot_with(features: tuple[str, ...]) -> hovi.Robot:
    """The least robot with some of ROBOT_FEATURES."""
    return ROBOTS[features]()


@dataclass(frozen=True, eq=False)
class AskedFeatures(Asked):
    """What a motion with some features is asked for; see `Asked`."""

    features: tuple[str, ...] = ()

    @classmethod
    def of(cls, *features: str) -> AskedFeatures:
        """The motion with these features."""
        case = {**USUAL, "limits": "none"}
        for each in features:
            case |= SETTINGS[each]
        return cls(case, features)

    def has(self, feature: str) -> bool:
        """Whether it is one of the features."""
        return feature in self.features

    @property
    def robot(self) -> hovi.Robot:
        return robot_with(tuple(each for each in ROBOT_FEATURES if self.has(each)))

    @property
    def sequence(self) -> bool:
        return self.has("segments")

    @property
    def aim(self) -> str:
        """The frame of the goal: not the tip of a pole, which no turn raises where it hangs."""
        return "cart" if self.robot.name == "cart_pole" else self.robot.tip_frame

    @property
    def last_coordinate(self) -> str:
        return str(self.robot.coordinate_names[-1])

    @property
    def scene(self) -> hovi.Scene:
        e, tip = hovi.effects, self.robot.tip_frame
        chosen: dict[str, list[hovi.effects.Effect]] = {
            "time-dependent effect": [e.Wrench(tip, WRENCH)],
            "cost": [e.RunningCost({"rates": "0.1*dot(v, v)"}), e.AccelerationCost(0.01)],
            "friction": [e.ViscousFriction(VISCOUS), e.DryFriction(COULOMB, width=WIDTH)],
            "payload": [e.Payload(tip, LOAD)],
        }
        effects = [each for name, these in chosen.items() if self.has(name) for each in these]
        passive = [self.robot.model.names[-1]] if self.has("passive joint") else []
        return hovi.Scene(self.robot, [e.Gravity(), *effects], passive=passive)

    @property
    def d(self) -> Array:
        if self.has("passive joint"):
            d = np.where(np.arange(self.robot.nv) % 2 == 0, 0.25, -0.375)
            return np.where(np.arange(self.robot.nv) == self.robot.nv - 1, 0.0, d)
        return super().d

    @property
    def goal(self) -> Any:
        free = (self.last_coordinate,) if self.has("free velocity") else ()
        if self.has("frame goal"):
            at = self.robot.frame_position(self.aim, self.q1)
            return hovi.FrameGoal(self.aim, position=at, free_velocity=free, guess=self.q1)
        return hovi.State(self.q1, free_velocity=free)

    @property
    def via_time(self) -> float:
        return TIME if self.sequence else 0.5 * TIME

    @property
    def via_configuration(self) -> Array:
        return self.robot.integrate(self.q0, (0.75 if self.sequence else 0.5) * self.d)

    @property
    def options(self) -> dict[str, Any]:
        chosen = {**super().options, "obstacles": self.obstacles, "margin": MARGIN}
        chosen["self_collision"] = self.has("self-collision")
        if not self.has("tolerance"):
            chosen |= {"scheme": SCHEME, "intervals": INTERVALS}
        if self.has("via"):
            chosen["via"] = [hovi.Via(self.via_time, hovi.State(self.via_configuration))]
        if self.has("grasped"):
            ball = hovi.Sphere([0.0, 0.0, 0.0], HELD_RADIUS)
            held = hovi.Grasped(ball, self.robot.tip_frame, HELD_MASS, position=self.held_at)
            chosen["grasped"] = [held]
        return chosen

    @property
    def held_at(self) -> Array:
        """Where the tip's link holds the ball that is grasped, in [m]."""
        return np.array([0.0, 0.0, -0.1] if self.robot.name == "cart_pole" else [LENGTH, 0, 0])

    @property
    def obstacles(self) -> list[hovi.Sphere]:
        """A ball next to the way of the last ball of the arm, and one that passes there."""
        found: list[hovi.Sphere] = []
        if self.has("obstacle"):
            found.append(hovi.Sphere(self._near, OBSTACLE, name="ball"))
        if self.has("moving obstacle"):
            ends = [self._flown(0.0), self._flown(4.0)]
            path = {"times": [0.0, 4.0 * TIME], "positions": ends}
            found.append(hovi.Sphere(self._near, OBSTACLE, path=path, name="drone"))
        return found

    def obstacles_at(self, t: float) -> list[Array]:
        """Where the balls of `obstacles` are at a time, in [m]."""
        still = [self._near] if self.has("obstacle") else []
        drone = [self._near + self._flown(t / TIME)] if self.has("moving obstacle") else []
        return still + drone

    @property
    def _near(self) -> Array:
        """The center of a ball nearly at the arm's last one halfway, in [m], across its way."""
        far = self.radius + OBSTACLE + MARGIN + GAP
        return self.balls(self.middle)[-1][1] + far * self._axes[2]

    def _flown(self, time: float) -> Array:
        """Way of the moving ball from halfway to a fraction of TIME, in [m]: against the arm."""
        return (0.5 - time) * FLIGHT * self._axes[0]

    @property
    def _axes(self) -> Array:
        """Unit vectors (3, 3) halfway: of the last ball's way, to its outside, across both."""
        first, middle, last = (self.balls(q)[-1][1] for q in (self.q0, self.middle, self.q1))
        way = (last - first) / np.linalg.norm(last - first)
        bend = middle - 0.5 * (first + last)
        bend -= (bend @ way) * way
        outside = bend / np.linalg.norm(bend) if np.linalg.norm(bend) > 1e-9 else np.eye(3)[1]
        return np.stack([way, outside, np.cross(way, outside)])

    @property
    def radius(self) -> float:
        return BALL if self.robot.name == "cart_pole" else RADIUS

    def balls(self, q: Array) -> list[tuple[str, Array, float]]:
        """(link, center, radius) of the arm's collision shapes, without what is grasped."""
        model, data = self.robot.model, self.robot.model.createData()
        pin.framesForwardKinematics(model, data, q)
        poses = {frame.name: data.oMf[i] for i, frame in enumerate(model.frames)}
        if self.robot.name == "cart_pole":
            at = {"rail": [0, 0, 0.3], "cart": [0, 0, 0], "pole": [0, 0, 0]}
        else:
            at = {
                name: [LENGTH / 2, 0, 0] for name in poses if name[0] == "l" and name[1:].isdigit()
            }
        return [(name, poses[name].act(np.array(x, float)), self.radius) for name, x in at.items()]


def planned_with(asked: AskedFeatures) -> hovi.Solution:
    """The first motion."""
    scene, options = asked.scene, asked.options
    if not asked.sequence:
        return hovi.plan(scene, asked.q0, asked.goal, asked.duration, **options)
    half = (0.25 * TIME, TIME) if asked.has("free duration") else 0.5 * TIME
    free = (asked.last_coordinate,) if asked.has("free velocity") else ()
    middle = hovi.Segment(hovi.State(asked.middle, free_velocity=free), half)
    last = hovi.Segment(asked.goal, asked.duration, effects=[hovi.effects.VelocityCost(0.01)])
    return hovi.plan_sequence(scene, asked.q0, [middle, last], **options)
