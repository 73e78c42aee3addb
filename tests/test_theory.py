"""The tests that docs/theory.md names for its theorems exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

TOP = Path(__file__).resolve().parents[1]
CLAIMS = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", (TOP / "docs" / "theory.md").read_text())


def test_theorems_have_tests() -> None:
    assert len(CLAIMS) > 20


@pytest.mark.parametrize(("file", "name"), CLAIMS)
def test_the_test_of_a_claim_exists(file: str, name: str) -> None:
    assert f"def {name}(" in (TOP / file).read_text()
