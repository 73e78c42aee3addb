"""Numbers are what float() keeps whole."""

from __future__ import annotations

from decimal import Decimal
from typing import Any

import numpy as np
import pytest

from hovi.checks.kinds import NUMBERS, MismatchError, is_number, is_whole, kind_of


@pytest.mark.parametrize("value", [3, -(10**30), np.int8(3), np.uint64(2**63)])
def test_integers_are_whole_numbers(value: Any) -> None:
    assert is_number(value)
    assert is_whole(value)


@pytest.mark.parametrize("value", [2.5, 3.0, float("nan"), np.float32(0.5), np.longdouble(1)])
def test_floats_are_numbers_and_not_whole(value: Any) -> None:
    assert is_number(value)
    assert not is_whole(value)


@pytest.mark.parametrize(
    "value",
    [
        *(True, np.True_, 1j, np.complex64(2.0), np.complex128(2.0), "3", None, Decimal(3)),
        *(np.timedelta64(3, "ms"), np.datetime64("2020-01-01"), np.zeros(1, complex)[0]),
    ],
)
def test_what_float_changes_or_refuses_is_no_number(value: Any) -> None:
    assert not is_number(value)
    assert not is_whole(value)
    for annotation in (float, int):
        kind = kind_of(annotation)
        assert kind is not None
        if not isinstance(value, Decimal):
            with pytest.raises(MismatchError):
                kind.accept(value)


@pytest.mark.parametrize("dtype", ["complex64", "complex128", "m8[s]", "M8[D]"])
def test_arrays_of_no_numbers_are_refused(dtype: str) -> None:
    with pytest.raises(MismatchError):
        NUMBERS.accept(np.zeros(2, dtype))
