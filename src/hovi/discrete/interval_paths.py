"""Interpolation of discrete paths at quadrature points, and steps in the columns of intervals.

The compiled code works on plain arrays.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native
from hovi.discrete.grid import DiscretePath
from hovi.schemes.interval_curve import jet_rows
from hovi.schemes.scheme import regular_from_nodal

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
PathArrays = tuple[Array, Array, Array, Array]
"""q (N + 1, n), v (N + 1, n), z (N, 2, n) and inner modes (N, r, n): see DiscretePath."""


def interpolate(table: Array, steps: Array, intervals: Index, path: PathArrays) -> Array:
    """(q, v, a) at the points of some intervals, on commutative groups, shape (3, B Q, n).

    (q - q0, h v, h^2 a) = table (h v0, h^2 z0, h^2 z1, h^2 inner) at every point.

    table: shape (Q, 3, 3 + r), with at most as many modes as the path.
    steps: h of the intervals, (B,). intervals: their numbers, shape (B,).
    """
    q, v, z, inner = path
    out = np.empty((3, len(steps) * len(table), v.shape[1]))
    table, h = np.ascontiguousarray(table), np.ascontiguousarray(steps)
    native.interpolate(table, h, intervals, q, v, z, inner, out)
    return out


def interpolate_any(
    table: Array, steps: Array, intervals: Index, path: DiscretePath
) -> tuple[Array, ...]:
    """As `interpolate`, for any order k on vector spaces: k + 1 arrays of shape (B Q, n).

    table: shape (Q, k + 1, 2 k - 1 + r), over (h q0', ..., h^(k-1) q0^(k-1), h^k z, h^k inner).
    """
    k, r = path.order, table.shape[2] - 2 * path.order + 1
    powers = steps[:, None] ** np.arange(k + 1.0)  # (B, k + 1)
    data = scaled_data(path, intervals, steps[:, None], r)
    rows = np.matmul(table.reshape(-1, table.shape[2]), data)
    jets = rows.reshape(len(steps), len(table), k + 1, -1) / powers[:, None, :, None]
    jets[:, :, 0] += path.q[intervals][:, None]
    return tuple(
        np.ascontiguousarray(jets[:, :, j]).reshape(-1, jets.shape[3]) for j in range(k + 1)
    )


def scaled_data(path: DiscretePath, intervals: Index, steps: Array, modes: int) -> Array:
    """(h q0', ..., h^(k-1) q0^(k-1), h^k z, h^k inner) of some intervals, (B, 2 k - 1 + r, n).

    steps: h, shape (B, 1). modes: r.
    """
    k = path.order
    ends = path.rates[intervals] * (steps ** np.arange(1, k))[:, :, None]
    top = np.concatenate([path.z[intervals], path.inner[intervals, :modes]], axis=1)
    return np.concatenate([ends, top * steps[:, None] ** k], axis=1)


def move_any(path: DiscretePath, step: Array, steps: Array) -> DiscretePath:
    """The path after a step, for any order k on vector spaces.

    step: in the columns (q0, h q0', ..., q1, h q1', ..., c), shape (N, 2 k + r, n).
    steps: h, shape (N,).
    """
    k, powers = path.order, steps[:, None] ** np.arange(path.order + 1.0)
    first, last = step[:, :k] / powers[:, :k, None], step[-1, k : 2 * k] / powers[-1, :k, None]
    nodes = np.concatenate([first, last[None]])  # (N + 1, k, n)
    R = regular_from_nodal(0, k)[k:]
    z = path.z + np.matmul(R, step[:, : 2 * k]) / powers[:, k:, None]
    inner = path.inner.copy()
    inner[:, : step.shape[1] - 2 * k] += step[:, 2 * k :] / powers[:, k:, None]
    rates = path.rates + nodes[:, 1:]
    return path_of_order(k, path.q + nodes[:, 0], rates, z, inner, steps)


def regularized_nodes(nodes: Array, steps: Array) -> Array:
    """z of every interval from (q, q', ..., q^(k-1)) at the nodes, on vector spaces, (N, k, n).

    nodes: shape (N + 1, k, n). steps: h, shape (N,).
    """
    k, h = nodes.shape[1], steps[:, None]
    scaled = np.concatenate([nodes[:-1], nodes[1:]], axis=1)
    scaled *= (h ** np.tile(np.arange(k), 2))[:, :, None]
    return np.asarray(np.matmul(regular_from_nodal(0, k)[k:], scaled) / (h**k)[:, None])


def path_of_order(
    k: int, q: Array, rates: Array, z: Array, inner: Array, steps: Array
) -> DiscretePath:
    """A path from q (N + 1, n) and its derivatives (N + 1, k - 1, n) at the nodes.

    z, inner: as in DiscretePath. steps: h, shape (N,). For k = 1 the velocities follow from the
    curve of each interval.
    """
    if k > 1:
        return DiscretePath(q, rates[:, 0], z, inner, rates[:, 1:])
    r = inner.shape[1]
    rows = jet_rows(np.array([0.0, 1.0]), 1, r)[:, 1]  # (2, 1 + r), of h v over (h z, h inner)
    ends = np.einsum("sm,kmn->skn", rows, np.concatenate([z, inner], axis=1))
    return DiscretePath(q, np.concatenate([ends[0], ends[1, -1:]]), z, inner)


def move(path: PathArrays, step: Array, steps: Array, nodal: bool) -> PathArrays:
    """The change of q in a step, and v, z and the inner modes after it.

    step: in the columns (q0, h v0, q1, h v1, c) if nodal, else (q0, h v0, Z0, Z1, c), which do not
        move the last node; shape (N, 4 + r, n).
    steps: h, shape (N,).
    """
    _, v, z, inner = path
    after = np.empty_like(v), np.empty_like(v), np.empty_like(z), np.empty_like(inner)
    native.move(np.ascontiguousarray(step), steps, nodal, v, z, inner, *after)
    return after


def misfit(path: PathArrays, steps: Array) -> float:
    """The largest difference between z and its values from q and v, on commutative groups.

    The largest of |q1 - q0 - h v0 - h^2 z0| and |h (v1 - v0 - h z1)|, relative to max(|q|, 1); NaN
    for a path that is not finite. steps: h, shape (N,).
    """
    return native.misfit(steps, *path)
