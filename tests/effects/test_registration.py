"""The list of effects: every effect in the folder is public and has its own table."""

from __future__ import annotations

import importlib
import math
import pkgutil
import re
import tomllib
from dataclasses import fields
from pathlib import Path

import hovi.effects
from hovi.effects import Effect
from hovi.effects.registration import EFFECTS, REGISTRY


def test_every_effect_in_the_folder_is_listed_and_public() -> None:
    written = {
        value
        for module in pkgutil.iter_modules(hovi.effects.__path__)
        for value in vars(importlib.import_module(f"hovi.effects.{module.name}")).values()
        if isinstance(value, type) and issubclass(value, Effect) and value is not Effect
    }
    listed = {REGISTRY[key] for key in EFFECTS}
    assert listed == {effect for effect in written if effect.storable}
    assert {effect.__name__ for effect in written} <= set(hovi.effects.__all__)


def test_keys_are_in_the_order_of_the_list() -> None:
    assert list(REGISTRY)[: len(EFFECTS)] == list(EFFECTS)
    assert list(EFFECTS) == [REGISTRY[key].key for key in EFFECTS]


def test_default_numbers_are_those_that_the_page_of_scene_files_states() -> None:
    page = Path(__file__).resolve().parents[2] / "docs/scene_files.md"
    stated, actual = set(), {}
    for names, keys in re.findall(r"^\| (`\[effects\..*?) \| (.*) \|$", page.read_text(), re.M):
        for name in re.findall(r"\[effects\.(\w+)\]", names):
            numbers = re.findall(r"`(\w+ = [-.\de]+)`", keys)
            stated |= {(name, *each) for line in numbers for each in tomllib.loads(line).items()}
    for name, effect in REGISTRY.items():
        for field in fields(effect):
            if isinstance(field.default, float) and math.isfinite(field.default):
                actual[name, field.name] = field.default
    known = {each[:2]: each[2] for each in stated}
    assert known == {key: number for key, number in actual.items() if number or key in known}
