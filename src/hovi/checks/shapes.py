"""Shapes of arrays, and arrays from what numpy converts to numbers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.checks.kinds import NUMBERS, MismatchError, shown
from hovi.errors import InputError

Array = npt.NDArray[np.float64]


def numbers_of(name: str, value: npt.ArrayLike, *shape: int | None) -> Array:
    """`value` as a C-contiguous array of doubles.

    name: of the argument, for the message. shape: None stands for any length, nothing for any
    shape. Raises InputError.
    """
    try:
        array: Array = NUMBERS.accept(value)
    except MismatchError as mismatch:
        words = mismatch.args[0] if mismatch.args else "numbers"
        raise InputError(f"{name} must be {words}, got {shown(value)}.") from None
    if shape:
        require_shape(name, array, *shape)
    return array


def require_shape(name: str, array: npt.NDArray[Any], *shape: int | None) -> None:
    """Raise InputError unless an array has a shape, in which None stands for any length.

    name: of the argument, for the message.
    """
    if array.shape == shape:
        return
    same = len(shape) == array.ndim
    if same and all(size in (None, n) for size, n in zip(shape, array.shape, strict=True)):
        return
    words = ", ".join("any" if size is None else str(size) for size in shape)
    comma = "," if len(shape) == 1 else ""
    raise InputError(f"{name} must have shape ({words}{comma}), got {array.shape}.")


def require_rows(rows: Iterable[tuple[str, npt.NDArray[Any], int]]) -> None:
    """Raise InputError unless arrays are rows (..., n) that broadcast against each other.

    rows: name, array and n of each.
    """
    first: tuple[int, ...] | None = None
    for name, array, n in rows:
        if not array.ndim or array.shape[-1] != n:
            raise InputError(f"{name} must have shape (..., {n}), got {array.shape}.")
        first = _broadcast(name, first, array.shape[:-1])


def _broadcast(name: str, first: tuple[int, ...] | None, lead: tuple[int, ...]) -> tuple[int, ...]:
    """The shape to which rows of shapes (*first, n) and (*lead, m) broadcast, without n and m.

    first: None if there is none yet. Raises InputError.
    """
    if first is None or lead == first:
        return lead
    try:
        return np.broadcast_shapes(first, lead)
    except ValueError:
        raise InputError(
            f"{name} must have one row or as many as the arguments before it: its rows {lead} do "
            f"not broadcast with {first}."
        ) from None
