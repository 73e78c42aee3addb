"""Durations on the command line."""

from __future__ import annotations

from hovi.errors import InputError


def positive_seconds(flag: str, text: str) -> float:
    """The value of a flag in [s], from a number or a text such as "2 min". Raises InputError."""
    from hovi.checks.units import seconds

    try:
        number = float(text)
    except ValueError:
        number = seconds(text, flag)
    if not 0 < number < float("inf"):
        raise InputError(f"{flag} must be a positive number of seconds, not {text}.")
    return number
