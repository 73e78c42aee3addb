"""Effects by the name of their table in a scene file.

This file lists those of hovi: they are tables of scene files and of their JSON schema, and can be
stored in motion files. A CasadiCost holds a function, and is not among them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, MutableMapping
from dataclasses import MISSING
from typing import Any, TypeVar

import numpy as np

from hovi.effects.effect import Effect
from hovi.errors import SceneError, nearest

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


def effect_of_table(key: str, values: object, name: str = "effects") -> Effect:
    """An effect from its key and its fields as a file has them. name: of the table of effects.

    Raises SceneError.
    """
    if key not in REGISTRY:
        raise SceneError(f"there is no effect {key!r}; {nearest(str(key), REGISTRY)}")
    known = {each.name for each in dataclasses.fields(REGISTRY[key]) if each.init}
    if not isinstance(values, Mapping):
        raise SceneError(f"effect {key!r} takes {', '.join(sorted(known))}, not {values!r}.")
    for given in values:
        if given not in known:
            hint = nearest(str(given), known)
            raise SceneError(f"unknown key `{name}.{key}.{given}`; {hint}")
    for each in dataclasses.fields(REGISTRY[key]):
        needed = each.default is MISSING and each.default_factory is MISSING
        if needed and each.name not in values:
            raise SceneError(f"`{name}.{key}.{each.name}` is missing.")
    return REGISTRY[key](**values)


def as_effects(given: object, name: str = "effects") -> tuple[Effect, ...]:
    """Effects as a tuple. name: of their table in messages.

    Raises SceneError for anything but a list or a table of effects.
    """
    effects: tuple[Any, ...] = (None,)
    if isinstance(given, Mapping):
        effects = tuple(effect_of_table(key, values, name) for key, values in given.items())
    elif isinstance(given, Iterable) and not isinstance(given, str | np.ndarray):
        effects = tuple(given)
    if not all(isinstance(each, Effect) for each in effects):
        raise SceneError(f"effects is a list such as [hovi.effects.Gravity()], not {given!r}.")
    return effects
