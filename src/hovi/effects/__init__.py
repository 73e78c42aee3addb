"""Effects: what a scene simulates beyond inertia, one file each, none unless it is named."""

from __future__ import annotations

from hovi.effects.effect import Effect, SceneSymbols
from hovi.effects.gravity import Gravity
from hovi.effects.joint_limit_potential import JointLimitPotential

REGISTRY: dict[str, type[Effect]] = {
    effect.key: effect for effect in (Gravity, JointLimitPotential)
}
"""Effects by the name of their table in a scene file."""

__all__ = ["REGISTRY", "Effect", "Gravity", "JointLimitPotential", "SceneSymbols"]
