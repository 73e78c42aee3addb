"""The switches of examples/benchmarks/rules.py: each rule of the table can be turned off."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

from hovi.optimize import quadratic_model

FOLDER = str(Path(__file__).resolve().parents[1] / "examples" / "benchmarks")


@pytest.fixture(scope="module")
def scripts() -> Iterator[tuple[ModuleType, ModuleType]]:
    """The modules of the switches and of the list of rules."""
    sys.path.insert(0, FOLDER)
    try:
        yield import_module("switches"), import_module("rules_list")
    finally:
        sys.path.remove(FOLDER)


def test_every_switch_names_expressions_that_exist(scripts: tuple[ModuleType, ModuleType]) -> None:
    switches, rules = scripts
    missing = []
    for rule in rules.RULES:
        try:
            with switches.replaced(rule.edits), switches.watched(rule.edits):
                pass
        except switches.SwitchError as error:
            missing.append(f"{rule.name}: {error}")
    assert missing == [], "correct examples/benchmarks/rules_list.py"


def test_all_rules_can_be_watched_together(scripts: tuple[ModuleType, ModuleType]) -> None:
    switches, rules = scripts
    edits = [edit for rule in rules.RULES for edit in rule.edits]
    with switches.watched(edits) as counts:
        assert counts == [0] * len(edits)


def test_rules_have_names_of_their_own(scripts: tuple[ModuleType, ModuleType]) -> None:
    names = [rule.name for rule in scripts[1].RULES]
    assert len(names) == len(set(names))


def test_a_switch_replaces_and_counts_and_leaves_the_function_as_it_was(
    scripts: tuple[ModuleType, ModuleType],
) -> None:
    switches, _ = scripts
    where = "hovi.optimize.quadratic_model:next_radius"
    edit = switches.Edit(where, "max(LEAST_SHRINKAGE, fraction)", "0.25")
    held = quadratic_model.next_radius  # whoever holds it calls the other code
    assert held(1.0, 1.0, 0.2) == 0.5
    with switches.replaced([edit]):
        assert held(1.0, 1.0, 0.2) == 0.25
    with switches.watched([edit]) as counts:
        assert [held(1.0, 1.0, ratio) for ratio in (0.2, -math.inf, 0.9)] == [0.5, 0.25, 1.4]
    assert counts == [1]
    assert held(1.0, 1.0, 0.2) == 0.5


def test_a_switch_of_nothing_is_refused(scripts: tuple[ModuleType, ModuleType]) -> None:
    switches, _ = scripts
    where = "hovi.optimize.quadratic_model:next_radius"
    for place, on in ((where, "min(0.25, share)"), (f"{where}_", "share")):
        with (
            pytest.raises(switches.SwitchError),
            switches.replaced([switches.Edit(place, on, "0")]),
        ):
            pass
