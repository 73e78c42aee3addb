"""Names that callers give to things of theirs."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from hovi.errors import InputError

MAX_LENGTH = 1_000
"""Largest number of characters of a name."""


def require_name(name: str, what: str) -> None:
    """Raise InputError for a name with a NUL or another control character, and for a long one.

    Such a name would be cut off or lost in files and messages. what: the thing, for the message.
    """
    if not name.isprintable() or len(name) > MAX_LENGTH:
        raise InputError(
            f"the name of {what} must be printable characters, at most {MAX_LENGTH:,}, got "
            f"{name[:80]!r}."
        )


def as_names(values: Iterable[Any]) -> tuple[Any, ...]:
    """Names as a tuple; a single string counts as one name. Raises InputError for others."""
    if isinstance(values, str | Path):
        return (values,)
    try:
        names = tuple(values)
    except TypeError:  # no iterable
        names = (None,)
    if not all(isinstance(name, str | Path) for name in names):
        raise InputError(f"expected a list of names, or a single one, got {values!r}.")
    return names
