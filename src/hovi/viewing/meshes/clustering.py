"""Fewer triangles by vertex clustering, within a given deviation.

Vertices of a cell of a grid become their mean (Rossignac and Borrel, 1993). As every point of a
triangle moves by a mean of what its corners move, no point moves by more than the vertex that moves
most, and that is bounded: cells whose vertices would move more are divided. Quadrics would leave
fewer triangles on flat faces, and take a loop over edges.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]


def clustered(vertices: Array, triangles: Index, deviation: float) -> tuple[Array, Index, Index]:
    """A mesh near another one: its vertices (M, 3), its triangles (K, 3), and which these were.

    No point of the surface moves by more than `deviation`, in the unit of the vertices. Triangles
    whose corners became the same, and second ones in the same place, are left out.
    """
    labels = _cells(vertices, deviation)
    far = _moves(vertices, labels) > deviation
    split = np.isin(labels, labels[far])
    # the mean of a cell is not farther from its vertices than the cell's diagonal
    fine = _cells(vertices, deviation / np.sqrt(3.0))
    labels = np.where(split, fine + labels.max() + 1, labels)
    labels = np.unique(labels, return_inverse=True)[1].reshape(-1)
    corners = labels[triangles]
    kept = np.flatnonzero((corners != np.roll(corners, 1, axis=1)).all(axis=1))
    first = np.argmin(corners[kept], axis=1)
    turned = corners[kept][np.arange(len(kept))[:, None], (first[:, None] + np.arange(3)) % 3]
    kept = kept[np.sort(np.unique(turned, axis=0, return_index=True)[1])]
    return _means(vertices, labels), corners[kept], kept


def _cells(vertices: Array, size: float) -> Index:
    """The number of each vertex's cell, from 0 on."""
    cells = np.floor((vertices - vertices.min(axis=0)) / size)
    return np.unique(cells, axis=0, return_inverse=True)[1].reshape(-1)


def _means(vertices: Array, labels: Index) -> Array:
    count = np.bincount(labels)
    return np.stack([np.bincount(labels, x) / count for x in vertices.T], axis=1)


def _moves(vertices: Array, labels: Index) -> Array:
    return np.asarray(np.linalg.norm(vertices - _means(vertices, labels)[labels], axis=1))
