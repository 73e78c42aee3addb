"""Shapes of arrays are checked, and named where they do not fit."""

from __future__ import annotations

import numpy as np
import pytest

from hovi.checks.shapes import numbers_of, require_rows, require_shape
from hovi.errors import InputError


@pytest.mark.parametrize(
    ("shape", "sizes"), [((3, 2), (3, 2)), ((3, 2), (None, 2)), ((0,), (None,)), ((), ())]
)
def test_a_shape_that_fits_is_accepted(shape, sizes) -> None:
    require_shape("x", np.zeros(shape), *sizes)


@pytest.mark.parametrize(
    ("shape", "sizes", "words"),
    [
        ((3, 2), (2, 2), r"\(2, 2\), got \(3, 2\)"),
        ((3,), (3, 2), r"\(3, 2\), got \(3,\)"),
        ((3, 2), (3,), r"\(3,\), got \(3, 2\)"),
        ((3, 2), (None, 3), r"\(any, 3\), got \(3, 2\)"),
    ],
)
def test_a_shape_that_does_not_fit_is_refused(shape, sizes, words) -> None:
    with pytest.raises(InputError, match=f"x must have shape {words}"):
        require_shape("x", np.zeros(shape), *sizes)


def test_numbers_are_converted_and_their_shape_is_checked() -> None:
    assert numbers_of("x", [1, 2], 2).dtype == np.float64
    assert numbers_of("x", 1).shape == ()
    with pytest.raises(InputError, match="x must be numbers, got 'one'"):
        numbers_of("x", "one")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="x must have shape"):
        numbers_of("x", [1, 2], 3)


def test_rows_must_broadcast() -> None:
    require_rows((("a", np.zeros((4, 1, 3)), 3), ("b", np.zeros((5, 2)), 2)))
    with pytest.raises(InputError, match=r"a must have shape \(\.\.\., 3\), got \(\)"):
        require_rows((("a", np.zeros(()), 3),))
    with pytest.raises(
        InputError, match=r"b must have .* rows \(4,\) do not broadcast with \(5,\)"
    ):
        require_rows((("a", np.zeros((5, 3)), 3), ("b", np.zeros((4, 3)), 3)))
