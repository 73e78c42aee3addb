"""The triangles of a mesh file."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError, ModelError
from hovi.robot.meshes.reading import triangles_in
from hovi.robot.urdf.mesh_files import check_mesh
from hovi.system.dataclass import dataclass
from hovi.system.files import reason

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

MOST_SHOWN = 200
"""Number of characters of a path that a message shows."""


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """The triangles of a mesh.

    name: of its file. vertices: shape (M, 3), in [m]. triangles: shape (K, 3).
    digest: of the vertices and triangles, in hexadecimal.
    """

    name: str
    vertices: Array
    triangles: Index
    digest: str

    def volume(self) -> float | None:
        """The enclosed volume, in [m^3]; None for a surface that is not closed."""
        edges = np.concatenate([self.triangles[:, [i, (i + 1) % 3]] for i in range(3)])
        forward, backward = (_sorted_rows(each) for each in (edges, edges[:, ::-1]))
        if not np.array_equal(forward, backward):
            return None
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        return abs(float(np.vecdot(a, np.cross(b, c)).sum()) / 6.0)


def read_mesh(path: str) -> TriangleMesh:
    """The triangles of a file.

    Raises InputError for a file that is missing, unreadable or of another type, and for one that
    names files outside its folder.
    """
    file = Path(path).absolute()
    try:
        if not file.is_file():
            raise InputError(f"there is no mesh {str(file)!r}.")
        return _loaded(file, check_mesh(file, file.parent, drawn=False))
    except ModelError as error:
        raise InputError(str(error)) from None
    except (OSError, ValueError) as error:
        why = reason(error) if isinstance(error, OSError) else "no file can have that path"
        raise InputError(f"mesh {_short(path)!r} cannot be read: {why}.") from None


@lru_cache(maxsize=64)
def _loaded(file: Path, content: bytes) -> TriangleMesh:
    """content: of the file, so that one that has changed is read again."""
    mesh = triangles_in(file, content)
    corners, which = np.unique(mesh.vertices, axis=0, return_inverse=True)
    triangles = which.reshape(-1)[mesh.triangles]
    distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles = triangles[distinct]
    digest = hashlib.sha256(corners.tobytes() + triangles.astype("<i8").tobytes())
    return TriangleMesh(file.name, corners, triangles, digest.hexdigest())


def _sorted_rows(rows: Index) -> Index:
    return rows[np.lexsort(rows.T[::-1])]


def _short(path: str) -> str:
    return path if len(path) <= MOST_SHOWN else f"{path[:100]}...{path[-97:]}"
