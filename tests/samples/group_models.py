"""Pinocchio models with one joint, one model per group."""

from __future__ import annotations

import pinocchio as pin

from hovi.robot.space.groups import Group

JOINTS = {
    "SO(2)": pin.JointModelRUBZ(),
    "SE(2)": pin.JointModelPlanar(),
    "SO(3)": pin.JointModelSpherical(),
    "SE(3)": pin.JointModelFreeFlyer(),
}


def model_of(group: Group) -> pin.Model:
    model = pin.Model()
    model.addJoint(0, JOINTS[group.name], pin.SE3.Identity(), "j")
    return model
