"""Interpolation of discrete paths at quadrature points, and steps in the columns of intervals.

The compiled code works on plain arrays.
"""

from __future__ import annotations

from math import factorial

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native
from hovi.discrete.grid import DiscretePath
from hovi.robot.space.chart import Chart
from hovi.robot.space.configuration_space import ConfigurationSpace
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


def displacements_at(rows: Array, steps: Array, intervals: Index, path: DiscretePath) -> Array:
    """x of q = q0 (+) x at instants, shape (E, n), on vector spaces and commutative groups.

    x = row . (h q0', ..., h^(k-1) q0^(k-1), h^k z, h^k inner), with a row for each instant.
    rows: shape (E, 2 k - 1 + r). steps: h of all N intervals, (N,), in [s]. intervals: the interval
    of each instant, (E,).
    """
    if path.order != 2:
        modes = rows.shape[1] - 2 * path.order + 1
        data = scaled_data(path, intervals, steps[intervals, None], modes)
        return np.asarray(np.matmul(rows[:, None], data)[:, 0])
    out = np.empty((len(rows), path.v.shape[1]))
    native.displacements_at(rows, steps, intervals, path.v, path.z, path.inner, out)
    return out


def scaled_data(path: DiscretePath, intervals: Index, steps: Array, modes: int) -> Array:
    """(h q0', ..., h^(k-1) q0^(k-1), h^k z, h^k inner) of some intervals, (B, 2 k - 1 + r, n).

    steps: h, shape (B, 1). modes: r.
    """
    k = path.order
    ends = path.rates[intervals] * (steps ** np.arange(1, k))[:, :, None]
    top = np.concatenate([path.z[intervals], path.inner[intervals, :modes]], axis=1)
    return np.concatenate([ends, top * steps[:, None] ** k], axis=1)


def move_any(
    path: DiscretePath, step: Array, steps: Array, space: ConfigurationSpace | None = None
) -> DiscretePath:
    """The path after a step, for any order k on vector spaces and commutative groups, or k = 1.

    step: in the columns (q0, h q0', ..., q1, h q1', ..., c), shape (N, 2 k + r, n).
    steps: h, shape (N,). space: None for a vector space.
    """
    k, powers = path.order, steps[:, None] ** np.arange(path.order + 1.0)
    first, last = step[:, :k] / powers[:, :k, None], step[-1, k : 2 * k] / powers[-1, :k, None]
    nodes = np.concatenate([first, last[None]])  # (N + 1, k, n)
    R = regular_from_nodal(0, k)[k:]
    z = path.z + np.matmul(R, step[:, : 2 * k]) / powers[:, k:, None]
    inner = path.inner.copy()
    inner[:, : step.shape[1] - 2 * k] += step[:, 2 * k :] / powers[:, k:, None]
    rates = path.rates + nodes[:, 1:]
    q = path.q + nodes[:, 0] if space is None else space.integrate(path.q, nodes[:, 0])
    return path_of_order(k, q, rates, z, inner, steps, space)


def regularized_nodes(nodes: Array, steps: Array, change: Array | None = None) -> Array:
    """z of every interval from (q, q', ..., q^(k-1)) at the nodes, (N, k, n).

    nodes: shape (N + 1, k, n). steps: h, shape (N,). change: q1 (-) q0 of the intervals, (N, n), on
        commutative groups and for k = 1, where the q of nodes are not read; q1 - q0 if None.
    """
    k, h = nodes.shape[1], steps[:, None]
    scaled = np.concatenate([nodes[:-1], nodes[1:]], axis=1)
    if change is not None:
        scaled[:, 0], scaled[:, k] = 0.0, change
    scaled *= (h ** np.tile(np.arange(k), 2))[:, :, None]
    return np.asarray(np.matmul(regular_from_nodal(0, k)[k:], scaled) / (h**k)[:, None])


def changes_along(path: DiscretePath, steps: Array) -> Array:
    """x1 of q1 = q0 (+) x1 by the z of every interval, (N, n): sum_i h^i q0^(i) / i! + h^k z_0."""
    k, h = path.order, steps[:, None]
    x1 = h**k * path.z[:, 0]
    for i in range(1, k):
        x1 = x1 + h**i / factorial(i) * path.rates[:-1, i - 1]
    return x1


def path_of_order(
    k: int,
    q: Array,
    rates: Array,
    z: Array,
    inner: Array,
    steps: Array,
    space: ConfigurationSpace | None = None,
) -> DiscretePath:
    """A path from q (N + 1, nq) and its derivatives (N + 1, k - 1, n) at the nodes.

    z, inner: as in DiscretePath. steps: h, shape (N,). For k = 1 the velocities follow from the
    curve of each interval, and on noncommutative groups z from the nodes, with the full turns that
    bring it closest to what is given.
    """
    if k > 1:
        return DiscretePath(q, rates[:, 0], z, inner, rates[:, 1:])
    h, curved = steps[:, None], space is not None and not space.flat
    if space is not None and curved:
        z = (space.difference_near(q[:-1], q[1:], h * z[:, 0]) / h)[:, None]
    r = inner.shape[1]
    rows = jet_rows(np.array([0.0, 1.0]), 1, r)[:, 1]  # (2, 1 + r), of h v over (h z, h inner)
    ends = np.einsum("sm,kmn->skn", rows, np.concatenate([z, inner], axis=1))
    last = ends[1, -1:]
    if space is not None and curved:  # v = J(x1) x1', where x1' is that of the chart
        last = Chart(space).jet(q[-2:-1], h[-1:] * z[-1], last, np.zeros_like(last))[1]
    return DiscretePath(q, np.concatenate([ends[0], last]), z, inner)


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
