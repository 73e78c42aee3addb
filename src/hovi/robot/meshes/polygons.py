"""Divides the faces of a mesh into triangles."""

from __future__ import annotations

import numpy as np

from hovi.robot.meshes.triangles import Array, BrokenMeshError, Index, require_indices

MAX_WORK = 300_000
"""Largest sum of the squared numbers of corners, over faces of five or more that are not convex."""


def triangulated(vertices: Array, counts: Index, corners: Index, first: int = 0) -> Index:
    """The triangles of faces, shape (K, 3); faces of one or two corners have none.

    vertices: shape (M, 3). counts: corners of each face, shape (F,). corners: of one face after
    the other, shape (sum of counts,). first: the number that the file gives to the first vertex.
    Raises BrokenMeshError for corners that are no vertices, and faces that take too long.
    """
    require_indices(corners, len(vertices), first)
    starts, found, work = np.cumsum(counts) - counts, [np.empty((0, 3), np.int64)], 0
    for count in np.unique(counts[counts >= 3]).tolist():
        faces = corners[starts[counts == count][:, None] + np.arange(count)]
        turns = _turns(vertices[faces]) if count > 3 else np.ones_like(faces)
        convex = np.asarray((turns >= 0.0).all(axis=1))
        if count == 4:  # also of a face that is not convex, by the diagonal from its inner corner
            shift = np.where((turns[:, [1, 3]] < 0.0).any(axis=1), 1, 0)
            faces = faces[np.arange(len(faces))[:, None], (np.arange(4) + shift[:, None]) % 4]
            convex[:] = True
        found.append(_fans(faces[convex]))
        work += count**2 * int((~convex).sum())
        if work > MAX_WORK:
            raise BrokenMeshError(
                "has too many faces with many corners that are not convex: export it as triangles."
            )
        found += [face[_clipped(vertices[face])] for face in faces[~convex]]
    return np.concatenate(found)


def _fans(faces: Index) -> Index:
    count = faces.shape[1]
    picks = np.array([[0, k, k + 1] for k in range(1, count - 1)])
    return faces[:, picks].reshape(-1, 3)


def _turns(points: Array) -> Array:
    """By how much each corner turns about the normal of its face: points (F, n, 3) -> (F, n)."""
    with np.errstate(over="ignore", invalid="ignore"):  # coordinates are checked later
        edges = np.roll(points, -1, axis=1) - points
        before = np.roll(edges, 1, axis=1)
        normal = np.cross(points - points[:, :1], np.roll(points, -1, axis=1) - points[:, :1])
        normals = normal.sum(axis=1, keepdims=True)
        turns = np.vecdot(np.cross(before, edges), normals)
        sizes = np.linalg.norm(before, axis=2) * np.linalg.norm(edges, axis=2)
        turns[np.abs(turns) <= 1e-12 * sizes * np.linalg.norm(normals, axis=2)] = 0.0
    return np.asarray(np.nan_to_num(turns))


def _clipped(points: Array) -> Index:
    """The triangles of a face by cutting off one ear after the other, points (n, 3)."""
    flat = _in_plane(points)
    left, found = list(range(len(flat))), []
    while len(left) > 3:
        k = next((k for k in range(len(left)) if _is_ear(flat, left, k)), 0)
        found.append([left[k - 1], left[k], left[(k + 1) % len(left)]])
        del left[k]
    return np.array([*found, left])


def _in_plane(points: Array) -> Array:
    """Corners in two coordinates, in which the face runs counterclockwise."""
    with np.errstate(over="ignore", invalid="ignore"):
        normal = np.cross(points - points[0], np.roll(points, -1, axis=0) - points[0]).sum(axis=0)
    k = int(np.argmax(np.abs(normal)))
    flat = points[:, [(k + 1) % 3, (k + 2) % 3]]
    return np.asarray(flat if normal[k] >= 0.0 else flat * [-1.0, 1.0])


def _is_ear(flat: Array, left: list[int], k: int) -> bool:
    """Whether no other corner is inside the triangle at corner k, which turns left."""
    i, j, m = left[k - 1], left[k], left[(k + 1) % len(left)]
    a, b, c = flat[i], flat[j], flat[m]
    if _side(a, b, c) <= 0.0:
        return False
    others = flat[[each for each in left if each not in (i, j, m)]]
    inside = (_side(a, b, others) >= 0) & (_side(b, c, others) >= 0) & (_side(c, a, others) >= 0)
    at_a_corner = (others == a).all(axis=1) | (others == b).all(axis=1) | (others == c).all(axis=1)
    return not (inside & ~at_a_corner).any()


def _side(a: Array, b: Array, c: Array) -> Array:
    """Positive where c lies to the left of the line from a to b; c of shape (..., 2)."""
    return np.asarray((b[0] - a[0]) * (c[..., 1] - a[1]) - (b[1] - a[1]) * (c[..., 0] - a[0]))
