"""Bounds on joint coordinates by kind, and numbers, as `limits` tables give them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hovi.checks.kinds import is_number
from hovi.checks.shapes import numbers_of
from hovi.errors import InputError
from hovi.robot.space.coordinates import Coordinates


def number_in(limits: Mapping[str, Any], key: str, default: float) -> float:
    """A number of a table, or its default. Raises InputError."""
    value = limits.get(key, default)
    if not is_number(value):
        raise InputError(f"limits.{key} must be a number, got {value!r}.")
    return float(value)


def entries(coordinates: Coordinates, kind: str, given: Any) -> dict[int, tuple[float, float]]:
    """Bounds by index in v, from any of the accepted forms."""
    found = _pairs(coordinates, kind, given)
    if kind == "q" and not coordinates.vector_joints:
        for i in found:
            if i not in coordinates.space.plain[1] and isinstance(given, Mapping):
                raise InputError(
                    f"limits.q: {coordinates.coordinate_names[i]!r} has no position limits, as the "
                    "joint is continuous or floating; leave it out."
                )
        found = {i: pair for i, pair in found.items() if i in coordinates.space.plain[1]}
    return found


def _pairs(coordinates: Coordinates, kind: str, given: Any) -> dict[int, tuple[float, float]]:
    names = coordinates.coordinate_names
    if isinstance(given, Mapping):
        for name in given:
            if name not in names:
                raise InputError(
                    f"limits.{kind}: {coordinates.owner} has no joint {name!r}: "
                    f"{coordinates.hint(str(name), names)}"
                )
        return {names.index(name): _pair(kind, name, value) for name, value in given.items()}
    if is_number(given):
        given = [given] * coordinates.nv
    if not isinstance(given, Sequence | np.ndarray) or len(given) != coordinates.nv:
        raise InputError(
            f"limits.{kind} must have one entry for each of {', '.join(names)}, got {given!r}."
        )
    return {i: _pair(kind, names[i], value) for i, value in enumerate(given)}


def _pair(kind: str, name: str, value: Any) -> tuple[float, float]:
    try:
        numbers = numbers_of(name, value)
    except InputError:
        numbers = np.full(3, np.nan)
    if numbers.ndim == 0 and numbers > 0:
        return -float(numbers), float(numbers)
    if numbers.shape == (2,) and numbers[0] < numbers[1]:
        return float(numbers[0]), float(numbers[1])
    raise InputError(
        f"limits.{kind} of {name!r} must be a positive number or a pair lower < upper, got "
        f"{value!r}."
    )
