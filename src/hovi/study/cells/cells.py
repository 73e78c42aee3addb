"""The cells of a study: all combinations of the values of its axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from hovi.errors import SceneError
from hovi.study.cells.axis import Axis
from hovi.study.cells.field_path import FieldPath
from hovi.study.cells.template import Template, content_hash

MAX_CELLS = 100_000_000
"""Maximum number of cells."""
FORMAT = 1
"""Of what is hashed; to be raised whenever equal scenes would be planned differently."""


@dataclass(frozen=True)
class Cell:
    """One plan of a study.

    number: of the cell, from 0, the last axis fastest.
    values: what it puts into the template. ends: see Axis.
    key: hash of all that its result depends on; two cells of one content have one key.
    """

    number: int
    values: tuple[tuple[FieldPath, Any], ...]
    ends: tuple[str, ...]
    key: str


@dataclass(frozen=True, eq=False)
class Cells:
    """All cells of a study, made when they are asked for.

    warm: whether each cell but the first starts from the motion of a neighbour.
    """

    template: Template
    axes: tuple[Axis, ...]
    warm: bool = False

    def __post_init__(self) -> None:
        if self.count > MAX_CELLS:
            raise SceneError(
                f"the axes of the study have {self.count:,} combinations, at most {MAX_CELLS:,} "
                "are planned: give one of them fewer values."
            )
        _require_separate(self.axes)

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """The number of values of each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def count(self) -> int:
        """The number of cells, 1 without axes."""
        return math.prod(self.shape)

    def places(self, number: int) -> tuple[int, ...]:
        """The number of each axis' value in a cell."""
        places = []
        for length in reversed(self.shape):
            number, place = divmod(number, length)
            places.append(place)
        return tuple(reversed(places))

    def number(self, places: Sequence[int]) -> int:
        """The number of the cell with these values."""
        number = 0
        for place, length in zip(places, self.shape, strict=True):
            number = number * length + place
        return number

    def parent(self, number: int) -> int | None:
        """The cell from whose motion a cell starts; None for none.

        It is one step back along the last axis on which the cell is not at the beginning, so the
        first cell of each line along the last axis starts from that of the line before.
        """
        if not self.warm:
            return None
        places = list(self.places(number))
        for axis in reversed(range(len(places))):
            if places[axis] > 0:
                places[axis] -= 1
                return self.number(places)
        return None

    def cell(self, number: int) -> Cell:
        """A cell. Raises SceneError if its values have no place in the template."""
        return Cell(number, self.values(number), self.ends, self.key(number))

    def key(self, number: int) -> str:
        """The key of a cell: see Cell. Raises SceneError."""
        chain = [number]
        while (parent := self.parent(chain[-1])) is not None and parent not in self._keys:
            chain.append(parent)
        above = None if parent is None else self._keys[parent]
        for each in reversed(chain):
            above = self._keys[each] if each in self._keys else self._key(each, above)
            if self.warm:  # others need no key of another cell
                self._keys[each] = above
        assert above is not None
        return above

    @cached_property
    def ends(self) -> tuple[str, ...]:
        """The ends that are replaced by configurations: see Axis."""
        return tuple(sorted({end for axis in self.axes for end in axis.ends}))

    @cached_property
    def _keys(self) -> dict[int, str]:
        return {}

    def values(self, number: int) -> tuple[tuple[FieldPath, Any], ...]:
        """What a cell puts into the template."""
        chosen = zip(self.axes, self.places(number), strict=True)
        return tuple(
            pair
            for axis, place in chosen
            for pair in zip(axis.fields, axis.values[place], strict=True)
        )

    def _key(self, number: int, parent: str | None) -> str:
        table = self.template.with_values(self.values(number))
        content = {"format": FORMAT, "scene": table, "files": self.template.files(table)}
        if self.ends:
            content["ends"] = list(self.ends)
        if self.warm:
            content["parent"] = parent
        return content_hash(content)


def _require_separate(axes: Sequence[Axis]) -> None:
    """Raise SceneError if a field is part of another one."""
    fields = [field for axis in axes for field in axis.fields]
    for i, one in enumerate(fields):
        for other in fields[i + 1 :]:
            shorter, longer = sorted((one.keys, other.keys), key=len)
            if longer[: len(shorter)] == shorter:
                raise SceneError(
                    f"the study varies {one.text!r} and {other.text!r}, of which one contains the "
                    "other: vary them in one list or table."
                )
