"""Random discrete paths: random nodes, consistent z, random inner modes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid

Array = npt.NDArray[np.float64]


def random_path(grid: Grid, n: int, seed: int = 0) -> DiscretePath:
    """A path with positions, velocities and accelerations of order one."""
    random = np.random.default_rng(seed)
    N, h = grid.intervals, grid.steps[:, None]
    v = np.cumsum(np.vstack([np.zeros(n), h * random.normal(size=(N, n))]), axis=0)
    v += random.normal(size=n)
    z0 = random.normal(size=(N, n)) / 2
    q = np.cumsum(np.vstack([random.normal(size=n), h * v[:-1] + h**2 * z0]), axis=0)
    inner = 0.3 * random.normal(size=(N, grid.inner_modes, n))
    for i, scheme in enumerate(grid.schemes):
        inner[i, scheme.inner_modes :] = 0.0
    z = np.stack([z0, np.diff(v, axis=0) / h], axis=1)
    return DiscretePath(q, v, z, inner)


def nodal_columns(grid: Grid, path: DiscretePath) -> Array:
    """(q0, h v0, q1, h v1, c) of every interval, shape (N, m, n)."""
    h = grid.steps[:, None]
    ends = [path.q[:-1], h * path.v[:-1], path.q[1:], h * path.v[1:]]
    return np.concatenate([np.stack(ends, axis=1), h[:, None] ** 2 * path.inner], axis=1)


def path_of_nodal(h: float, columns: Array) -> DiscretePath:
    """The path of one interval from its columns (q0, h v0, q1, h v1, c), shape (m, n)."""
    q, v, inner = columns[[0, 2]], columns[[1, 3]] / h, columns[4:] / h**2
    z = np.stack([(columns[2] - columns[0] - columns[1]) / h**2, (v[1] - v[0]) / h])
    return DiscretePath(q, v, z[None], inner[None])


def path_of_regular(h: float, columns: Array) -> DiscretePath:
    """The path of one interval from its columns (q0, h v0, Z0, Z1, c), shape (m, n)."""
    q0, hv0, Z0, Z1 = columns[:4]
    q, v = np.stack([q0, q0 + hv0 + Z0]), np.stack([hv0, hv0 + Z1]) / h
    return DiscretePath(q, v, columns[None, 2:4] / h**2, columns[None, 4:] / h**2)
