"""Bounds on joint coordinates by kind, and numbers, as `limits` tables give them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from hovi.checks.kinds import is_number, shown
from hovi.checks.shapes import numbers_of
from hovi.checks.units import number_and_unit
from hovi.errors import InputError
from hovi.robot.space.coordinates import Coordinates


class Base(NamedTuple):
    """Bounds of a kind for texts such as "50 %": the name of the limits, and both bounds, (nv,)."""

    name: Any
    lower: npt.NDArray[np.float64]
    upper: npt.NDArray[np.float64]


def number_in(limits: Mapping[str, Any], key: str, default: float) -> float:
    """A number of a table, or its default. Raises InputError."""
    value = limits.get(key, default)
    if not is_number(value):
        raise InputError(f"limits.{key} must be a number, got {value!r}.")
    return float(value)


def entries(
    coordinates: Coordinates, kind: str, given: Any, base: Base | None = None
) -> dict[int, tuple[float, float]]:
    """Bounds by index in v, from any of the accepted forms.

    base: what texts such as "50 %" are fractions of; positions need none.
    """
    found = _pairs(coordinates, kind, given, base)
    if kind == "q" and not coordinates.vector_joints:
        for i in found:
            if i not in coordinates.space.plain[1] and isinstance(given, Mapping):
                raise InputError(
                    f"limits.q: {coordinates.coordinate_names[i]!r} has no position limits, as the "
                    "joint is continuous or floating; leave it out."
                )
        found = {i: pair for i, pair in found.items() if i in coordinates.space.plain[1]}
    return found


def _pairs(
    coordinates: Coordinates, kind: str, given: Any, base: Base | None
) -> dict[int, tuple[float, float]]:
    names = coordinates.coordinate_names
    if isinstance(given, Mapping):
        for name in given:
            if name not in names:
                raise InputError(
                    f"limits.{kind}: {coordinates.owner} has no joint {name!r}: "
                    f"{coordinates.hint(str(name), names)}"
                )
        at = {names.index(name): value for name, value in given.items()}
        return {i: _bounds(coordinates, kind, i, value, base) for i, value in at.items()}
    if is_number(given) or isinstance(given, str):
        given = [given] * coordinates.nv
    if not isinstance(given, Sequence | np.ndarray) or len(given) != coordinates.nv:
        raise InputError(
            f"limits.{kind} must have one entry for each of {', '.join(names)}, got {given!r}."
        )
    return {i: _bounds(coordinates, kind, i, value, base) for i, value in enumerate(given)}


def _bounds(
    coordinates: Coordinates, kind: str, i: int, value: Any, base: Base | None
) -> tuple[float, float]:
    """The bounds of a coordinate: a pair, a number, or a fraction of those of the base."""
    name = coordinates.coordinate_names[i]
    if not isinstance(value, str):
        return _pair(kind, name, value)
    if kind == "q" or base is None:
        if kind != "q":
            number, unit = number_and_unit(value) or (0.0, "")
            of = f", but a base has no limit on the {kind} of which that is a fraction"
            why, such = (of, "") if unit == "%" else ("", f" such as {number or 1.0:g}")
            raise InputError(
                f"limits.{kind} of {name!r} is {value!r}{why}: give a number{such}, or a pair "
                "lower < upper."
            )
        raise InputError(
            f"limits.{kind} of {name!r} is {value!r}, and a range of positions has no share: give "
            "a pair lower < upper, or a `margin`, which keeps clear of both ends of all ranges."
        )
    fraction = _fraction(kind, name, value)
    lower, upper = float(base.lower[i]), float(base.upper[i])
    if np.isinf(lower) and np.isinf(upper):
        raise InputError(
            f"limits.{kind} of {name!r} is {value!r} of a limit, but {base.name!r} has none for "
            "this joint: give a number, or a base that has one."
        )
    return fraction * lower, fraction * upper


def _fraction(kind: str, name: str, text: str) -> float:
    """The fraction that a text such as "50 %" says. Raises InputError."""
    number, unit = number_and_unit(text) or (0.0, "")
    if unit != "%" or not 0 < number <= 100:
        raise InputError(
            f"limits.{kind} of {name!r} must be a positive number, a pair lower < upper, or a text "
            f"from above 0 % to 100 % of its limit, such as '50 %', got {shown(text)}."
        )
    return number / 100  # as 0.57 is written: 57 * 1e-2 is another number


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
