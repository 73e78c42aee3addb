"""A mesh file as a page gets it: arrays of few triangles, with normals and colors."""

from __future__ import annotations

import warnings
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import umsgpack

from hovi.errors import ModelError
from hovi.robot.meshes.collada import painted_collada
from hovi.robot.meshes.reading import triangles_in
from hovi.robot.meshes.triangles import BrokenMeshError
from hovi.viewing.meshes.clustering import clustered
from hovi.viewing.meshes.creases import corner_normals

with warnings.catch_warnings():
    # meshcat imports a deprecated module of ZeroMQ that hovi does not use.
    warnings.simplefilter("ignore", DeprecationWarning)
    from meshcat.geometry import Geometry, Mesh, MeshPhongMaterial

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

DEVIATION = 5e-4
"""Largest distance of a drawn surface from that of its file, in [m]."""
MESH_NOTE = f"Meshes are drawn to within {1e3 * DEVIATION:g} mm."
_GRID = 32
"""Coordinates are multiples of about the deviation over this, which are packed better."""
_NORMALS = 48
_SHORT = 2**16
"""Number of points up to which their numbers are short integers."""


class PageMesh(Geometry):  # type: ignore[misc]
    """Triangles as meshcat draws them.

    points, normals: shape (M, 3). triangles: shape (K, 3). colors: (M, 3) from 0 to 1, or None.
    """

    def __init__(self, points: Array, normals: Array, triangles: Index, colors: Array | None):
        super().__init__()
        self.points, self.normals = points, normals
        self.triangles, self.colors = triangles, colors

    def lower(self, object_data: Any) -> dict[str, Any]:
        """The message's part. The name is meshcat's."""
        attributes = {"position": _packed(self.points), "normal": _packed(self.normals)}
        if self.colors is not None:
            attributes["color"] = _packed(self.colors)
        kind = ("Uint16Array", 0x14, "<u2")
        if len(self.points) > _SHORT:
            kind = ("Uint32Array", 0x16, "<u4")
        index = {
            "itemSize": 3,
            "type": kind[0],
            "array": umsgpack.Ext(kind[1], self.triangles.astype(kind[2]).tobytes()),
            "normalized": False,
        }
        data = {"attributes": attributes, "index": index}
        return {"uuid": self.uuid, "type": "BufferGeometry", "data": data}


def page_mesh(path: Path, content: bytes, scale: Array, plain: bool) -> PageMesh | Mesh | None:
    """The drawn mesh of a file; None for one with pictures, which is drawn from the file itself.

    scale: factors of its coordinates, shape (3,). plain: without the colors of the file.
    Raises ModelError for a mesh that cannot be read.
    """
    deviation = DEVIATION / max(float(np.abs(scale).max()), 1e-9)
    suffix = path.suffix.lower()
    arrays, paint = _arrays(suffix, path.name, content, deviation)
    if paint is None and not plain and suffix == ".dae":
        return None
    points, normals, triangles, which = arrays
    if plain or paint is None:
        return PageMesh(points, normals, triangles, None)
    if len(paint) == 1:
        red, green, blue = (round(255 * x) for x in paint[0].tolist())
        material = MeshPhongMaterial(color=(red << 16) + (green << 8) + blue)
        return Mesh(PageMesh(points, normals, triangles, None), material)
    material = MeshPhongMaterial(color=0xFFFFFF, vertexColors=True)
    return Mesh(PageMesh(points, normals, triangles, paint[which]), material)


@lru_cache(maxsize=64)
def _arrays(
    suffix: str, name: str, content: bytes, deviation: float
) -> tuple[tuple[Array, Array, Index, Index], Array | None]:
    """Points, normals, triangles and the number of each point's color; and the colors, (C, 3)."""
    if suffix == ".dae":
        try:
            mesh, paint = painted_collada(content)
        except BrokenMeshError as error:
            raise ModelError(f"mesh {name!r} {error}") from None
    else:
        mesh, paint = triangles_in(Path(name), content), None
    vertices, triangles, kept = clustered(mesh.vertices, mesh.triangles, deviation)
    normals = np.round(corner_normals(vertices, triangles) * _NORMALS)
    color = np.zeros(len(kept), np.int64)
    colors = None
    if paint is not None:
        colors, which = np.unique(np.round(paint, 4), axis=0, return_inverse=True)
        color = which.reshape(-1)[kept]
    keys = np.column_stack(
        [triangles.reshape(-1), normals.reshape(-1, 3), np.repeat(color, 3)]
    ).astype(np.int64)
    distinct, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)  # as triangles come, so that their numbers differ little
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    distinct = distinct[order]
    step = 2.0 ** np.floor(np.log2(deviation / _GRID))
    points = step * np.round(vertices[distinct[:, 0]] / step)
    corners = rank[which.reshape(-1)].reshape(-1, 3)
    return (points, distinct[:, 1:4] / _NORMALS, corners, distinct[:, 4]), colors


def _packed(values: Array) -> dict[str, Any]:
    array = umsgpack.Ext(0x17, values.astype("<f4").tobytes())
    return {"itemSize": 3, "type": "Float32Array", "array": array, "normalized": False}
