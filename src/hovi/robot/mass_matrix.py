"""The mass matrix M(q) of a model, mimic joints included, and whether it is singular."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import ModelError, some_of
from hovi.robot.findings.subject import LightJoint
from hovi.robot.mimic_model import CoordinateMap, uncoupled
from hovi.robot.space.joint_kinds import ANGLE, kind_of

Array = npt.NDArray[np.float64]

LIGHT_FRACTION = 3e-3
"""Largest inertia of a joint that is reported as light, relative to that of the heaviest."""


class MassMatrix:
    """q -> M(q) by Pinocchio's CRBA; G^T M_all G of the uncoupled model if there are mimic joints.

    CRBA of Pinocchio 4.1 is wrong on a coupled model with a joint of several coordinates between a
    leader and its follower.

    model: with armature.
    """

    def __init__(self, model: pin.Model) -> None:
        coupled = len(model.mimicking_joints) > 0
        self._model = uncoupled(model) if coupled else model
        self._data = self._model.createData()
        self._map = CoordinateMap.of(model, self._model) if coupled else None

    def __call__(self, q: Array) -> Array:
        """The symmetric matrices at M configurations (M, nq), shape (M, nv, nv), in [kg m^2]."""
        whole = q if self._map is None else self._map.configurations(q)
        upper = np.array([np.triu(pin.crba(self._model, self._data, one)) for one in whole])
        mass: Array = upper + np.triu(upper, 1).swapaxes(1, 2)
        if self._map is not None:
            mass = np.asarray(self._map.matrix.T @ mass @ self._map.matrix)
        return mass


def check_mass_matrix(model: pin.Model) -> None:
    """Raise ModelError if the mass matrix M(q) is singular to working precision.

    The message names the joints without inertia, and what to do.
    """
    joints = joints_without_inertia(model)
    if joints:
        raise ModelError(_singular_mass_sentence(model, joints))


def joints_without_inertia(model: pin.Model) -> list[int]:
    """The joints with the largest components in the null space of M(q); none if M is regular.

    M is singular if lambda_min(M) <= 10 nv eps lambda_max(M) at one of four fixed random
    configurations. The neutral one is no criterion: a pendulum that hangs straight down has no
    inertia about the vertical.
    """
    if model.nv == 0:
        return []
    samples = np.array(list(_sample_configurations(model)))
    values, vectors = np.linalg.eigh(MassMatrix(model)(samples))
    free = values <= 10.0 * model.nv * np.finfo(float).eps * values[:, -1:]
    if not free.any():
        return []
    first = int(np.argmax(free.any(axis=1)))
    fraction = np.sum(vectors[first][:, free[first]] ** 2, axis=1)  # (nv,)
    return [
        index
        for index, joint in enumerate(model.joints[1:], start=1)
        if fraction[joint.idx_v : joint.idx_v + joint.nv].max(initial=0.0) >= 0.5 * fraction.max()
    ]


def named_joints(model: pin.Model, joints: list[int]) -> str:
    """The names of joints, up to three of them, with the links that they move."""
    return some_of([f"{model.names[j]!r}{_link_of(model, j)}" for j in joints], 3)


def _singular_mass_sentence(model: pin.Model, joints: list[int]) -> str:
    """The message about torques of a robot that has joints without inertia."""
    names = [str(model.names[joint]) for joint in joints]
    return (
        f"the mass matrix of robot {model.name!r} is singular to working precision, so it has no "
        f"torques: there is no inertia at joint {named_joints(model, joints)}; give the links that "
        "it moves a mass and an inertia, such as their shapes times a density, or the joint a "
        'rotor by the effect armature, or plan without torques by objective = "acceleration" or '
        f'"jerk", or lock it with locked={names!r}.'
    )


def _sample_configurations(model: pin.Model) -> Iterator[Array]:
    rng = np.random.default_rng(0)
    for _ in range(4):
        yield pin.integrate(model, pin.neutral(model), rng.uniform(-1.0, 1.0, model.nv))


def _link_of(model: pin.Model, joint: int) -> str:
    frames = (f for f in model.frames if f.parentJoint == joint and f.type == pin.BODY)
    return next((f" (link {frame.name!r})" for frame in frames), "")


def little_inertia(model: pin.Model) -> dict[str, LightJoint]:
    """Turning joints of one coordinate that are far lighter than the heaviest, by name.

    Their inertia is the least M_jj at four fixed random configurations, armature included; light is
    below LIGHT_FRACTION of the largest M_jj.
    """
    joints = [
        (str(name), joint.idx_v)
        for joint, name in zip(model.joints[1:], model.names[1:], strict=True)
        if kind_of(joint).units == (ANGLE,)
    ]
    if not joints:
        return {}
    samples = np.array(list(_sample_configurations(model)))
    inertia = np.diagonal(MassMatrix(model)(samples), axis1=1, axis2=2)  # (samples, nv)
    least, most = inertia.min(axis=0), inertia[:, [i for _, i in joints]].max()
    return {
        name: LightJoint(float(least[i]), float(LIGHT_FRACTION * most - least[i]))
        for name, i in joints
        if least[i] < LIGHT_FRACTION * most
    }
