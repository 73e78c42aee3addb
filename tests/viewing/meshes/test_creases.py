"""Normals of corners: those of the faces at sharp edges, and means on smooth surfaces."""

from __future__ import annotations

import numpy as np

from hovi.viewing.meshes.creases import corner_normals


def test_a_box_keeps_its_edges() -> None:
    vertices = np.array([[x, y, z] for x in (0.0, 2) for y in (0.0, 3) for z in (0.0, 1)])
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = np.array([[f[0], *pair] for f in faces for pair in (f[1:3], f[2:4])])
    normals = corner_normals(vertices, triangles)
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    flat = np.cross(b - a, c - a)
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    np.testing.assert_allclose(normals, np.repeat(flat[:, None], 3, axis=1), atol=1e-12)


def test_a_cylinder_is_smooth_around_and_sharp_at_its_lid() -> None:
    n = 24
    angle = 2 * np.pi * np.arange(n) / n
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(n)], axis=1)
    vertices = np.concatenate([ring, ring + np.array([0, 0, 1]), [[0, 0, 1]]])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    side = np.concatenate([np.stack([i, j, j + n], 1), np.stack([i, j + n, i + n], 1)])
    lid = np.stack([i + n, j + n, np.full(n, 2 * n)], axis=1)
    normals = corner_normals(vertices, np.concatenate([side, lid]))
    radial = vertices[side] * [1, 1, 0]
    np.testing.assert_allclose(normals[: 2 * n], radial, atol=0.07)  # one of two faces counts twice
    np.testing.assert_allclose(normals[2 * n :], np.broadcast_to([0, 0, 1], (n, 3, 3)), atol=1e-12)
