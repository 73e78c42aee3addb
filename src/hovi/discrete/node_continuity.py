"""Consistency check of a motion from a file."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.interval_paths import changes_along, regularized_nodes
from hovi.errors import InputError
from hovi.robot.space.chart import Chart
from hovi.robot.space.configuration_space import ConfigurationSpace

Array = npt.NDArray[np.float64]

MAX_NUMBER = 1e50
"""Largest magnitude in a motion: squares of torques of more would overflow."""
TOLERANCE = 1e-6
"""Relative to the largest coordinate; an unmodified motion deviates by rounding only."""


def _require_moderate(path: DiscretePath) -> None:
    """Raise InputError for numbers beyond any motion, of which samples would not be finite."""
    for name in ("q", "v", "z", "inner", "higher"):
        most = np.abs(getattr(path, name)).max(initial=0.0)
        if most > MAX_NUMBER:
            raise InputError(f"{name} has {most:.3g}, beyond the largest number, {MAX_NUMBER:g}")


def require_continuous(
    path: DiscretePath, grid: Grid, space: ConfigurationSpace | None = None
) -> None:
    """Raise InputError if the nodes of a path do not match its regularized coordinates.

    q1 = q0 (+) x1 and v1 = J(x1) x1' hold for every interval, with x1 = h v0 + h^2 z0 and
    x1' = v0 + h z1; on vector spaces q1 = q0 + x1 and v1 = x1'. For other orders k than 2
    q1^(j) = sum_{i >= j} h^(i-j) q0^(i) / (i-j)! + h^(k-j) z_j, j < k.

    space: the configuration space; None if it is a vector space.
    And numbers must not be larger than MAX_NUMBER. The message names the interval.
    """
    _require_moderate(path)
    if path.order != 2:
        _require_ends(path, grid, space)
        return
    h = grid.steps[:, None]
    x, v = h * path.v[:-1] + h**2 * path.z[:, 0], path.v[:-1] + h * path.z[:, 1]
    if space is None:
        q = path.q[:-1] + x
    else:
        q, v, _ = Chart(space).jet(path.q[:-1], x, v, np.zeros_like(v))
        q = space.nearest(q, path.q[1:])
    for name, found, expected in (("q", path.q, q), ("v", path.v, v)):
        _require_small(name, found[1:] - expected, found)


def _require_ends(path: DiscretePath, grid: Grid, space: ConfigurationSpace | None) -> None:
    """As `require_continuous`, for other orders."""
    k, h = path.order, grid.steps[:, None]
    if space is None:
        change, nodes = None, path.nodes
    else:
        near = changes_along(path, grid.steps)
        change = space.difference_near(path.q[:-1], path.q[1:], near)
        nodes = np.append(np.append(near, near[-1:], axis=0)[:, None], path.rates, axis=1)
    gap = regularized_nodes(nodes, grid.steps, change) - path.z
    for j in range(k):
        name = ("q", "v", "a")[j] if j < 3 else f"derivative {j}"
        _require_small(name, h ** (k - j) * gap[:, j], nodes[:, j])


def _require_small(name: str, difference: Array, values: Array) -> None:
    """Raise InputError for a difference (N, n) that is no rounding error of values (N + 1, n)."""
    miss = np.abs(difference).max(axis=1, initial=0.0)  # (N,)
    if not miss.max() <= TOLERANCE * (1.0 + np.abs(values).max(initial=0.0)):
        raise InputError(
            f"{name} at the end of interval {int(miss.argmax())} does not match its start and "
            f"z; the difference is {miss.max():.3g}."
        )
