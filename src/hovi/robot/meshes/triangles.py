"""Triangles, and the numbers of a mesh file, which are checked before anything is made of them."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

MAX_COORDINATE = 1e9
"""Largest coordinate of a vertex, in [m]."""
MAX_TRIANGLES = 10_000_000
"""Largest number of triangles of a mesh, also of one whose parts are shown many times."""
_CHUNK = 2**20  # bytes of text that are words at the same time
_SPACE = re.compile(rb"\s")


class BrokenMeshError(ValueError):
    """What is wrong with the content of a mesh: the end of a sentence that begins with its name."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """The surface of a mesh.

    vertices: shape (M, 3), in [m]. triangles: indices of their corners, shape (K, 3).
    Raises BrokenMeshError for no triangles, or too many, and for coordinates out of range.
    """

    vertices: Array
    triangles: Index

    def __post_init__(self) -> None:
        if not len(self.triangles):
            raise BrokenMeshError("has no triangles: export its surface.")
        require_few(len(self.triangles))
        if not (np.abs(self.vertices) <= MAX_COORDINATE).all():  # false for what is not a number
            raise BrokenMeshError(
                f"has coordinates that are not finite, or larger than {MAX_COORDINATE:g} m: "
                "repair it."
            )


def without_loose_vertices(mesh: Triangles) -> Triangles:
    """The same surface with the vertices that are corners of it."""
    used = np.zeros(len(mesh.vertices), dtype=bool)
    used[mesh.triangles] = True
    if used.all():
        return mesh
    return Triangles(mesh.vertices[used], (np.cumsum(used) - 1)[mesh.triangles])


def require_few(triangles: int) -> None:
    """Raise BrokenMeshError for more than MAX_TRIANGLES."""
    if triangles > MAX_TRIANGLES:
        raise BrokenMeshError(
            f"has {triangles:,} triangles, at most {MAX_TRIANGLES:,} are read: simplify it."
        )


def require_indices(corners: Index, vertices: int, first: int = 0) -> None:
    """Raise BrokenMeshError unless all corners are among the vertices.

    first: the number that the file gives to the first vertex.
    """
    wrong = corners[(corners < 0) | (corners >= vertices)]
    if len(wrong):
        raise BrokenMeshError(
            f"has a face with vertex {wrong[0] + first}, and its vertices are {first} to "
            f"{vertices - 1 + first}: export it again."
        )


def floats(text: bytes) -> Array:
    """The decimal numbers in a text. Raises BrokenMeshError for any other word."""
    parts = [_floats(words) for words in _words(text)]
    return np.concatenate(parts) if parts else np.empty(0)


def integers(text: bytes) -> Index:
    """The integers in a text. Raises BrokenMeshError for any other word."""
    parts = [_integers(words) for words in _words(text)]
    return np.concatenate(parts) if parts else np.empty(0, np.int64)


def _words(text: bytes) -> Iterator[list[bytes]]:
    """The words of a text, some at a time, since a list of words needs twenty times its memory."""
    begin = 0
    while begin < len(text):
        space = _SPACE.search(text, begin + _CHUNK)
        end = space.start() if space else len(text)
        yield text[begin:end].split()
        begin = end


def _floats(words: list[bytes]) -> Array:
    try:
        found = np.array(list(map(float, words)), dtype=np.float64)
    except ValueError:
        raise BrokenMeshError(_no_number(words, float)) from None
    if not np.isfinite(found).all() or any(b"_" in word for word in words):
        raise BrokenMeshError(_no_number(words, float))
    return found


def _integers(words: list[bytes]) -> Index:
    try:
        found = np.array(list(map(int, words)), dtype=np.int64)
    except (ValueError, OverflowError):
        raise BrokenMeshError(_no_number(words, int)) from None
    if any(b"_" in word for word in words):
        raise BrokenMeshError(_no_number(words, int))
    return found


def _no_number(words: list[bytes], kind: type[float] | type[int]) -> str:
    """The sentence about the first word that is no finite number, or no integer of 64 bits."""
    word = next(word for word in words if not _is_number(word, kind))
    shown = word[:40].decode(errors="replace")
    return f"has {shown!r} in place of {'a number' if kind is float else 'an integer'}: repair it."


def _is_number(word: bytes, kind: type[float] | type[int]) -> bool:
    try:
        value = kind(word)
    except ValueError:
        return False
    return b"_" not in word and abs(value) < (np.inf if kind is float else 2**63)
