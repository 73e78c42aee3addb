"""Triangles of OBJ files."""

from __future__ import annotations

import re

import numpy as np

from hovi.robot.meshes.polygons import triangulated
from hovi.robot.meshes.triangles import Array, BrokenMeshError, Index, Triangles, floats, integers

IGNORED = frozenset(
    (
        b"vn vt vp g o s l p usemtl mtllib mg bevel c_interp d_interp lod shadow_obj trace_obj "
    ).split()
) | {b"usemap", b"maplib"}
"""Words that begin a line which does not change the surface."""

_CONTINUED = re.compile(rb"\\\r?\n")
_COMMENT = re.compile(rb"#[^\r\n]*")
_LINE = re.compile(rb"^[ \t]*([^\s]+)[ \t]*([^\r\n]*)", re.MULTILINE)


def read_obj(content: bytes) -> Triangles:
    """The triangles of an OBJ file. Raises BrokenMeshError."""
    text = _COMMENT.sub(b"", _CONTINUED.sub(b" ", content)).replace(b"\r", b"\n")
    places, faces, before = list[bytes](), list[bytes](), list[int]()
    for word, rest in _LINE.findall(text):
        if word == b"v":
            places.append(rest)
        elif word == b"f":
            faces.append(rest)
            before.append(len(places))
        elif word not in IGNORED:
            raise BrokenMeshError(
                f"has a line {word[:40].decode(errors='replace')!r}, which hovi does not read: "
                "export it as triangles."
            )
    vertices = _vertices(places)
    counts, corners = _corners(faces, np.array(before, dtype=np.int64))
    return Triangles(vertices, triangulated(vertices, counts, corners, first=1))


def _vertices(lines: list[bytes]) -> Array:
    """x, y and z of each line, (M, 3); a fourth number divides them, and three more are a color."""
    counts = np.array([len(line.split()) for line in lines], dtype=np.int64)
    if not np.isin(counts, (3, 4, 6, 7)).all():
        raise BrokenMeshError("has vertices without three coordinates: export it again.")
    numbers, starts = floats(b" ".join(lines)), np.cumsum(counts) - counts
    vertices = numbers[starts[:, None] + np.arange(3)] if len(starts) else np.empty((0, 3))
    weighted = np.isin(counts, (4, 7))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        vertices[weighted] /= numbers[starts[weighted] + 3][:, None]
    return vertices


def _corners(lines: list[bytes], before: Index) -> tuple[Index, Index]:
    """Numbers of corners of all faces, and their vertices counted from 0.

    before: number of vertices above each face, from which negative indices count back.
    """
    counts = np.array([len(line.split()) for line in lines], dtype=np.int64)
    given = integers(re.sub(rb"/[^\s]*", b"", b" ".join(lines)))
    if len(given) != counts.sum():
        raise BrokenMeshError("has a face with a corner without vertex: export it again.")
    return counts, np.where(given < 0, given + np.repeat(before, counts), given - 1)
