"""The table that examples/benchmarks/steering_numbers.py prints is that of the sources."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

TOP = Path(__file__).resolve().parents[1]
FOLDER = str(TOP / "examples" / "benchmarks")
VAGUE = re.compile(r"The same\b|\.\.\.|Its\b|It\b|Such\b|This\b|That\b|They\b")
SOURCE = """
STEP = 0.3
\"\"\"Length of a step, in [rad].\"\"\"


class Search:
    \"\"\"A search. most: number of steps. least: of them.\"\"\"

    most: int = 40
    least: int = 3

    def point(self, x):
        \"\"\"A point of a cubic.\"\"\"
        return x[3] ** 3 + 4.0 * x[0] - 1 + np.zeros(7).sum(axis=5)
"""
"""A source with four numbers."""


@pytest.fixture(scope="module")
def script() -> Iterator[Any]:
    """The module that finds the numbers."""
    sys.path.insert(0, FOLDER)
    try:
        yield import_module("steering_numbers")
    finally:
        sys.path.remove(FOLDER)


@pytest.fixture(scope="module")
def rows(script: Any) -> list[Any]:
    return list(script.all_rows())


def test_the_table_of_the_docs_is_that_of_the_sources(script: Any, rows: list[Any]) -> None:
    assert script.TABLE.read_text() == script.table(rows), (
        "run `python examples/benchmarks/steering_numbers.py --write`"
    )


def test_constants_say_what_they_mean(rows: list[Any]) -> None:
    vague = [str(row) for row in rows if VAGUE.match(row.meaning) or not row.meaning]
    silent = [str(row) for row in rows if row.name.isupper() and row.meaning.startswith("`")]
    assert vague + silent == []


def test_the_numbers_of_a_source_have_a_row_by_constant_and_function(script: Any) -> None:
    rows = script.rows_of("a/b", SOURCE)
    assert [(row.name, row.count, row.written) for row in rows] == [
        ("STEP", 1, "0.3"),
        ("Search.most", 1, "40"),
        ("Search.least", 1, "3"),
        ("Search.point", 1, "4.0"),
    ]
    assert [row.meaning for row in rows[:3]] == [
        "Length of a step, in [rad].",
        "number of steps.",
        "of them.",
    ]
    assert rows[3].meaning.startswith("inside: A point of a cubic. `return x[3] ** 3 + 4.0")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("STEP = 0.3", "STEP = 0.4"),
        ("STEP = 0.3", "STEP = 0.3\nLENGTH = 7.0"),
        ("least: int = 3", "least: int = 1"),
        ("+ 4.0 *", "+ 4.0 * 1e-3 *"),
        ("of a step, in", "of a stride, in"),
    ],
)
def test_a_number_that_is_added_changed_or_removed_changes_the_rows(
    script: Any, old: str, new: str
) -> None:
    changed = SOURCE.replace(old, new)
    assert changed != SOURCE
    assert script.table(script.rows_of("a/b", changed)) != script.table(
        script.rows_of("a/b", SOURCE)
    )
