"""Fewer triangles, all near the given surface, which is near all of them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial import cKDTree

from hovi.viewing.meshes.clustering import clustered

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]


def ball(n: int, noise: float = 0.0) -> tuple[Array, Index]:
    """A sphere of radius 1 with 2 n^2 triangles, its points moved at random."""
    u, v = np.meshgrid(
        np.linspace(0, np.pi, n + 1), np.linspace(0, 2 * np.pi, n + 1), indexing="ij"
    )
    points = np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], axis=-1)
    points = points.reshape(-1, 3) + noise * np.random.default_rng(1).normal(
        size=(points.size // 3, 3)
    )
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    both = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    return points, both.reshape(-1, 3)


def sampled(vertices: Array, triangles: Index, count: int) -> Array:
    """Points of a surface, (count, 3): more on large triangles."""
    rng = np.random.default_rng(2)
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    which = rng.choice(len(triangles), count, p=area / area.sum())
    weights = rng.dirichlet([1.0, 1.0, 1.0], count)
    return np.einsum("ki,kij->kj", weights, vertices[triangles[which]])


def farthest(points: Array, vertices: Array, triangles: Index) -> float:
    """The largest distance of points from a surface, by dense points of it: a bit too large."""
    tree = cKDTree(sampled(vertices, triangles, 400_000))
    return float(tree.query(points)[0].max())


@pytest.mark.parametrize(("n", "noise"), [(120, 0.0), (120, 0.004)])
def test_neither_surface_is_farther_from_the_other_than_allowed(n: int, noise: float) -> None:
    vertices, triangles = ball(n, noise)
    deviation = 0.04
    fewer, left, _ = clustered(vertices, triangles, deviation)
    assert len(left) < 0.6 * len(triangles)
    spacing = 0.02  # of the dense points
    assert farthest(sampled(vertices, triangles, 20_000), fewer, left) < deviation + spacing
    assert farthest(sampled(fewer, left, 20_000), vertices, triangles) < deviation + spacing


def test_no_vertex_moves_by_more_than_the_deviation() -> None:
    """Where a cell has most of its vertices in one corner, and one in the opposite one, too."""
    rng = np.random.default_rng(3)
    corner = np.repeat(np.floor(rng.uniform(0, 50, (800, 3))), 5, axis=0)
    corner += np.where(np.arange(4000) % 5 == 0, 0.98, 0.01)[:, None]
    vertices = np.concatenate([np.zeros((1, 3)), corner])
    triangles = np.stack([np.arange(4000), *rng.integers(0, 4001, (2, 4000))], axis=1)
    for deviation in (0.5, 1.0, 4.0):
        fewer, left, kept = clustered(vertices, triangles, deviation)
        moved = np.linalg.norm(fewer[left] - vertices[triangles[kept]], axis=2)
        assert moved.max() <= deviation * (1 + 1e-12)


def test_a_vertex_alone_in_its_cell_stays_where_it_is() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    triangles = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    fewer, left, kept = clustered(vertices, triangles, 0.1)
    np.testing.assert_array_equal(fewer[left], vertices[triangles])
    np.testing.assert_array_equal(kept, range(4))


def test_of_triangles_in_one_place_the_first_is_left_and_the_back_of_a_plate_too() -> None:
    vertices = np.array(
        [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.001], [1, 0, 0.001], [0, 1, 0.001]]
    )
    triangles = np.array([[0, 2, 1], [3, 4, 5], [1, 0, 2], [0, 1, 4]])
    _, left, kept = clustered(vertices, triangles, 0.01)
    assert kept.tolist() == [0, 1]
    assert sorted(left[0].tolist()) == sorted(left[1].tolist())
