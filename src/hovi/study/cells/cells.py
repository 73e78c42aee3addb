"""The cells of a study: all combinations of the values of its axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

from hovi.errors import SceneError
from hovi.study.cells.axis import Axis
from hovi.study.cells.field_path import FieldPath
from hovi.study.cells.template import Template, content_hash
from hovi.system.dataclass import dataclass

MAX_CELLS = 100_000_000
"""Maximum number of cells."""
OWN_GUESS_SPACING = 4
"""Every how many cells along each axis one starts from its own guess, too."""
FORMAT = 2
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

    warm: whether each cell but the first starts from the motion of a neighbour: see `parents`.
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

    def parents(self, number: int) -> tuple[int, ...]:
        """The cells of which one gives its motion to a cell as a guess; none for the first cell.

        They are its neighbours on a grid that is twice as coarse: one spacing before it and one
        behind it on the last axis on which it is no point of that grid.
        """
        places, spacing = self.places(number), self._spacing(number)
        if not self.warm or spacing == 0:
            return ()
        axis = max(i for i, place in enumerate(places) if place & spacing)
        return self._beside(places, axis, spacing)

    def children(self, number: int) -> tuple[int, ...]:
        """The cells to which a cell is a parent, those of coarse grids first."""
        if not self.warm:
            return ()
        places, own = self.places(number), self._spacing(number)
        found: list[int] = []
        last = max((i for i, place in enumerate(places) if place & own), default=-1)
        spacing = own or 1 << max(self.shape).bit_length()
        for axis in range(last + 1, len(places)):
            found += self._beside(places, axis, own) if own else ()
        while spacing := spacing >> 1:
            for axis in range(len(places)):
                found += self._beside(places, axis, spacing)
        return tuple(found)

    def rank(self, number: int) -> int:
        """How fine the coarsest grid with a cell is: a smaller number for a coarser one."""
        return -self._spacing(number)

    def takes_own_guess(self, number: int) -> bool:
        """Whether a cell starts from its own guess as well as from a parent's motion.

        So minima that are lower in a part of the grid are found there, and go to its neighbours.
        """
        spacing = self._spacing(number)
        return spacing == 0 or spacing >= OWN_GUESS_SPACING

    def _spacing(self, number: int) -> int:
        """The spacing, a power of two, of the coarsest grid with a cell; 0 for the first cell."""
        places = self.places(number)
        return min((place & -place for place in places if place), default=0)

    def _beside(self, places: tuple[int, ...], axis: int, spacing: int) -> tuple[int, ...]:
        """The cells before and behind a place on an axis."""
        moved = (places[axis] - spacing, places[axis] + spacing)
        return tuple(
            self.number([*places[:axis], place, *places[axis + 1 :]])
            for place in moved
            if 0 <= place < self.shape[axis]
        )

    def cell(self, number: int) -> Cell:
        """A cell. Raises SceneError if its values have no place in the template."""
        return Cell(number, self.values(number), self.ends, self.key(number))

    def key(self, number: int) -> str:
        """The key of a cell: see Cell. Raises SceneError."""
        if not self.warm:  # keys of others are not needed
            return self._key(number, ())
        if number not in self._keys:
            above = tuple(self.key(parent) for parent in self.parents(number))
            self._keys[number] = self._key(number, above)
        return self._keys[number]

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

    def _key(self, number: int, parents: tuple[str, ...]) -> str:
        table = self.template.with_values(self.values(number))
        content = {"format": FORMAT, "scene": table, "files": self.template.files(table)}
        if self.ends:
            content["ends"] = list(self.ends)
        if self.warm:
            content["parents"] = list(parents)
            content["own guess"] = self.takes_own_guess(number)
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
