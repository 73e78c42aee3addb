"""Triangles of PLY files, as text and binary."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from hovi.robot.meshes.polygons import triangulated
from hovi.robot.meshes.triangles import Array, BrokenMeshError, Index, Triangles, floats
from hovi.system.dataclass import dataclass

TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
"""NumPy's names of the types of properties."""
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
LISTS = "vertex_indices", "vertex_index"
MAX_PROPERTIES = 256
_MAX_HEADER = 65_536
_END = re.compile(rb"\r?\nend_header[ \t]*\r?\n")


@dataclass(frozen=True)
class _Property:
    """name, type of its values, and type of the number of values of a list, or ""."""

    name: str
    type: str
    counted: str


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]

    def index(self, *names: str) -> int:
        """Where the first property with one of these names is. Raises BrokenMeshError."""
        found = [k for k, each in enumerate(self.properties) if each.name in names]
        if not found:
            raise BrokenMeshError(f"has no property {names[0]} of its element {self.name}.")
        return found[0]


def read_ply(content: bytes) -> Triangles:
    """The triangles of a PLY file. Raises BrokenMeshError."""
    end = _END.search(content, 0, _MAX_HEADER)
    if not content.startswith(b"ply") or end is None:
        raise BrokenMeshError("is no PLY: it has no header between ply and end_header.")
    order, elements = _header(content[: end.start()].decode("latin-1"))
    reader = _Binary(content, end.end(), order) if order else _Text(content[end.end() :])
    vertices: Array | None = None
    faces: Column | None = None
    for element in elements:
        rows = reader.rows(element)
        if element.name == "vertex":
            columns = [rows[element.index(axis)] for axis in "xyz"]
            if any(isinstance(column, tuple) for column in columns):
                raise BrokenMeshError("has lists as coordinates of its vertices: export it again.")
            vertices = np.column_stack(columns).astype(np.float64)
        elif element.name == "face":
            faces = rows[element.index(*LISTS)]
    reader.require_end()
    if vertices is None or not isinstance(faces, tuple):
        raise BrokenMeshError("needs elements vertex and face, with a list of its vertices.")
    return Triangles(vertices, triangulated(vertices, *faces))


Column = Array | tuple[Index, Index]
"""Values of a property, (M,), or of a list: numbers of values, (M,), and all values, flat."""


def _header(text: str) -> tuple[str, list[_Element]]:
    """The byte order, "" for text, and the elements in their order."""
    order, elements = None, list[_Element]()
    for line in text.splitlines()[1:]:
        match line.split():
            case ["format", name, "1.0"] if order is None and name in FORMATS:
                order = FORMATS[name]
            case ["element", name, count] if _is_count(count):
                elements.append(_Element(name, int(count), ()))
            case ["property", *rest] if elements and (one := _property(rest)):
                last = elements.pop()
                elements.append(_Element(last.name, last.count, (*last.properties, one)))
            case ["comment" | "obj_info", *_] | []:
                continue
            case _:
                raise BrokenMeshError(f"has a header with {line[:60]!r}, which is not of PLY.")
    if order is None or len({each.name for each in elements}) < len(elements):
        raise BrokenMeshError("has a header without format, or with an element twice.")
    return order, elements


def _is_count(word: str) -> bool:
    return word.isascii() and word.isdigit() and len(word) < 16


def _property(words: list[str]) -> _Property | None:
    match words:
        case ["list", count, kind, name] if TYPES.get(count, "f")[0] in "iu" and kind in TYPES:
            return _Property(name, TYPES[kind], TYPES[count])
        case [kind, name] if kind in TYPES:
            return _Property(name, TYPES[kind], "")
    return None


def _too_short(element: _Element) -> BrokenMeshError:
    return BrokenMeshError(
        f"declares {element.count:,} elements {element.name!r} and has fewer: export it again."
    )


