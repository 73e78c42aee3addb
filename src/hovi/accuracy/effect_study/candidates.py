"""Effects worth trying on a robot that a scene leaves out, at a plausible strength.

What the robot's model states is taken from there. The rest are stand-ins: one percent of the effort
limit for friction, a tenth of the inertia for rotors, a twentieth of the mass for a payload and of
the weight for a push. Whoever knows better names them in a scene file.
"""

from __future__ import annotations

from collections.abc import Sequence

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

Array = npt.NDArray[np.float64]

FRICTION = 0.01
ROTORS = 0.1
BURDEN = 0.05
_EARTH = 9.81


def effect_candidates(robot: Robot, passive: Sequence[str] = ()) -> tuple[Effect, ...]:
    """One of each effect that most robots feel, in the order of the effects page.

    passive: joints without motors. A base that floats without any gains the momentum that a steady
        force gives it whatever the other motors do, and comes to rest nowhere: gravity and the
        push are left out.
    """
    tip, level = robot.tip_frame, _efforts(robot)
    mass = sum(inertia.mass for inertia in robot.model.inertias[1:])
    stated = {
        "damping": robot.damping.any(),
        "friction": robot.friction.any(),
        "armature": robot.armature.any(),
    }
    borne = _borne(robot)
    rub = _rounded(FRICTION * level * borne)
    rotors = _rounded(ROTORS * _inertia(robot) * borne)
    candidates: list[Effect] = [
        Gravity(),
        ViscousFriction(from_urdf=True) if stated["damping"] else ViscousFriction(rub),
        DryFriction(from_urdf=True) if stated["friction"] else DryFriction(rub, width=0.1),
        Armature(from_urdf=True) if stated["armature"] else Armature(rotors),
        MovingBase((0.0, 0.0, "0.01*sin(4*pi*t)")),
    ]
    if robot.model.frames[robot.model.getFrameId(tip)].parentJoint > 0:
        (load,), (push,) = _rounded(BURDEN * mass), _rounded(BURDEN * mass * _EARTH)
        candidates += [
            Payload(tip, load),
            Wrench(tip, (0.0, push, 0.0)),
            Drag(tip, 0.05, wind=(0.0, 5.0, 0.0)),
        ]
    unfit: list[type[Effect]] = []
    if not borne.all():
        adrift = robot.joint_names[0] in passive
        unfit = [MovingBase, Gravity, Wrench] if adrift else [MovingBase]
    return tuple(e for e in candidates if not isinstance(e, tuple(unfit)))


def _borne(robot: Robot) -> Array:
    """1 for coordinates with a bearing and perhaps a motor, 0 for those of a base that floats.

    A base is a first joint on SE(2), SO(3) or SE(3).
    """
    borne = np.ones(robot.nv)
    for factor in robot.space.curved[:1]:
        if factor.v.start == 0:
            borne[factor.v] = 0.0
    return borne


def _efforts(robot: Robot) -> Array:
    """The effort limit of every coordinate, or where none is known, the largest weight found."""
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
    """Two digits are enough for a stand-in."""
    return tuple(float(f"{value:.2g}") for value in np.atleast_1d(values))
