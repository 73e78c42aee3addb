"""Triangles of OFF files."""

from __future__ import annotations

import re

import numpy as np

from hovi.robot.meshes.polygons import triangulated
from hovi.robot.meshes.triangles import Array, BrokenMeshError, Index, Triangles, floats, integers

HEADERS = b"OFF", b"COFF", b"NOFF", b"CNOFF"
"""First words of a file; colors and normals follow the coordinates of a vertex."""


def read_off(content: bytes) -> Triangles:
    """The triangles of an OFF file. Raises BrokenMeshError."""
    lines = re.sub(rb"#[^\r\n]*", b"", content).split(b"\n")
    lines = [line for line in lines if line.strip()]
    first = lines[0].split() if lines else [b""]
    if first[0] not in HEADERS:
        raise BrokenMeshError("is no OFF: its first word is neither OFF, COFF nor NOFF.")
    counts = lines[1 : 2 if len(first) == 1 else 1] or [b" ".join(first[1:])]
    sizes = integers(counts[0]).tolist()
    begin = 2 if len(first) == 1 else 1
    if len(sizes) not in (2, 3) or min(sizes) < 0 or len(lines) - begin != sum(sizes[:2]):
        raise BrokenMeshError(
            f"declares {' and '.join(f'{size:,}' for size in sizes[:2])} vertices and faces, and "
            f"{len(lines) - begin:,} lines follow: export it again."
        )
    body = lines[begin:]
    vertices = _vertices(body[: sizes[0]])
    corners = [_corners(line) for line in body[sizes[0] :]]
    flat = np.concatenate(corners) if corners else np.empty(0, np.int64)
    numbers = np.array([len(each) for each in corners], dtype=np.int64)
    return Triangles(vertices, triangulated(vertices, numbers, flat))


def _vertices(lines: list[bytes]) -> Array:
    """The first three numbers of each line, which all have as many, (M, 3)."""
    numbers = floats(b" ".join(lines))
    width = len(lines[0].split()) if lines else 3
    if width < 3 or any(len(line.split()) != width for line in lines):
        raise BrokenMeshError("has vertices without three coordinates: export it again.")
    return numbers.reshape(-1, width)[:, :3]


def _corners(line: bytes) -> Index:
    """The corners of a face: as many as its first number says; colors may follow."""
    words = line.split()
    count = int(integers(words[0])[0])
    if not 0 < count < len(words):
        raise BrokenMeshError(
            f"has a face that declares {count:,} corners and has {len(words) - 1}: export it again."
        )
    return integers(b" ".join(words[1 : count + 1]))
