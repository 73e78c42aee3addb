"""An axis of a study: fields that vary together, and their values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from hovi.errors import SceneError
from hovi.study.cells.field_path import FieldPath
from hovi.system.dataclass import dataclass

MAX_VALUES = 10_000_000
"""Maximum number of values of an axis."""
MAX_NUMBERS = 200_000_000
"""Maximum number of sampled numbers of an axis, which are kept in memory."""


@dataclass(frozen=True, eq=False)
class Axis:
    """Fields of a scene that vary together.

    fields: of which no one is part of another.
    values: what each step puts into them, one entry for each field.
    uniform: whether all values have the form of the first one, as samples have.
    ends: "start" or "goal", where a frame's target is replaced by a configuration that reaches it.
    """

    fields: tuple[FieldPath, ...]
    values: Sequence[tuple[Any, ...]]
    uniform: bool = False
    ends: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if len(self.values) == 0:
            raise SceneError(f"the study's axis of {self.name} has no values: give at least one.")

    @property
    def name(self) -> str:
        """The fields, in words."""
        return " and ".join(repr(each.text) for each in self.fields)


@dataclass(frozen=True, eq=False)
class Rows(Sequence[tuple[Any, ...]]):
    """The rows of an array as the values of an axis, made when they are taken.

    array: shape (M, d). make: the values of the fields from a row as a list.
    """

    array: npt.NDArray[np.float64]
    make: Callable[[list[float]], tuple[Any, ...]] = field(default=tuple)

    def __len__(self) -> int:
        return len(self.array)

    @overload
    def __getitem__(self, i: int) -> tuple[Any, ...]: ...
    @overload
    def __getitem__(self, i: slice) -> Sequence[tuple[Any, ...]]: ...
    def __getitem__(self, i: int | slice) -> Any:
        if isinstance(i, slice):
            return Rows(self.array[i], self.make)
        return self.make(self.array[i].tolist())


def check_count(count: int, dimensions: int, what: str) -> None:
    """Raise SceneError for more samples than memory holds. what: names them in the message."""
    if not 1 <= count <= MAX_VALUES or count * dimensions > MAX_NUMBERS:
        raise SceneError(
            f"{what} must be from 1 to {MAX_VALUES:,}, and at most {MAX_NUMBERS:,} numbers in "
            f"all, got {count:,} of {dimensions} numbers: take fewer."
        )
