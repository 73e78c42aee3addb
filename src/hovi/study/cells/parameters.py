"""The parameters of a study: what its cells put into the scene, as columns of a table."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Any, Literal

from hovi.study.cells.axis import Axis
from hovi.study.cells.field_path import FieldPath, spelled
from hovi.system.dataclass import dataclass

Kind = Literal["number", "whole", "truth", "text", "json"]
Entry = tuple[str | int, ...]

MAX_ENTRIES = 64
"""Largest number of entries of a value that have a column each."""
MAX_WHOLE = 2**63 - 1
_KINDS: dict[type, Kind] = {bool: "truth", int: "whole", float: "number", str: "text"}


@dataclass(frozen=True)
class Parameter:
    """A column of the table: a field that varies, or an entry of one.

    name: the dotted path. field: of the axes. entry: keys inside the field's value.
    """

    name: str
    kind: Kind
    field: FieldPath
    entry: Entry = ()

    def of(self, value: Any) -> Any:
        """The column's value from the field's."""
        for key in self.entry:
            value = value[key]
        if self.kind == "json":
            return json.dumps(value, sort_keys=True)
        return float(value) if self.kind == "number" else value


def parameters_of(axes: Sequence[Axis]) -> tuple[Parameter, ...]:
    """The columns of all fields; values of one form have a column for each of their entries."""
    found: list[Parameter] = []
    for axis in axes:
        rows = axis.values[:1] if axis.uniform else axis.values
        for i, path in enumerate(axis.fields):
            found += _columns(path, [row[i] for row in rows])
    return tuple(found)


def _columns(path: FieldPath, values: Iterable[Any]) -> list[Parameter]:
    """The columns of a field with these values."""
    kinds: dict[Entry, Kind] | None = None
    for value in values:
        here = dict(_leaves(value, ()))
        if kinds is None:
            kinds = here
        elif kinds.keys() != here.keys():
            return [Parameter(path.text, "json", path)]
        else:
            kinds = {entry: _common(kinds[entry], here[entry]) for entry in kinds}
    if not kinds or len(kinds) > MAX_ENTRIES:
        return [Parameter(path.text, "json", path)]
    return [Parameter(path.text + spelled(e), kind, path, e) for e, kind in kinds.items()]


def _leaves(value: Any, above: Entry) -> Iterable[tuple[Entry, Kind]]:
    if isinstance(value, dict) and value:
        for key, each in value.items():
            yield from _leaves(each, (*above, key))
    elif isinstance(value, list) and value:
        for i, each in enumerate(value):
            yield from _leaves(each, (*above, i))
    else:
        kind = _KINDS.get(type(value), "json")
        yield above, "json" if kind == "whole" and abs(value) > MAX_WHOLE else kind


def _common(one: Kind, other: Kind) -> Kind:
    if one == other:
        return one
    return "number" if {one, other} == {"number", "whole"} else "json"
