"""Rebuilds a Pinocchio model with its joints reordered or replaced."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
import pinocchio as pin

Array = npt.NDArray[np.float64]

PER_VELOCITY = (
    "armature",
    "damping",
    "rotorInertia",
    "rotorGearRatio",
    "lowerEffortLimit",
    "upperEffortLimit",
    "lowerVelocityLimit",
    "upperVelocityLimit",
    "lowerDryFrictionLimit",
    "upperDryFrictionLimit",
)
"""Attributes of a model with one entry per velocity."""
PER_CONFIGURATION = ("lowerPositionLimit", "upperPositionLimit")
"""Attributes with one entry per coordinate of q."""

Replacement = Callable[[pin.JointModel], pin.JointModel]


def rebuilt(model: pin.Model, order: Sequence[int], replacement: Replacement) -> pin.Model:
    """The same bodies and frames with the joints in another order, each after its parent.

    order: Pinocchio's indices of all joints but the universe, depth first.
    replacement: returns the joint that replaces a joint. Joints that keep their dimension keep
        their limits, armature, damping and friction; others get the defaults.
    """
    built = pin.Model()
    built.name, built.gravity = model.name, model.gravity
    new_index = {0: 0}
    for index in order:
        joint = replacement(model.joints[index])
        at = new_index[model.parents[index]], joint, model.jointPlacements[index]
        new_index[index] = built.addJoint(*at, str(model.names[index]))
        built.appendBodyToJoint(new_index[index], model.inertias[index], pin.SE3.Identity())
    for frame in list(model.frames)[1:]:
        joint = new_index[frame.parentJoint]
        parts = frame.name, joint, frame.parentFrame, frame.placement, frame.type, frame.inertia
        built.addFrame(pin.Frame(*parts), False)
    _copy_numbers(model, built, new_index)
    return built


def axis(joint: pin.JointModel) -> tuple[Array, Array]:
    """The axis of a joint with one velocity, in its own frame: linear and angular, each (3,)."""
    data = joint.createData()
    q = np.zeros(joint.idx_q + 2)
    q[joint.idx_q] = float(joint.nq == 2)  # (cos, sin) of 0
    joint.calc(data, q)
    S = np.array(data.S).reshape(6)
    return S[:3], S[3:]


def continuous_joint(about: Array) -> pin.JointModel:
    """A continuous joint about any axis (3,); in Python it can only be created from a URDF."""
    numbers = " ".join(repr(float(x)) for x in about)
    return pin.buildModelFromXML(
        '<robot name="one"><link name="a"/><link name="b"/><joint name="j" type="continuous">'
        f'<parent link="a"/><child link="b"/><axis xyz="{numbers}"/></joint></robot>'
    ).joints[1]


def _copy_numbers(model: pin.Model, built: pin.Model, new_index: dict[int, int]) -> None:
    for keys, start, size in ((PER_VELOCITY, "idx_v", "nv"), (PER_CONFIGURATION, "idx_q", "nq")):
        for key in keys:
            values = np.array(getattr(built, key))
            for i_old, i_new in list(new_index.items())[1:]:
                old, new = model.joints[i_old], built.joints[i_new]
                count = getattr(new, size)
                if count == getattr(old, size):
                    i, j = getattr(old, start), getattr(new, start)
                    values[j : j + count] = np.array(getattr(model, key))[i : i + count]
            setattr(built, key, values)
