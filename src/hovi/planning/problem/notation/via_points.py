"""Via points from tables, in the words of a scene file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hovi.checks.kinds import shown
from hovi.checks.units import SECONDS_IN_WORDS
from hovi.errors import InputError
from hovi.planning.problem.goals import Via
from hovi.planning.problem.notation.ends import EndError, end_of

TIME_IN_WORDS = f'{SECONDS_IN_WORDS}, or "free"'
"""What the time of a via point is, in messages about scene files and in Python."""


def as_via(given: Any, number: int) -> Via:
    """A via point from a Via, or from a table as [[via]] in a scene file. Raises InputError."""
    if isinstance(given, Via):
        return given
    if not isinstance(given, Mapping):
        raise InputError(
            "via must be a list of hovi.Via(time, goal), or of tables with a time and a goal, got "
            f"{shown(given)}."
        )
    name, table = f"via[{number}]", dict(given)
    if "time" not in table:
        raise EndError(f"`{name}.time` is missing; it must be {TIME_IN_WORDS}.", "time")
    time = table.pop("time")
    require_no_rates(table)
    return Via(time, end_of(table, name))


def require_no_rates(table: Mapping[str, Any]) -> None:
    """Raise EndError for keys of a state that via points do not take."""
    for key in ("a", "free_acceleration"):
        if table.get(key) is not None:
            raise EndError(f"a via point takes no `{key}`: leave it out.", key)
