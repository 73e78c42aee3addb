"""Effects by the name of their table in a scene file."""

from __future__ import annotations

from typing import TypeVar

from hovi.effects.armature import Armature
from hovi.effects.custom import Custom
from hovi.effects.drag import Drag
from hovi.effects.dry_friction import DryFriction
from hovi.effects.effect import Effect
from hovi.effects.effort_weight import EffortWeight
from hovi.effects.gravity import Gravity
from hovi.effects.joint_limit_potential import JointLimitPotential
from hovi.effects.joint_springs import JointSprings
from hovi.effects.motion_cost import AccelerationCost, VelocityCost
from hovi.effects.moving_base import MovingBase
from hovi.effects.payload import Payload
from hovi.effects.power_cost import PowerCost
from hovi.effects.reference_cost import ReferenceCost
from hovi.effects.viscous_friction import ViscousFriction
from hovi.effects.wrench import Wrench
from hovi.errors import SceneError

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
    ReferenceCost,
    PowerCost,
)
REGISTRY: dict[str, type[Effect]] = {effect.key: effect for effect in EFFECTS}

Kind = TypeVar("Kind", bound=type[Effect])


def register(effect: Kind) -> Kind:
    """Let scene files and motions on file name an effect of one's own: a decorator of its class.

    The class has to be registered again wherever such a file is read.
    Raises SceneError when its key belongs to another effect.
    """
    known = REGISTRY.setdefault(effect.key, effect)
    if known is not effect:
        raise SceneError(
            f"the key {effect.key!r} belongs to the effect {known.__name__}; choose another one "
            f"for {effect.__name__}."
        )
    return effect
