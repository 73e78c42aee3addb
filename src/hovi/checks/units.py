"""Parsing of numbers with a unit: "2 s", "0.1 mm", "0.01 deg"."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from hovi.checks.kinds import is_number, shown
from hovi.errors import InputError, nearest

LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
"""Units of lengths, in [m]."""
ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": np.pi / 180}
"""Units of angles, in [rad]."""
FRACTIONS = {"": 1.0, "%": 1e-2}
"""Units of relative errors, in 1."""
DURATIONS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0}
"""Units of durations, in [s]."""
TINIEST = 1e-9
"""Least measure, and one over the largest, in SI units: squares of others lose all digits."""
_TEXT = re.compile(r"([0-9.]+(?:[eE][+-]?[0-9]+)?)\s*([^\W\d]*|%)")
_MEASURE = re.compile(r"([0-9]*\.?[0-9]+(?:[eE][+-]?[0-9]+)?)\s*([a-z]*(?:/s(?:\^2)?)?)")

SECONDS_IN_WORDS = 'a positive number of seconds, or a text such as "500 ms"'
"""What a given duration or a time is, in messages about scene files and in Python."""
DURATION_IN_WORDS = (
    'a positive number of seconds, a text such as "2 s", or a list [lower, upper] of two'
)
"""What a duration is, in messages about scene files and in Python."""
Duration = float | str | tuple[float | str, float | str]
"""A duration, or (lower, upper) bounds of a free duration."""


def number_and_unit(text: str) -> tuple[float, str] | None:
    """The number and the unit of a text, "" for no unit; None if it does not parse."""
    match = _TEXT.fullmatch(text.strip())
    if match is None:
        return None
    try:
        return float(match[1]), match[2]
    except ValueError:  # such as 1.2.3
        return None


def seconds(given: Any, what: str) -> float:
    """A duration or time, in [s].

    given: a number of seconds, or a text such as "2 s", "500 ms" or "1.5 min".
    what: its name in messages, such as "the duration".
    Raises InputError for anything else.
    """
    if is_number(given):
        return _as_double(given, what)
    parsed = number_and_unit(given) if isinstance(given, str) else None
    if parsed is None:
        raise InputError(
            f"{what} must be a number of seconds or a text such as '2 s', '500 ms' or '1.5 min', "
            f"got {given!r}."
        )
    number, unit = parsed
    if not unit:
        raise InputError(f"{what} {given!r} has no unit: write '{given.strip()} s', for example.")
    if unit not in DURATIONS:
        raise InputError(f"{what} {given!r} has the unit {unit!r}: {nearest(unit, DURATIONS)}")
    return number * DURATIONS[unit]


def length(given: Any, what: str) -> float:
    """A positive length in [m], from a number or a text such as "5 mm". Raises InputError."""
    return _measure(given, what, LENGTHS, "metres", "5 mm")


def angle(given: Any, what: str) -> float:
    """A positive angle in [rad], from a number or a text such as "5 deg". Raises InputError."""
    return _measure(given, what, ANGLES, "radians", "5 deg")


def speed(given: Any, what: str) -> float:
    """A positive speed in [m/s], from a number or a text such as "250 mm/s". Raises InputError."""
    return _measure(given, what, _per_second(LENGTHS), "m/s", "250 mm/s")


def angular_speed(given: Any, what: str) -> float:
    """The same in [rad/s], such as "30 deg/s". Raises InputError."""
    return _measure(given, what, _per_second(ANGLES), "rad/s", "30 deg/s")


def acceleration(given: Any, what: str) -> float:
    """The same in [m/s^2], such as "2 m/s^2". Raises InputError."""
    return _measure(given, what, _per_second(_per_second(LENGTHS)), "m/s^2", "2 m/s^2")


def _per_second(units: Mapping[str, float]) -> dict[str, float]:
    """The units of a rate: "m/s" of "m", and "m/s^2" of that."""
    return {f"{x}^2" if x.endswith("/s") else f"{x}/s": size for x, size in units.items()}


def _measure(given: Any, what: str, units: Mapping[str, float], of: str, such: str) -> float:
    """A positive number, in the first of some units, or a text with any of them."""
    number, unit = given, next(iter(units))
    if isinstance(given, str):
        parsed = _MEASURE.fullmatch(given.strip())
        number, unit = (float(parsed[1]), parsed[2]) if parsed else (None, "")
        if parsed and unit not in units:
            has = f"the unit {unit!r}" if unit else "no unit"
            raise InputError(f"{what} {given!r} has {has}: {nearest(unit, units)}")
    size = _as_double(number, what) * units[unit] if is_number(number) else math.nan
    if not TINIEST <= size <= 1.0 / TINIEST:
        raise InputError(
            f"{what} must be a positive number of {of} or a text such as {such!r}, got "
            f"{shown(given)}."
        )
    return size


def as_time_limit(given: float | str | None) -> float | None:
    """A time limit in [s]; None for no limit. Raises InputError for one that is not positive."""
    limit = None if given is None else seconds(given, "time_limit")
    if limit is not None and not limit > 0:
        raise InputError(f"time_limit must be positive, in seconds, got {given}.")
    return limit


def _as_double(number: float, what: str) -> float:
    try:
        return float(number)
    except OverflowError:  # an integer of hundreds of digits
        raise InputError(f"{what} must be a number of seconds, got {shown(number)}.") from None


def as_duration(given: Any) -> float | tuple[float, float]:
    """A duration in [s], or (lower, upper) bounds of a free one.

    Raises InputError for what is neither, not positive or not finite, and for a lower bound that is
    not below the upper one.
    """
    if isinstance(given, str) or is_number(given):
        ends: tuple[float, ...] = (seconds(given, "the duration"),)
    else:
        ends = _bounds(given)
    if not all(math.isfinite(each) and each > 0 for each in ends):
        raise _no_duration(given)
    if len(ends) == 1:
        return ends[0]
    lower, upper = ends
    if lower >= upper:
        raise InputError(
            "`duration` must be a list [lower, upper] whose lower bound is below the upper one, "
            f"but it is {_as_given(given)}."
        )
    return lower, upper


def in_words(duration: float | tuple[float, float]) -> str:
    """A duration in [s], or bounds of it, such as "1.5 s" and "1 to 4 s"."""
    ends = duration if isinstance(duration, tuple) else (duration,)
    return f"{' to '.join(f'{T:g}' for T in ends)} s"


def _bounds(given: Any) -> tuple[float, float]:
    try:
        lower, upper = given
    except (TypeError, ValueError):
        raise _no_duration(given) from None
    return seconds(lower, "the duration"), seconds(upper, "the duration")


def _no_duration(given: Any) -> InputError:
    return InputError(f"`duration` must be {DURATION_IN_WORDS}, but it is {_as_given(given)}.")


def _as_given(given: Any) -> str:
    pair = isinstance(given, list | tuple) and len(given) == 2
    return f"[{', '.join(map(_number, given))}]" if pair else _number(given)


def _number(given: Any) -> str:
    """A duration in a message, with whole numbers without a point."""
    return f"{given:.15g}" if isinstance(given, float) else shown(given)
