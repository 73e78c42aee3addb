"""Hard cases: a claim, a requirement, and the results of a literal implementation and of hovi.

Each family of cases is a file of this folder with a tuple CASES. A test runs them all;
examples/benchmarks/hard_cases.py prints them as a table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import pytest


@dataclass(frozen=True)
class Outcome:
    """The result of a case.

    shown: the result in a few words or digits, for the table.
    passed: whether it meets the requirement.
    """

    shown: str
    passed: bool


@dataclass(frozen=True)
class Case:
    """One hard case.

    number: "8", or "26a" where a number has several parts.
    claim: a sentence without a full stop; the test's name.
    naive: runs a literal implementation; returns its result in a few words.
    run: runs hovi.
    requirement: in words, such as "at most 1e-12".
    known_failure: why the requirement is not met; "" if it is.
    long: whether it takes minutes.
    """

    number: str
    claim: str
    naive: Callable[[], str]
    run: Callable[[], Outcome]
    requirement: str
    known_failure: str = ""
    long: bool = False


def at_most(value: float, requirement: float) -> Outcome:
    """The outcome of a number that must be at most `requirement`, and not NaN."""
    return Outcome(f"{value:.2g}", value <= requirement)


def parameters(cases: Iterable[Case]) -> list[Any]:
    """The cases for `pytest.mark.parametrize`, with number and claim as ids."""
    return [
        pytest.param(case, id=f"{case.number}: {case.claim}", marks=_marks(case)) for case in cases
    ]


def _marks(case: Case) -> list[pytest.MarkDecorator]:
    marks = [pytest.mark.long] if case.long else []
    if case.known_failure:
        marks.append(pytest.mark.xfail(reason=case.known_failure))
    return marks
