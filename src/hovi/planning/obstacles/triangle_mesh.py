"""The triangles of a mesh file."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

import coal
import numpy as np
import numpy.typing as npt

from hovi.errors import InputError, ModelError
from hovi.robot.urdf.mesh_contents import MAX_COORDINATE, one_line
from hovi.robot.urdf.mesh_files import check_mesh
from hovi.system.dataclass import dataclass
from hovi.system.files import reason

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]


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
        check_mesh(file, file.parent, drawn=False)
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
    except ModelError as error:
        raise InputError(str(error)) from None
    except (OSError, ValueError) as error:
        why = reason(error) if isinstance(error, OSError) else "no file can have that path"
        raise InputError(f"mesh {_short(path)!r} cannot be read: {why}.") from None
    return _loaded(file, digest)


@lru_cache(maxsize=64)
def _loaded(file: Path, digest: str) -> TriangleMesh:
    """digest: of the file, so that one that has changed is read again."""
    try:
        mesh = coal.MeshLoader().load(str(file), np.ones(3))
    except (ValueError, RuntimeError) as error:
        raise InputError(f"mesh {file.name!r} cannot be read: {one_line(error)}.") from None
    vertices = np.array(mesh.vertices(), dtype=np.float64).reshape(-1, 3)
    if not (np.abs(vertices) <= MAX_COORDINATE).all():
        raise InputError(
            f"mesh {file.name!r} has coordinates that are not finite, or larger than "
            f"{MAX_COORDINATE:g} m: repair it."
        )
    found = (mesh.tri_indices(k) for k in range(mesh.num_tris))
    rows = [[each[0], each[1], each[2]] for each in found]
    corners, which = np.unique(vertices, axis=0, return_inverse=True)
    triangles = which.reshape(-1)[np.array(rows, dtype=np.int64).reshape(-1, 3)]
    content = hashlib.sha256(corners.tobytes() + triangles.astype("<i8").tobytes())
    return TriangleMesh(file.name, corners, triangles, content.hexdigest())


def _sorted_rows(rows: Index) -> Index:
    return rows[np.lexsort(rows.T[::-1])]


def _short(path: str) -> str:
    return path if len(path) <= 200 else f"{path[:100]}...{path[-97:]}"
