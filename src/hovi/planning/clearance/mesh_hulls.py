"""Convex hulls of mesh files, cached in the user's folder by the content of the file."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

import coal
import numpy as np
import numpy.typing as npt

from hovi.errors import ModelError
from hovi.planning.obstacles.hull import hull_of
from hovi.robot.meshes.mesh_shape import scaled_triangles
from hovi.system.file_cache import read_cached, write_cached

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int32]

_COMPUTED = b"hull 1, Coal " + coal.__version__.encode()
"""Part of the digest of a mesh, to be changed with what is computed or how meshes are read."""
_LENGTH, _HEADER = 8, 16
"""Bytes of the length of what is hashed, and of the sizes before the points in a file."""
_SIZES = np.dtype("<i8")
_POINTS = np.dtype("<f8")
_CORNERS = np.dtype("<i4")


def mesh_hull(path: Path, content: bytes, scale: Sequence[float]) -> coal.ConvexBase:
    """The convex hull of a mesh after scaling, the same whether it is cached or computed.

    path: of the file, for its type and messages. content: its bytes. scale: three factors.
    Raises ModelError for a mesh that cannot be used, or spans no volume.
    """
    digest = _digest(path.suffix.lower().encode(), np.array(scale, _POINTS).tobytes(), content)
    cached = read_cached("hulls", digest.hex())
    hull = None if cached is None else _unpacked(cached, digest)
    if hull is None:
        hull = hull_of(scaled_triangles(path, content, scale).vertices)
        if hull is None:
            raise ModelError(
                f"mesh {path.name!r} has no convex hull: use a mesh with volume, or a primitive."
            )
        write_cached("hulls", digest.hex(), _packed(hull, digest))
    return hull


def _digest(*parts: bytes) -> bytes:
    found = hashlib.sha256()
    for part in (_COMPUTED, *parts):
        found.update(len(part).to_bytes(_LENGTH, "little"))
        found.update(part)
    return found.digest()


def _packed(hull: coal.Convex, mesh: bytes) -> bytes:
    """The content of a file: a digest of the mesh's and of the rest, sizes, points, triangles."""
    points = np.array(hull.points(), _POINTS)
    faces = [hull.polygons(k) for k in range(hull.num_polygons)]
    triangles = np.array([[face[0], face[1], face[2]] for face in faces], _CORNERS)
    sizes = np.array([len(points), len(triangles)], _SIZES)
    rest = sizes.tobytes() + points.tobytes() + triangles.tobytes()
    return _digest(mesh, rest) + rest


def _unpacked(content: bytes, mesh: bytes) -> coal.Convex | None:
    """The hull in a file's content; None for anything else, also for the hull of another mesh."""
    check, rest = content[:32], content[32:]
    if check != _digest(mesh, rest):
        return None
    count, faces = (int(size) for size in np.frombuffer(rest, _SIZES, 2))
    points = np.frombuffer(rest, _POINTS, 3 * count, offset=_HEADER).reshape(count, 3)
    corners = np.frombuffer(rest, _CORNERS, offset=_HEADER + points.nbytes).reshape(faces, 3)
    return _convex(points, corners)


def _convex(points: Array, triangles: Index) -> coal.Convex:
    corners, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    corners.extend(list(points))
    faces.extend([coal.Triangle(*each) for each in triangles.tolist()])
    return coal.Convex(corners, faces)
