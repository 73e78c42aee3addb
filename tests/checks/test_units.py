"""Durations and times are parsed with their units, or refused in one sentence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hovi.checks.units import as_duration, as_time_limit, number_and_unit, seconds
from hovi.errors import InputError


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("2 s", 2.0),
        ("500 ms", 0.5),
        ("1.5 min", 90.0),
        ("1e3us", 1e-3),
        (" 2  h ", 7200.0),
        (2, 2.0),
        (np.float32(0.5), 0.5),
    ],
)
def test_a_time_is_a_number_of_seconds_or_has_a_unit(given: Any, expected: float) -> None:
    assert seconds(given, "it") == expected
    assert as_duration(given) == expected
    assert as_duration((given, "3 h")) == (expected, 10800.0)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("2 sec", "it '2 sec' has the unit 'sec': did you mean 's'"),
        ("2 mm", "it '2 mm' has the unit 'mm': did you mean 'ms'"),
        ("2", "it '2' has no unit: write '2 s'"),
        ("soon", "it must be a number of seconds or a text such as '2 s'.*got 'soon'"),
        ("", "it must be a number of seconds"),
        ("-2 s", "it must be a number of seconds"),
        ("1.2.3 s", "it must be a number of seconds"),
        ("2 s 3", "it must be a number of seconds"),
        (None, "it must be a number of seconds.*got None"),
        ([2.0], "it must be a number of seconds"),
        (True, "it must be a number of seconds"),
        (np.complex128(2.0), "it must be a number of seconds"),
        (np.timedelta64(500, "ms"), "it must be a number of seconds"),
    ],
)
def test_an_invalid_time_is_refused_in_one_sentence(given: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        seconds(given, "it")


@pytest.mark.parametrize(
    "given", [(), (1.0,), (1.0, 2.0, 3.0), None, object(), True, np.timedelta64(2, "s")]
)
def test_a_duration_is_one_number_or_two(given: Any) -> None:
    with pytest.raises(
        InputError, match=r"`duration` must be a positive .* \[lower, upper\] of two"
    ):
        as_duration(given)


@pytest.mark.parametrize("given", [[3, 1], (2.0, 2.0), ("3 s", "500 ms"), [1, "1000 ms"]])
def test_the_lower_bound_of_a_free_duration_is_below_the_upper_one(given: Any) -> None:
    with pytest.raises(InputError, match="whose lower bound is below the upper one, but it is \\["):
        as_duration(given)
    for bounds in ([-1, 2], [0, 2], [1, np.inf], [np.nan, 1]):
        with pytest.raises(InputError, match=r"`duration` must be a positive number"):
            as_duration(bounds)


@pytest.mark.parametrize("text", ["1" + " " * 10**6 + "!", " " * 10**6, "1" * 10**6, "." * 10**6])
def test_a_long_text_is_read_in_linear_time(text: str) -> None:
    number_and_unit(text)  # in quadratic time this would not return for hours


@pytest.mark.parametrize("given", [0, -1, "0 ms"])
def test_a_time_limit_that_is_not_positive_is_refused(given: Any) -> None:
    with pytest.raises(InputError, match="time_limit must be positive, in seconds, got"):
        as_time_limit(given)


def test_a_time_limit_is_read_in_seconds_or_as_a_text() -> None:
    assert as_time_limit("20 ms") == pytest.approx(0.02)
    assert as_time_limit(None) is None
