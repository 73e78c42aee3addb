"""Normals of the corners of a mesh, smooth but for its creases."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

CREASE = np.cos(np.radians(38.0))
"""Cosine of the angle between faces from which on their edge is seen."""


def corner_normals(vertices: Array, triangles: Index) -> Array:
    """The mean normal of the faces at each corner that are no crease away, shape (K, 3, 3).

    Faces count by their area. vertices: (M, 3). triangles: (K, 3).
    """
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    weighted = np.cross(b - a, c - a)
    size = np.linalg.norm(weighted, axis=1, keepdims=True)
    unit = weighted / np.where(size > 0, size, 1.0)
    at = triangles.reshape(-1)
    order = np.argsort(at, kind="stable")
    count = np.bincount(at, minlength=len(vertices))
    start = np.cumsum(count) - count
    normals = np.empty((len(at), 3))
    for valence in np.unique(count[count > 0]).tolist():
        corners = order[start[count == valence][:, None] + np.arange(valence)]  # (m, valence)
        faces = corners // 3
        near = unit[faces] @ np.swapaxes(unit[faces], 1, 2) > CREASE
        normals[corners] = near.astype(float) @ weighted[faces]
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    smooth = normals / np.where(length > 0, length, 1.0)
    return np.asarray(smooth.reshape(-1, 3, 3))
