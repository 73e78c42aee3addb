"""Tables that Python gives in the words of a scene file: a mapping of known keys."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from hovi.errors import InputError, nearest


def entries_of(
    table: Mapping[Any, Any], name: str, keys: Iterable[str], needed: Mapping[str, str]
) -> dict[str, Any]:
    """The entries of a table, without those that are None.

    name: of the table in messages, such as "segments[0]". keys: the valid ones.
    needed: the keys that have to be given, with what they must be.
    Raises InputError for an unknown or a missing key, in the words of a scene file.
    """
    valid = tuple(keys)
    for key in table:
        if key not in valid:
            raise InputError(f"unknown key `{name}.{key}`; {nearest(str(key), valid)}")
    given = {str(key): value for key, value in table.items() if value is not None}
    for key, expected in needed.items():
        if key not in given:
            raise InputError(f"`{name}.{key}` is missing; it must be {expected}.")
    return given
