"""Axes of values that are given: lists and grids."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hovi.errors import SceneError
from hovi.study.cells.axis import Axis, Rows, check_count
from hovi.study.cells.field_path import FieldPath


def listed(fields: Sequence[FieldPath], values: Sequence[Any]) -> Axis:
    """The values one after the other; of several fields, a list of one value for each.

    Raises SceneError for a list of another length.
    """
    if len(fields) == 1:
        return Axis(tuple(fields), [(value,) for value in values])
    for number, row in enumerate(values):
        if not isinstance(row, list) or len(row) != len(fields):
            raise SceneError(
                f"value {number} of the study's fields "
                f"{', '.join(each.text for each in fields)} must be a list of {len(fields)}, one "
                f"for each, but it is {row!r}."
            )
    return Axis(tuple(fields), [tuple(row) for row in values])


def grid(fields: Sequence[FieldPath], lower: float, upper: float, count: int) -> Axis:
    """Equally spaced numbers from one to another, both included, in each of the fields."""
    check_count(count, 1, "the count of a grid")
    numbers = np.linspace(lower, upper, count)
    return Axis(tuple(fields), Rows(np.repeat(numbers[:, None], len(fields), axis=1)), True)
