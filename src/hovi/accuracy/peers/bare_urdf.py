"""A minimal URDF of joints and inertias, which all reference tools read in the same way."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import UnmeasurableError

Array = npt.NDArray[np.float64]

_WIDE_LIMITS = 'lower="-1000" upper="1000" effort="1000000" velocity="1000000"'


def bare_urdf(model: pin.Model) -> str:
    """The URDF of a model's movable joints: links l1, l2, ... on joints j1, j2, ... from base l0.

    Frames are those of Pinocchio's joints, numbers have full precision, and limits are wide.
    Gravity and armature are not included. Raises UnmeasurableError for joints that are neither
    revolute nor prismatic.
    """
    parts = ['<robot name="bare">', f'<link name="{_link(0)}"/>']
    for joint in list(model.joints)[1:]:
        parts += [_body(model, joint), _joint(model, joint)]
    return "\n".join([*parts, "</robot>"])


def _link(joint: int) -> str:
    return f"l{joint:03d}"


def _body(model: pin.Model, joint: pin.JointModel) -> str:
    body = model.inertias[joint.id]
    rows, columns = np.triu_indices(3)
    names = [f"i{'xyz'[i]}{'xyz'[j]}" for i, j in zip(rows, columns, strict=True)]
    values = np.asarray(body.inertia)[rows, columns]
    inertia = " ".join(f'{name}="{float(x)!r}"' for name, x in zip(names, values, strict=True))
    return (
        f'<link name="{_link(joint.id)}"><inertial><origin xyz="{_text(body.lever)}" rpy="0 0 0"/>'
        f'<mass value="{float(body.mass)!r}"/><inertia {inertia}/></inertial></link>'
    )


def _joint(model: pin.Model, joint: pin.JointModel) -> str:
    kind, axis = _kind(model, joint)
    placement = model.jointPlacements[joint.id]
    parent = int(model.parents[joint.id])
    return (
        f'<joint name="j{joint.id:03d}" type="{kind}"><parent link="{_link(parent)}"/>'
        f'<child link="{_link(joint.id)}"/><origin xyz="{_text(placement.translation)}" '
        f'rpy="{_text(pin.rpy.matrixToRpy(placement.rotation))}"/><axis xyz="{_text(axis)}"/>'
        f"<limit {_WIDE_LIMITS}/></joint>"
    )


def _kind(model: pin.Model, joint: pin.JointModel) -> tuple[str, Array]:
    """The URDF type of a joint, and its axis."""
    if (joint.nq, joint.nv) == (1, 1):
        data = model.createData()
        pin.forwardKinematics(model, data, pin.neutral(model), np.eye(model.nv)[joint.idx_v])
        twist = pin.getVelocity(model, data, joint.id, pin.ReferenceFrame.LOCAL)
        linear, angular = (np.where(np.abs(x) < 1e-15, 0.0, x) for x in twist.np.reshape(2, 3))
        if not linear.any():
            return "revolute", angular
        if not angular.any():
            return "prismatic", linear
    raise UnmeasurableError(
        f"joint {model.names[joint.id]!r} is neither revolute nor prismatic; the reference tools "
        "support only these."
    )


def _text(numbers: Array) -> str:
    return " ".join(repr(float(x)) for x in numbers)
