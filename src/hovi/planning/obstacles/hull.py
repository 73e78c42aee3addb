"""Convex hulls of points."""

from __future__ import annotations

import coal
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

LEAST_THICKNESS = 1e-3
"""Ratio of the least and the largest standard deviation of vertices that are not nearly flat."""
LEAST_SIZE = 1e-6
"""Extent of a hull, in [m], below which Coal may crash."""
QHULL_OPTIONS = "Qt", "QJ"
"""Triangulated facets, and, where a vertex has more neighbours than Coal can count, as of a facet
with hundreds of corners, vertices that are moved by some 1e-11 of the extent."""


def hull_of(vertices: Array) -> coal.ConvexBase | None:
    """The convex hull of vertices (M, 3); None if they span no volume.

    SciPy computes the hull's vertices first where they are nearly in a plane, since Coal's own call
    crashes on flat shapes. It is imported here because the import takes a quarter of a second.
    """
    if not len(vertices) or not np.ptp(vertices, axis=0).max() > LEAST_SIZE:
        return None
    corners = vertices
    if not _is_thick(vertices):
        from scipy.spatial import ConvexHull, QhullError

        try:
            corners = vertices[ConvexHull(vertices).vertices]
        except (QhullError, ValueError):
            return None
    points = coal.StdVec_Vec3s()
    points.extend(list(corners))
    for options in QHULL_OPTIONS:
        try:
            return coal.Convex.convexHull(points, True, options)
        except RuntimeError:
            continue
    return None


def _is_thick(vertices: Array) -> bool:
    """Whether vertices are far from any common plane, compared with their extent."""
    if len(vertices) < 4 or not np.isfinite(vertices).all():
        return False
    sizes = np.linalg.svd(vertices - vertices.mean(axis=0), compute_uv=False)
    return bool(sizes[2] > LEAST_THICKNESS * sizes[0])
