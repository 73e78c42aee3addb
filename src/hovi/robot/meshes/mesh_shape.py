"""Meshes as shapes of Coal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import coal
import numpy as np

from hovi.errors import ModelError
from hovi.robot.meshes.reading import triangles_in
from hovi.robot.meshes.triangles import MAX_COORDINATE, Array, Triangles
from hovi.system.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class MeshShape:
    """A mesh of a robot: its triangles after scaling, and where they are from.

    path: of the file. scale: factors of the coordinates, (3,). size: of the file, in bytes.
    """

    shape: coal.BVHModelOBBRSS
    path: str
    scale: Array
    size: int


def mesh_shape(path: Path, content: bytes, scale: Sequence[float]) -> MeshShape:
    """The shape of a mesh. path: of its file. Raises ModelError for what cannot be used."""
    found, factors = triangles_in(path, content), np.array(scale, dtype=np.float64)
    vertices = found.vertices * factors
    if not (np.abs(vertices) <= MAX_COORDINATE).all():
        raise ModelError(
            f"mesh {path.name!r} has coordinates larger than {MAX_COORDINATE:g} m after scaling by "
            f"{factors.tolist()}: correct its scale."
        )
    shape = bvh_of(Triangles(vertices, found.triangles))
    return MeshShape(shape, str(path), factors, len(content))


def bvh_of(mesh: Triangles) -> coal.BVHModelOBBRSS:
    """Triangles as a shape of Coal."""
    shape = coal.BVHModelOBBRSS()
    shape.beginModel(len(mesh.triangles), len(mesh.vertices))
    shape.addVertices(mesh.vertices)
    shape.addTriangles(mesh.triangles)
    shape.endModel()
    return shape
