"""A hard case: what breaks a literal implementation, what hovi does on it, and the bar.

Each family of cases is a file of this folder that holds a tuple CASES; a test runs every one of
them, and so can a script that prints a table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import pytest


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    shown: the result in a few words or digits, for the table.
    passed: whether it is within the bar.
    """

    shown: str
    passed: bool


@dataclass(frozen=True)
class Case:
    """One hard case.

    number: in the list of hard cases: "8", or "26a" where a number has several parts.
    claim: what holds, as a sentence without a full stop; the test's name.
    naive: measures what a literal implementation does, and says it in a few words.
    run: what hovi does.
    bar: what is asked for, in words: "at most 1e-12", "refused by name".
    known_failure: why the bar is not met; "" where it is.
    long: whether it takes minutes.
    """

    number: str
    claim: str
    naive: Callable[[], str]
    run: Callable[[], Outcome]
    bar: str
    known_failure: str = ""
    long: bool = False


def at_most(value: float, bar: float) -> Outcome:
    """The outcome of a number that has to be at most `bar` (and not NaN)."""
    return Outcome(f"{value:.2g}", value <= bar)


def parameters(cases: Iterable[Case]) -> list[Any]:
    """The cases for `pytest.mark.parametrize`, each by its number and claim."""
    return [
        pytest.param(case, id=f"{case.number}: {case.claim}", marks=_marks(case)) for case in cases
    ]


def _marks(case: Case) -> list[pytest.MarkDecorator]:
    marks = [pytest.mark.long] if case.long else []
    if case.known_failure:
        marks.append(pytest.mark.xfail(reason=case.known_failure))
    return marks
