"""Robots with joints on groups and random bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

BASES = {
    "free-flyer": pin.JointModelFreeFlyer,
    "spherical": pin.JointModelSpherical,
    "planar": pin.JointModelPlanar,
    "continuous": pin.JointModelRUBZ,
}


def chain(joints: Sequence[pin.JointModel], seed: int = 3) -> pin.Model:
    """A chain of joints j0, j1, ... with random bodies of about unit size between them."""
    random = np.random.default_rng(seed)
    model = pin.Model()
    model.name = "chain"
    parent = 0
    for i, joint in enumerate(joints):
        turn = pin.exp3(random.uniform(-1, 1, 3))
        parent = model.addJoint(parent, joint, pin.SE3(turn, random.uniform(-1, 1, 3)), f"j{i}")
        root = random.uniform(-1, 1, (3, 3))
        body = pin.Inertia(1.0, random.uniform(-0.3, 0.3, 3), root @ root.T + 0.3 * np.eye(3))
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
        frame = pin.Frame(f"b{i}", parent, 0, pin.SE3.Identity(), pin.FrameType.BODY)
        model.addFrame(frame)
    return model


def with_arm(base: str, seed: int = 3) -> pin.Model:
    """A base with three joints: revolute, continuous and prismatic."""
    arm = [pin.JointModelRX(), pin.JointModelRUBY(), pin.JointModelPZ()]
    return chain([BASES[base](), *arm], seed)


def mimicking() -> pin.Model:
    """Two joints, of which the last mimics the first."""
    model = chain([pin.JointModelRX(), pin.JointModelRX()])
    model.names[2] = "last"
    return pin.transformJointIntoMimic(model, 1, 2, 1.0, 0.0)


def half_turning() -> pin.Model:
    """Two continuous joints, of which the last mimics the first with multiplier 1/2."""
    model = chain([pin.JointModelRUBX(), pin.JointModelRUBX()])
    model.names[2] = "last"
    return pin.transformJointIntoMimic(model, 1, 2, 0.5, 0.0)


def revolute(model: pin.Model) -> pin.Model:
    """The model with a revolute joint about the same axis for each continuous one."""
    twin = pin.Model()
    twin.name = "revolute"
    for i in range(1, model.njoints):
        joint = model.joints[i]
        if joint.nq != joint.nv:
            data = joint.createData()
            joint.calc(data, pin.neutral(model))
            joint = pin.JointModelRevoluteUnaligned(np.array(data.S).ravel()[3:])
        place, parent = model.jointPlacements[i], model.parents[i]
        twin.addJoint(parent, joint, place, str(model.names[i]))
        twin.appendBodyToJoint(i, model.inertias[i], pin.SE3.Identity())
    twin.armature = np.array(model.armature)
    twin.gravity = model.gravity
    return twin


def rigid_body(inertia: Sequence[float], joint: pin.JointModel | None = None) -> Robot:
    """A body that rotates freely about its centre of mass, with given principal moments."""
    model = pin.Model()
    model.name = "body"
    index = model.addJoint(0, joint or pin.JointModelSpherical(), pin.SE3.Identity(), "turn")
    body = pin.Inertia(1.0, np.zeros(3), np.diag(np.asarray(inertia, dtype=float)))
    model.appendBodyToJoint(index, body, pin.SE3.Identity())
    return load_robot(model)


def configurations(robot: Robot, count: int, seed: int = 0, size: float = 1.0) -> Array:
    """Random configurations, shape (count, nq)."""
    d = np.random.default_rng(seed).normal(size=(count, robot.nv))
    return robot.integrate(robot.neutral(), size * d)
