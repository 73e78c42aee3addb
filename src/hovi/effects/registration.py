"""Effects by the name of their table in a scene file."""

from __future__ import annotations

from typing import TypeVar

from hovi.effects.effect import Effect
from hovi.errors import SceneError

REGISTRY: dict[str, type[Effect]] = {}
"""The effects of hovi.effects, in its order, then those registered by users."""

Kind = TypeVar("Kind", bound=type[Effect])


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
