"""Paths for Lagrangians of orders other than 2: the polynomial between the ends, curves on a grid.

On vector spaces and commutative groups, where x(t) of q0 (+) x(t) has the velocity x', and for
order 1 on every group.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import Curve, in_chart, projection_on_modes, rotation_along, with_turns
from hovi.discrete.interval_paths import path_of_order, regularized_nodes
from hovi.robot.space.chart import Chart
from hovi.robot.space.coordinates import Coordinates
from hovi.schemes.interval_curve import jet_rows
from hovi.schemes.scheme import regular_from_nodal

Array = npt.NDArray[np.float64]


def hermite(ends: Array, duration: float) -> Curve:
    """The polynomial of degree 2 k - 1 between two points: the minimizer of 1/2 |q^(k)|^2.

    ends: (q, q', ..., q^(k-1)) at the start and at the goal, shape (2, k, n). duration: T, in [s].
    """
    k, T = ends.shape[1], duration
    scaled = ends * T ** np.arange(k)[:, None]
    local = np.concatenate([scaled[0, 1:], regular_from_nodal(0, k)[k:] @ np.concatenate(scaled)])

    def curve(t: Array) -> tuple[Array, ...]:
        jet = jet_rows(np.asarray(t) / T, k, 0, max(k, 2)) @ local
        rates = (jet[:, j] / T**j for j in range(1, jet.shape[1]))
        return ends[0, 0] + jet[:, 0], *rates

    return curve


def polynomial(on: Coordinates, ends: Sequence[Array], duration: float, turns: Array) -> Curve:
    """The curve q0 (+) x(t) with the Hermite polynomial x between two points of T^(k-1)Q.

    On vector spaces, commutative groups, and for k = 1. ends: as in `path_of_any_order`.
    turns: as in `with_turns`. duration: T, in [s].
    """
    q, *rates = ends
    if on.vector_joints:
        return hermite(np.stack(ends, axis=1), duration)
    x1 = on.difference(q[0], q[1])
    if on.space.flat:
        x1 = x1 + 2 * np.pi * turns
    x = hermite(np.stack([np.stack([0 * x1, x1]), *rates], axis=1), duration)

    def curve(t: Array) -> tuple[Array, ...]:
        jet = x(t)
        if not on.space.flat:
            return in_chart(on, q[0], *jet)
        return on.integrate(q[0], jet[0]), *jet[1:]

    return curve if on.space.flat else with_turns(curve, on, duration, turns)


def path_of_any_order(
    curve: Curve, grid: Grid, ends: Sequence[Array], on: Coordinates | None = None
) -> DiscretePath:
    """As `path_on_grid`, for any order k on vector spaces and commutative groups, and for k = 1.

    ends: (q, q', ..., q^(k-1)) at the start and at the goal, two rows each. on: None for a vector
        space.
    """
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


def moved_any(
    path: DiscretePath, grid: Grid, ends: Sequence[Array], on: Coordinates
) -> DiscretePath:
    """As `moved`, for any order; arguments as of `path_of_any_order`."""
    old, space = (path.q, *np.moveaxis(path.rates, 1, 0)), on.curved_space
    dq = on.difference(path.q[[0, -1]], ends[0])
    rates = [new - x[[0, -1]] for x, new in zip(old[1:], ends[1:], strict=True)]
    change = np.stack([dq, *rates], axis=1)
    if not change.any():
        return path
    more = path_of_any_order(hermite(change, grid.duration), grid, (dq, *rates))
    z, inner, q = path.z + more.z, path.inner + more.inner, on.integrate(path.q, more.q)
    if space is not None:
        q[[0, -1]] = ends[0]
    return path_of_order(grid.order, q, path.rates + more.rates, z, inner, grid.steps, space)


def with_fixed(
    on: Coordinates,
    ends: Sequence[Array],
    fixed: Sequence[Array],
    free: npt.NDArray[np.bool_],
    periodic: bool,
) -> list[Array]:
    """Ends whose components are those of `fixed` where they are not free.

    ends, fixed: as in `path_of_any_order`. free: shape (2, k, nv). periodic: whether the second end
    differs from the first by as much as those of `fixed` do, on vector spaces.
    """
    columns = np.moveaxis(free, 1, 0)
    q0, *rates = fixed
    if on.vector_joints:
        q = np.where(columns[0], ends[0], q0)
    else:
        q = on.integrate(q0, np.where(columns[0], on.difference(q0, ends[0]), 0.0))
    known = [q, *map(np.where, columns[1:], ends[1:], rates)]
    for x, own in zip(known, fixed, strict=True) if periodic else ():
        x[1] = x[0] + own[1] - own[0]
    return known
