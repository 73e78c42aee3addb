"""Reads the triangles of a mesh by the type of its file.

Nothing else reads meshes: Assimp, which Coal and Pinocchio take for them, ends the process on faces
whose vertices do not exist and on nodes inside themselves, and skips what it does not understand.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from hovi.errors import ModelError
from hovi.robot.meshes.collada import read_collada
from hovi.robot.meshes.obj import read_obj
from hovi.robot.meshes.off import read_off
from hovi.robot.meshes.ply import read_ply
from hovi.robot.meshes.stl import read_stl
from hovi.robot.meshes.triangles import BrokenMeshError, Triangles, without_loose_vertices

_READERS: dict[str, Callable[[bytes], Triangles]] = {
    ".dae": read_collada,
    ".obj": read_obj,
    ".off": read_off,
    ".ply": read_ply,
    ".stl": read_stl,
}
MESH_TYPES = tuple(_READERS)
"""Types of files that are read."""
MAX_MESH_BYTES = 256_000_000
"""Largest file."""


def triangles_in(path: Path, content: bytes) -> Triangles:
    """The triangles of a mesh. path: of its file, for its type and messages.

    Raises ModelError with a sentence about what is wrong with the content.
    """
    try:
        return without_loose_vertices(_READERS[path.suffix.lower()](content))
    except BrokenMeshError as error:
        raise ModelError(f"mesh {path.name!r} {error}") from None
