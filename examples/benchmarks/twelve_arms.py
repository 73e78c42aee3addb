"""Shared by benchmarks: twelve arms, and random reaches that can be held at both ends.

Nothing here needs more of hovi than what users import.
"""

from __future__ import annotations

import re

import numpy as np
import pinocchio as pin

import hovi

ALL_BUT_FINGERS = r"(?!.*(finger|[Gg]ripper)).*"
ARMS = {
    **dict.fromkeys(
        ("ur5", "ur10", "panda", "z1", "xarm7", "kinova", "talos_arm"), ALL_BUT_FINGERS
    ),
    "so100": r"(shoulder|elbow|wrist)_.*",
    "bravo7_no_ee": ALL_BUT_FINGERS,
    "tiago": r"arm_\d_joint",
    "baxter": r"left_[swe]\d",
    "alex_nub_hands": r"Left(?!Gripper).*",
}
"""Robots of example-robot-data, with a pattern of the joints that move; all others are locked."""
HOLDING_FRACTION = 0.9
"""Largest torque that holds a start or goal, as a fraction of its limit."""


def load(arm: str) -> hovi.Scene:
    """The arm under gravity, with all other joints locked."""
    names = list(hovi.load_robot(arm).model.names)[1:]
    locked = [name for name in names if not re.fullmatch(ARMS[arm], name)]
    return hovi.Scene(hovi.load_robot(arm, locked=locked), effects=[hovi.effects.Gravity()])


def reaches(scene: hovi.Scene, count: int, seed: int) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Start, goal and duration of every reach."""
    robot = scene.robot
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        start, goal = (_draw(robot, rng) for _ in range(2))
        slowness = rng.uniform(1.5, 3.0)
        torque = np.abs(_holding_torque(scene, np.array([start, goal])))
        if (torque <= HOLDING_FRACTION * robot.effort_limit).all():
            distance = np.abs(robot.difference(start, goal))
            T = slowness * np.max(distance / np.clip(robot.velocity_limit, 0.1, 10.0))
            found.append((start, goal, float(T)))
    return found


def _draw(robot: hovi.Robot, rng: np.random.Generator) -> np.ndarray:
    """A configuration within +-pi of the neutral one and within the limits."""
    model = robot.model
    angle = np.empty(model.nv)
    for joint in model.joints[1:]:
        bounds = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
        low, high = bounds if joint.nq == 1 else (-np.pi, np.pi)
        angle[joint.idx_v] = rng.uniform(max(low, -np.pi), min(high, np.pi))
    return np.asarray(pin.integrate(model, pin.neutral(model), angle))


def _holding_torque(scene: hovi.Scene, q: np.ndarray) -> np.ndarray:
    zero = np.zeros((len(q), scene.robot.nv))
    return scene.inverse_dynamics(q, zero, zero)
