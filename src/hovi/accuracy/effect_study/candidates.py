"""Candidate effects for a robot, with plausible parameters.

Parameters are taken from the robot's model where it has them. Otherwise friction is one percent of
the effort limit, rotor inertia a tenth of the joint's inertia, payload a twentieth of the mass, and
the external force a twentieth of the weight. Known values belong in a scene file.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.effects import (
    Armature,
    Drag,
    DryFriction,
    Effect,
    Gravity,
    MovingBase,
    Payload,
    ViscousFriction,
    Wrench,
)
from hovi.robot.mass_matrix import MassMatrix
from hovi.robot.robot import Robot
from hovi.robot.tip_frame import is_moved

Array = npt.NDArray[np.float64]

FRICTION_FRACTION = 0.01  # of the effort limit
ROTOR_FRACTION = 0.1  # of the joint's inertia
LOAD_FRACTION = 0.05  # of the mass, or of the weight
_EARTH = 9.81  # [m/s^2]


def effect_candidates(robot: Robot, passive: Sequence[str] = ()) -> tuple[Effect, ...]:
    """One effect of each common kind, in the order of docs/effects.md.

    passive: joints without motors. An unactuated floating base gains momentum under a constant
        force whatever the other motors do, and cannot come to rest: gravity and the external
        force are left out.
    """
    tip, efforts = robot.tip_frame, _typical_efforts(robot)
    mass = sum(inertia.mass for inertia in robot.model.inertias[1:])
    in_model = {
        "damping": robot.damping.any(),
        "friction": robot.friction.any(),
        "armature": robot.armature.any(),
    }
    has_bearing = _has_bearing(robot)
    friction = _rounded(FRICTION_FRACTION * efforts * has_bearing)
    rotors = _rounded(ROTOR_FRACTION * _inertia(robot) * has_bearing)
    candidates: list[Effect] = [
        Gravity(),
        ViscousFriction(from_urdf=True) if in_model["damping"] else ViscousFriction(friction),
        DryFriction(from_urdf=True) if in_model["friction"] else DryFriction(friction, width=0.1),
        Armature(from_urdf=True) if in_model["armature"] else Armature(rotors),
        MovingBase((0.0, 0.0, "0.01*sin(4*pi*t)")),
    ]
    if is_moved(robot.model, tip):
        (load,), (push,) = _rounded(LOAD_FRACTION * mass), _rounded(LOAD_FRACTION * mass * _EARTH)
        candidates += [
            Payload(tip, load),
            Wrench(tip, (0.0, push, 0.0)),
            Drag(tip, 0.05, wind=(0.0, 5.0, 0.0)),
        ]
    excluded: list[type[Effect]] = []
    if not has_bearing.all():
        unactuated_base = robot.joint_names[0] in passive
        excluded = [MovingBase, Gravity, Wrench] if unactuated_base else [MovingBase]
    return tuple(e for e in candidates if not isinstance(e, tuple(excluded)))


def check_frames_move(robot: Robot, effects: Iterable[Effect]) -> None:
    """Raise InputError for an effect at a frame that no joint moves, where it changes nothing."""
    for effect in effects:
        if isinstance(effect, Payload | Wrench | Drag):
            robot.check_frame_moves(effect.frame)


def _has_bearing(robot: Robot) -> Array:
    """1 for joint coordinates, 0 for those of a floating base.

    A floating base is a first joint on SE(2), SO(3) or SE(3).
    """
    has_bearing = np.ones(robot.nv)
    for factor in robot.space.curved[:1]:
        if factor.v.start == 0:
            has_bearing[factor.v] = 0.0
    return has_bearing


def _typical_efforts(robot: Robot) -> Array:
    """The effort limit of every coordinate; where unknown, the largest gravity torque found."""
    limit = robot.effort_limit
    known = (limit > 0) & (limit < 1e15)
    model = robot.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -_EARTH])
    data = model.createData()
    random = np.random.default_rng(0)
    weights = [
        np.abs(pin.computeGeneralizedGravity(model, data, q)).max()
        for q in (
            pin.integrate(model, pin.neutral(model), dq)
            for dq in random.uniform(-2, 2, (20, model.nv))
        )
    ]
    return np.where(known, limit, max(weights, default=0.0) or 1.0)


def _inertia(robot: Robot) -> Array:
    model = robot.model.copy()
    model.armature = np.zeros(model.nv)
    return np.diagonal(MassMatrix(model)(pin.neutral(model)[None])[0])


def _rounded(values: npt.ArrayLike) -> tuple[float, ...]:
    """Rounded to two digits."""
    return tuple(float(f"{value:.2g}") for value in np.atleast_1d(values))
