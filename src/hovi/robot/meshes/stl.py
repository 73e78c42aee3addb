"""Triangles of STL files, binary and as text."""

from __future__ import annotations

import re

import numpy as np

from hovi.robot.meshes.triangles import Array, BrokenMeshError, Triangles, floats, require_few

_HEADER = 84  # bytes before the first facet: 80 of any content, and the number of facets
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_NUMBERS = rb"((?:\s+[^\s]+){3})\s+"
_FACET_TEXT = re.compile(
    rb"facet\s+normal" + _NUMBERS + rb"outer\s+loop\s+"
    rb"vertex"
    + _NUMBERS
    + rb"vertex"
    + _NUMBERS
    + rb"vertex"
    + _NUMBERS
    + rb"endloop\s+endfacet\s+",
    re.IGNORECASE,
)
_SOLID = re.compile(rb"\s*solid\b[^\r\n]*[\r\n]\s*", re.IGNORECASE)
_END = re.compile(rb"endsolid\b[^\r\n]*\s*", re.IGNORECASE)


def read_stl(content: bytes) -> Triangles:
    """The triangles of an STL file. Raises BrokenMeshError."""
    count = int.from_bytes(content[80:_HEADER], "little") if len(content) >= _HEADER else -1
    if len(content) == _HEADER + count * _FACET.itemsize:
        facets = np.frombuffer(content, _FACET, count, _HEADER)
        return _of_corners(facets["corners"].reshape(-1, 3).astype(np.float64))
    if _SOLID.match(content) is None:
        whole = max(len(content) - _HEADER, 0) / _FACET.itemsize
        raise BrokenMeshError(
            f"is no STL: it declares {max(count, 0):,} facets and has the bytes of {whole:.6g}; "
            "export it again."
        )
    return _of_corners(_corners_in_text(content))


def _corners_in_text(content: bytes) -> Array:
    """The corners of all facets of all solids, shape (3 K, 3)."""
    found, at, content = list[bytes](), 0, content + b"\n"
    while solid := _SOLID.match(content, at):
        at = solid.end()
        while facet := _FACET_TEXT.match(content, at):
            found += facet.groups()[1:]
            at = facet.end()
        end = _END.match(content, at)
        if end is None:
            raise _no_facet(content, at)
        at = end.end()
    if at < len(content):
        raise _no_facet(content, at)
    require_few(len(found) // 3)
    return floats(b" ".join(found)).reshape(-1, 3)


def _no_facet(content: bytes, at: int) -> BrokenMeshError:
    line = content.count(b"\n", 0, at) + 1
    return BrokenMeshError(
        f"is no STL: line {line} is neither a facet of three vertices nor the end of a solid."
    )


def _of_corners(corners: Array) -> Triangles:
    """The facets with these corners, (3 K, 3), of which equal ones become one vertex."""
    rows = np.ascontiguousarray(corners + 0.0)  # of zeros with a sign, too
    as_bytes = rows.view(f"V{3 * rows.itemsize}").reshape(-1)
    _, kept, which = np.unique(as_bytes, return_index=True, return_inverse=True)
    return Triangles(rows[kept], which.reshape(-1, 3))
