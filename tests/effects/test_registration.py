"""The list of effects: every effect in the folder is public and has its own table."""

from __future__ import annotations

import importlib
import pkgutil

import hovi.effects
from hovi.effects import EFFECTS, REGISTRY, Effect


def test_every_effect_in_the_folder_is_listed_and_public() -> None:
    written = {
        value
        for module in pkgutil.iter_modules(hovi.effects.__path__)
        for value in vars(importlib.import_module(f"hovi.effects.{module.name}")).values()
        if isinstance(value, type) and issubclass(value, Effect) and value is not Effect
    }
    assert set(EFFECTS) == written
    assert {effect.__name__ for effect in EFFECTS} <= set(hovi.effects.__all__)


def test_keys_are_in_the_order_of_the_list() -> None:
    assert list(REGISTRY)[: len(EFFECTS)] == [effect.key for effect in EFFECTS]