class _Binary:
    """Reads one element after the other. order: "<" or ">"."""

    def __init__(self, content: bytes, at: int, order: str) -> None:
        self.content, self.at, self.order = content, at, order

    def rows(self, element: _Element) -> list[Column]:
        """The columns of an element, one for each property."""
        first = self._lengths_of_first(element)
        row = np.dtype(
            [
                field
                for k in range(len(element.properties))
                for field in self._fields(element, k, first)
            ]
        )
        if (element.count and not row.itemsize) or len(self.content) - self.at < element.count:
            raise _too_short(element)
        if len(self.content) - self.at >= row.itemsize * element.count:
            table = np.frombuffer(self.content, row, element.count, self.at)
            if all((table[f"n{k}"] == length).all() for k, length in first.items()):
                self.at += row.itemsize * element.count
                return list(_columns(element, table))
        return self._one_by_one(element)

    def _fields(self, element: _Element, k: int, lengths: dict[int, int]) -> list[tuple[Any, ...]]:
        """The fields of property k in a row: its values, after their number for a list."""
        each = element.properties[k]
        if not each.counted:
            return [(f"v{k}", self.order + each.type)]
        number = (f"n{k}", self.order + each.counted)
        return [number, (f"v{k}", self.order + each.type, (lengths[k],))]

    def _lengths_of_first(self, element: _Element) -> dict[int, int]:
        """The number of values of each list of the first row; rows mostly have the same."""
        found, at = dict[int, int](), self.at
        for k, each in enumerate(element.properties):
            if each.counted and element.count:
                found[k], at = self._number(each.counted, at, element)
            size = int(each.type[1]) * found.get(k, 1)
            at += size
            if element.count and at > len(self.content):
                raise _too_short(element)
            if each.counted and not element.count:
                found[k] = 0
        return found

    def _number(self, kind: str, at: int, element: _Element) -> tuple[int, int]:
        size = int(kind[1])
        if at + size > len(self.content):
            raise _too_short(element)
        number = int(np.frombuffer(self.content, self.order + kind, 1, at)[0])
        if number < 0:
            raise BrokenMeshError(f"has a list of {number} values in its element {element.name!r}.")
        return number, at + size

    def _one_by_one(self, element: _Element) -> list[Column]:
        """The columns of an element whose lists have different lengths."""
        lengths = [list[int]() for _ in element.properties]
        values = [list[bytes]() for _ in element.properties]
        for _ in range(element.count):
            for k, each in enumerate(element.properties):
                count = 1
                if each.counted:
                    count, self.at = self._number(each.counted, self.at, element)
                end = self.at + count * int(each.type[1])
                if end > len(self.content):
                    raise _too_short(element)
                lengths[k].append(count)
                values[k].append(self.content[self.at : end])
                self.at = end
        columns = list[Column]()
        for each, counts, parts in zip(element.properties, lengths, values, strict=True):
            flat = np.frombuffer(b"".join(parts), self.order + each.type).astype(np.float64)
            columns.append((np.array(counts), _indices(flat)) if each.counted else flat)
        return columns

    def require_end(self) -> None:
        """Raise BrokenMeshError if something follows."""
        if self.at != len(self.content):
            raise BrokenMeshError(
                f"has {len(self.content) - self.at:,} bytes after its last element: export "
                "it again."
            )


def _columns(element: _Element, table: np.ndarray) -> Iterator[Column]:
    for k, each in enumerate(element.properties):
        values = table[f"v{k}"].astype(np.float64)
        if each.counted:
            counts = np.full(len(table), values.shape[1], dtype=np.int64)
            yield counts, _indices(values.reshape(-1))
        else:
            yield values


class _Text:
    """Reads one element after the other of a text, in which every row is a line."""

    def __init__(self, content: bytes) -> None:
        self.lines = [line for line in content.splitlines() if line.strip()]
        self.used = self.at = 0
        self.numbers = np.empty(0)

    def rows(self, element: _Element) -> list[Column]:
        """The columns of an element, one for each property."""
        lines = self.lines[self.used : self.used + element.count]
        if len(lines) < element.count:
            raise _too_short(element)
        self.used += element.count
        self.numbers, self.at = floats(b"\n".join(lines)), 0
        columns = self._columns(element)
        if self.at != len(self.numbers):
            raise BrokenMeshError(
                f"has lines of its element {element.name!r} with more numbers than it declares: "
                "export it again."
            )
        return columns

    def _columns(self, element: _Element) -> list[Column]:
        columns = [list[float]() for _ in element.properties]
        lengths = [list[int]() for _ in element.properties]
        if not any(each.counted for each in element.properties):
            width = len(element.properties)
            table = self._take(width * element.count, element).reshape(-1, max(width, 1))
            return [table[:, k] for k in range(width)]
        if len(element.properties) == 1 and (lists := self._equal_lists(element.count)):
            return [lists]
        for _ in range(element.count):
            for k, each in enumerate(element.properties):
                count = self._length(element) if each.counted else 1
                lengths[k].append(count)
                columns[k] += self._take(count, element).tolist()
        flat = [np.array(each, dtype=np.float64) for each in columns]
        pairs = zip(element.properties, lengths, flat, strict=True)
        return [
            (np.array(counts, dtype=np.int64), _indices(values)) if each.counted else values
            for each, counts, values in pairs
        ]

    def _equal_lists(self, count: int) -> tuple[Index, Index] | None:
        """The lists of an element that has nothing else, if all of them have the same length."""
        rest = self.numbers[self.at :]
        width = 1 + int(rest[0]) if count and 0.0 <= rest[0] < len(rest) else 0
        if not width or width * count > len(rest):
            return None
        table = rest[: width * count].reshape(count, width)
        if not (table[:, 0] == width - 1).all():
            return None
        self.at += width * count
        counts = np.full(count, width - 1, dtype=np.int64)
        return counts, _indices(table[:, 1:].reshape(-1))

    def _length(self, element: _Element) -> int:
        count = float(self._take(1, element)[0])
        if count < 0 or count != int(count):
            raise BrokenMeshError(
                f"has a list of {count:g} values in its element {element.name!r}."
            )
        return int(count)

    def _take(self, count: int, element: _Element) -> Array:
        if count > len(self.numbers) - self.at:
            raise _too_short(element)
        self.at += count
        return self.numbers[self.at - count : self.at]

    def require_end(self) -> None:
        """Raise BrokenMeshError if something follows."""
        if self.used != len(self.lines):
            raise BrokenMeshError(
                f"has {len(self.lines) - self.used:,} lines after its last element: export it "
                "again."
            )


def _indices(values: Array) -> Index:
    """Values of a list as integers; others than these can only be no vertices."""
    if not np.isfinite(values).all() or (values != np.trunc(values)).any():
        return np.full(len(values), -1, dtype=np.int64)
    return np.clip(values, -1.0, 2.0**53).astype(np.int64)
