"""Motions of a hundred problems take the steps, and have the costs, that are on record.

Where this fails without a reason, a change of the method had an effect that nobody meant; where it
was meant, `python examples/benchmarks/recorded_motions.py --write` records the motions anew.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

TESTS = Path(__file__).resolve().parents[1]
RECORD = json.loads((TESTS / "data" / "recorded_motions.json").read_text())
MOST = 3.0
"""Kernel points after which a problem is ended, relative to those on record."""


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    """examples/benchmarks/recorded_motions.py."""
    folder = str(TESTS.parent / "examples" / "benchmarks")
    sys.path.insert(0, folder)
    try:
        yield import_module("recorded_motions")
    finally:
        sys.path.remove(folder)


@pytest.mark.parametrize("name", RECORD)
def test_a_motion_is_as_recorded(name: str, script: ModuleType) -> None:
    record = RECORD[name]
    most = MOST * record["points"] + 1e4
    assert script.difference(script.measured(name, most=most), record) == ""


def test_the_record_covers_most_problems(script: ModuleType) -> None:
    assert len(RECORD) > 0.6 * len(script.PROBLEMS)
