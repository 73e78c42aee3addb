"""Effects by the name of their table in a scene file."""

from __future__ import annotations

from typing import TypeVar

from hovi.effects.effect import Effect
from hovi.errors import SceneError

REGISTRY: dict[str, type[Effect]] = {}
"""The effects of hovi.effects, in its order, and those that were registered after them."""

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
