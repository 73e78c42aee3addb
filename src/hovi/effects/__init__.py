"""Effects: opt-in physics and costs of a scene beyond rigid-body inertia, one file each.

This file lists them: an effect in EFFECTS and __all__ is public, a table of scene files and of
their JSON schema, and can be stored in motion files. A CasadiCost holds a function, and is neither.
"""

from __future__ import annotations

from hovi.effects.armature import Armature
from hovi.effects.casadi_cost import CasadiCost
from hovi.effects.custom import Custom
from hovi.effects.drag import Drag
from hovi.effects.dry_friction import DryFriction
from hovi.effects.effect import Effect, Touch
from hovi.effects.effort_weight import EffortWeight
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.effects.gravity import Gravity
from hovi.effects.joint_limit_potential import JointLimitPotential
from hovi.effects.joint_springs import JointSprings
from hovi.effects.motion_cost import AccelerationCost, JerkCost, VelocityCost
from hovi.effects.moving_base import MovingBase
from hovi.effects.payload import Payload
from hovi.effects.power_cost import PowerCost
from hovi.effects.reference_cost import ReferenceCost
from hovi.effects.registration import REGISTRY, register
from hovi.effects.running_cost import RunningCost
from hovi.effects.viscous_friction import ViscousFriction
from hovi.effects.wrench import Wrench

EFFECTS: tuple[type[Effect], ...] = (
    Gravity,
    ViscousFriction,
    DryFriction,
    Armature,
    JointSprings,
    JointLimitPotential,
    Payload,
    Wrench,
    Drag,
    MovingBase,
    Custom,
    EffortWeight,
    VelocityCost,
    AccelerationCost,
    JerkCost,
    ReferenceCost,
    PowerCost,
    RunningCost,
)
"""In the order of the JSON schema."""
for _effect in EFFECTS:
    register(_effect)


__all__ = [
    "REGISTRY",
    "AccelerationCost",
    "Armature",
    "CasadiCost",
    "Custom",
    "Drag",
    "DryFriction",
    "Effect",
    "EffortWeight",
    "Gravity",
    "JerkCost",
    "JointLimitPotential",
    "JointSprings",
    "MovingBase",
    "Payload",
    "PowerCost",
    "ReferenceCost",
    "RunningCost",
    "SceneSymbols",
    "Touch",
    "VelocityCost",
    "ViscousFriction",
    "Wrench",
    "register",
]
