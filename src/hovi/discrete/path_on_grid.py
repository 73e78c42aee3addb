"""Curves on a grid, and paths moved to other ends, of every order k.

For orders other than 2 on vector spaces and commutative groups, where x(t) of q0 (+) x(t) has the
velocity x', and for order 1 on every group.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import (
    Curve,
    Ends,
    hermite,
    modes_of,
    projection_on_modes,
    regularized,
    rotation_along,
    with_ends_of_nodes,
)
from hovi.discrete.interval_paths import path_of_order, regularized_nodes
from hovi.robot.space.chart import Chart
from hovi.robot.space.coordinates import Coordinates
from hovi.schemes.polynomials import interval_rows

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


def path_on_grid(
    curve: Curve, grid: Grid, ends: Ends, on: Coordinates | None = None
) -> DiscretePath:
    """The curve on a grid: its nodes, and its highest derivative projected on the inner modes.

    For orders other than 2 on vector spaces and commutative groups, and for order 1 on every group.
    ends: exactly those of the path. on: None for a vector space, of orders other than 2.
    """
    if grid.order != 2 or on is None:
        return _of_any_order(curve, grid, ends, on)
    q, v, _ = (x.copy() for x in curve(grid.t))
    q[[0, -1]], v[[0, -1]] = ends
    rotation = None if on.vector_joints else rotation_along(curve, grid, on)
    inner = modes_of(curve, grid, on, q)
    return DiscretePath(q, v, regularized(on, grid, q, v, rotation), inner)


def _of_any_order(curve: Curve, grid: Grid, ends: Ends, on: Coordinates | None) -> DiscretePath:
    k, h = grid.order, grid.steps[:, None]
    q, *rates = (x.copy() for x in curve(grid.t)[: k + 1])
    for x, own in zip((q, *rates), ends, strict=False):
        x[[0, -1]] = own
    change, space = None, None if on is None else on.curved_space
    if on is not None and space is not None:
        change = space.difference_near(q[:-1], q[1:], rotation_along(curve, grid, on))
    inner = np.zeros((grid.intervals, grid.inner_modes, rates[0].shape[1]))
    for scheme, index in grid.groups:
        r = scheme.inner_modes
        if r > 0:
            s, projection = projection_on_modes(r, k)
            t = grid.t[:-1][index][:, None] + h[index] * s
            jet = curve(t.ravel())
            top = jet[k]
            if space is not None and not space.flat:  # k = 1, and x' in the interval's chart
                x = space.difference(np.repeat(q[:-1][index], len(s), axis=0), jet[0])
                top = Chart(space).rates(x, top)[0]
            inner[index, :r] = np.matmul(projection, top.reshape(len(index), len(s), -1))
    first = q if change is None else np.zeros_like(rates[0])
    nodes = np.stack([first, *rates[: k - 1]], axis=1)
    z = regularized_nodes(nodes, grid.steps, change)
    return path_of_order(k, q, nodes[:, 1:], z, inner, grid.steps, space)


def moved(path: DiscretePath, grid: Grid, ends: Ends, on: Coordinates) -> DiscretePath:
    """A path plus the cubic, or Hermite polynomial, that moves its ends to others."""
    if grid.order == 2:
        return _moved_by_cubic(path, grid, ends, on)
    space, old = on.curved_space, np.moveaxis(path.rates, 1, 0)
    dq = on.difference(path.q[[0, -1]], ends[0])
    rates = [new - x[[0, -1]] for x, new in zip(old, ends[1:], strict=True)]
    change = np.stack([dq, *rates], axis=1)
    if not change.any():
        return path
    more = _of_any_order(hermite(change, grid.duration), grid, (dq, *rates), None)
    z, inner, q = path.z + more.z, path.inner + more.inner, on.integrate(path.q, more.q)
    if space is not None:
        q[[0, -1]] = ends[0]
    return path_of_order(grid.order, q, path.rates + more.rates, z, inner, grid.steps, space)


def _moved_by_cubic(path: DiscretePath, grid: Grid, ends: Ends, on: Coordinates) -> DiscretePath:
    (q0, q1), (v0, v1) = ends
    old = path.q[[0, -1]], path.v[[0, -1]]
    if [x.tolist() for x in old] == [np.asarray(x).tolist() for x in ends]:
        return path
    dq0, dq1 = on.difference(old[0][0], q0), on.difference(old[0][1], q1)
    dv0, dv1 = v0 - old[1][0], v1 - old[1][1]
    T, s = grid.duration, grid.t / grid.duration
    local = np.stack([T * dv0, dq1 - dq0 - T * dv0, T * (dv1 - dv0)])
    dq, Tdv, TTda = np.moveaxis(interval_rows(s, 0) @ local, 1, 0)  # (N + 1, n) each
    h = (grid.steps / T)[:, None]
    # for a cubic z1 is the mean acceleration, and z0 = a/2 + h j/6 with the jerk j
    jerk = np.diff(TTda, axis=0) / h
    z = np.stack([TTda[:-1] / 2 + h * jerk / 6, TTda[:-1] + h * jerk / 2], axis=1) / T**2
    q = on.integrate(path.q, dq0 + dq)
    q[0], q[-1] = q0, q1
    v = path.v + Tdv / T
    v[0], v[-1] = v0, v1
    return with_ends_of_nodes(DiscretePath(q, v, path.z + z, path.inner), grid, on)


def with_fixed(
    on: Coordinates, ends: Ends, fixed: tuple[Array, ...], free: Mask, periodic: bool
) -> tuple[Array, ...]:
    """Ends whose components are those of `fixed` where they are not free.

    free: shape (2, k, nv). periodic: whether the second end differs from the first by as much as
    those of `fixed` do, on vector spaces.
    """
    if not free.any():
        return fixed
    columns = np.moveaxis(free, 1, 0)
    q = on.integrate(fixed[0], np.where(columns[0], on.difference(fixed[0], ends[0]), 0.0))
    known = (q, *map(np.where, columns[1:], ends[1:], fixed[1:]))
    for x, own in zip(known, fixed, strict=True) if periodic else ():
        x[1] = x[0] + (own[1] - own[0])
    return known
