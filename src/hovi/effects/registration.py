"""Effects by the name of their table in a scene file.

This file lists those of hovi: they are tables of scene files and of their JSON schema, and can be
stored in motion files. A CasadiCost holds a function, and is not among them.
"""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from typing import TypeVar

from hovi.effects.effect import Effect
from hovi.errors import SceneError

EFFECTS = {
    "gravity": "Gravity",
    "viscous_friction": "ViscousFriction",
    "dry_friction": "DryFriction",
    "armature": "Armature",
    "joint_springs": "JointSprings",
    "joint_limit_potential": "JointLimitPotential",
    "payload": "Payload",
    "wrench": "Wrench",
    "drag": "Drag",
    "moving_base": "MovingBase",
    "custom": "Custom",
    "effort_weight": "EffortWeight",
    "velocity_cost": "VelocityCost",
    "acceleration_cost": "AccelerationCost",
    "jerk_cost": "JerkCost",
    "reference_cost": "ReferenceCost",
    "power_cost": "PowerCost",
    "running_cost": "RunningCost",
}
"""Keys, in the order of the JSON schema, and the names in hovi.effects of their classes."""

Kind = TypeVar("Kind", bound=type[Effect])


class Registry(MutableMapping[str, type[Effect]]):
    """Classes by key: those of hovi, each imported when it is asked for, then those of users."""

    def __init__(self) -> None:
        self._others: dict[str, type[Effect]] = {}

    def __getitem__(self, key: str) -> type[Effect]:
        if key in self._others:
            return self._others[key]
        import hovi.effects

        found: type[Effect] = getattr(hovi.effects, EFFECTS[key])
        return found

    def __setitem__(self, key: str, effect: type[Effect]) -> None:
        self._others[key] = effect

    def __delitem__(self, key: str) -> None:
        del self._others[key]

    def __iter__(self) -> Iterator[str]:
        yield from EFFECTS
        yield from self._others

    def __len__(self) -> int:
        return len(EFFECTS) + len(self._others)


REGISTRY = Registry()
"""The effects of hovi.effects, in the order of EFFECTS, then those registered by users."""


def register(effect: Kind) -> Kind:
    """A class decorator that makes a user-defined effect available in scene and motion files.

    The class must be registered before such a file is read.
    Raises SceneError if another effect has the same key.
    """
    if not (isinstance(effect, type) and issubclass(effect, Effect)):
        raise SceneError(f"an effect is a subclass of hovi.effects.Effect, not {effect!r}.")
    if not isinstance(getattr(effect, "key", None), str):
        raise SceneError(f"the effect {effect.__name__} needs a class attribute key, a text.")
    known = REGISTRY.setdefault(effect.key, effect)
    if known is not effect:
        raise SceneError(
            f"the key {effect.key!r} belongs to the effect {known.__name__}; choose another one "
            f"for {effect.__name__}."
        )
    return effect
