"""A Pinocchio model built once more, with its joints in another order or of other kinds."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
import pinocchio as pin

Array = npt.NDArray[np.float64]

IN_V = (
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
"""What a model holds per velocity."""
IN_Q = ("lowerPositionLimit", "upperPositionLimit")
"""What it holds per number of q."""

Replacement = Callable[[pin.JointModel], pin.JointModel]


def rebuilt(model: pin.Model, order: Sequence[int], replacement: Replacement) -> pin.Model:
    """The same bodies and frames on joints in another order, each after the one that carries it.

    order: Pinocchio's indices of all joints but the universe, depth first.
    replacement: what takes the place of a joint. What is stated per coordinate (limits, armature,
        losses) goes along with joints that keep their size; others get none.
    """
    built = pin.Model()
    built.name, built.gravity = model.name, model.gravity
    places = {0: 0}
    for index in order:
        joint = replacement(model.joints[index])
        at = places[model.parents[index]], joint, model.jointPlacements[index]
        places[index] = built.addJoint(*at, str(model.names[index]))
        built.appendBodyToJoint(places[index], model.inertias[index], pin.SE3.Identity())
    for frame in list(model.frames)[1:]:
        joint = places[frame.parentJoint]
        parts = frame.name, joint, frame.parentFrame, frame.placement, frame.type, frame.inertia
        built.addFrame(pin.Frame(*parts), False)
    _copy_numbers(model, built, places)
    return built


def axis(joint: pin.JointModel) -> tuple[Array, Array]:
    """The motion of a joint of one velocity in its own frame: along and about, each (3,)."""
    data = joint.createData()
    q = np.zeros(joint.idx_q + 2)
    q[joint.idx_q] = float(joint.nq == 2)  # (cos, sin) of 0
    joint.calc(data, q)
    S = np.array(data.S).reshape(6)
    return S[:3], S[3:]


def continuous_joint(about: Array) -> pin.JointModel:
    """A continuous joint about any axis (3,): from Python, only a URDF makes one."""
    numbers = " ".join(repr(float(x)) for x in about)
    return pin.buildModelFromXML(
        '<robot name="one"><link name="a"/><link name="b"/><joint name="j" type="continuous">'
        f'<parent link="a"/><child link="b"/><axis xyz="{numbers}"/></joint></robot>'
    ).joints[1]


def _copy_numbers(model: pin.Model, built: pin.Model, places: dict[int, int]) -> None:
    for keys, start, size in ((IN_V, "idx_v", "nv"), (IN_Q, "idx_q", "nq")):
        for key in keys:
            values = np.array(getattr(built, key))
            for index, place in list(places.items())[1:]:
                old, new = model.joints[index], built.joints[place]
                count = getattr(new, size)
                if count == getattr(old, size):
                    i, j = getattr(old, start), getattr(new, start)
                    values[j : j + count] = np.array(getattr(model, key))[i : i + count]
            setattr(built, key, values)
