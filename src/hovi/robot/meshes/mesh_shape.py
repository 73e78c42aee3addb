"""Meshes as shapes of Coal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import coal
import numpy as np

from hovi.errors import ModelError
from hovi.robot.meshes.reading import triangles_in
from hovi.robot.meshes.triangles import MAX_COORDINATE, Triangles


def mesh_shape(path: Path, content: bytes, scale: Sequence[float]) -> coal.BVHModelOBBRSS:
    """The shape of a mesh. path: of its file. Raises ModelError for what cannot be used."""
    return bvh_of(scaled_triangles(path, content, scale))


def scaled_triangles(path: Path, content: bytes, scale: Sequence[float]) -> Triangles:
    """The triangles of a mesh. scale: factors of its coordinates.

    Raises ModelError for what cannot be used.
    """
    found, factors = triangles_in(path, content), np.array(scale, dtype=np.float64)
    vertices = found.vertices * factors
    if not (np.abs(vertices) <= MAX_COORDINATE).all():
        raise ModelError(
            f"mesh {path.name!r} has coordinates larger than {MAX_COORDINATE:g} m after scaling by "
            f"{factors.tolist()}: correct its scale."
        )
    return Triangles(vertices, found.triangles)


def bvh_of(mesh: Triangles) -> coal.BVHModelOBBRSS:
    """Triangles as a shape of Coal."""
    shape = coal.BVHModelOBBRSS()
    shape.beginModel(len(mesh.triangles), len(mesh.vertices))
    shape.addVertices(mesh.vertices)
    shape.addTriangles(mesh.triangles)
    shape.endModel()
    return shape
