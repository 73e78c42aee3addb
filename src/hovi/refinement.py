"""Where a grid has to be finer: more inner modes where it is smooth, more intervals elsewhere.

How fast the Legendre coefficients of an interval's acceleration decay says which of the two pays:
they fall like rho^j, where 1/rho is the size of the ellipse of analyticity around the interval.
More modes lower the error by rho per mode; cutting the interval makes rho itself smaller.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.grid import DiscretePath, Grid
from hovi.schemes import galerkin

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

DECAY = 0.02, 0.97
"""Range of the decay that is believed."""
PIECES = np.array([1, 2, 4])
"""Pieces into which an interval may be cut at a time."""
DEGREES = np.array([0, 1, 2, 3, 4, 6, 8, 10, 12])
"""Inner modes that intervals may be given: few values, since those of one scheme are evaluated
together."""
OVERHEAD = 1.0
"""What an interval costs besides its quadrature points, in points."""
GROUP = 900.0
"""What a scheme costs besides, since its intervals are evaluated on their own: in points, for one
joint. A point's cost grows like the square of the joints, this does not."""


@dataclass(frozen=True, eq=False)
class Demand:
    """By which factor an error has to fall in each interval.

    factor: shape (N,), 1 or more where nothing has to be done.
    power: 1 for the curve between the nodes, 2 for the cost and the nodes, whose order is twice
        that of the acceleration.
    """

    factor: Array
    power: int


def decay(grid: Grid, path: DiscretePath) -> Array:
    """rho of each interval, from its last four Legendre coefficients of a, shape (N,).

    Coefficients of even and odd degree are taken in pairs, over all joints.
    """
    z0, z1 = path.z[:, 0], path.z[:, 1]
    ends = np.stack([z1, 2 * np.sqrt(3) * (z0 - z1 / 2)], axis=1)
    sizes = np.linalg.norm(np.concatenate([ends, path.inner], axis=1), axis=2)  # (N, 2 + r)
    rho = np.empty(grid.intervals)
    for scheme, index in grid.groups:
        last = sizes[index, : 2 + scheme.inner_modes][:, -4:]
        if last.shape[1] < 4:
            rho[index] = DECAY[1]
            continue
        low, high = np.hypot(last[:, 0], last[:, 1]), np.hypot(last[:, 2], last[:, 3])
        rho[index] = np.sqrt(high / np.maximum(low, np.finfo(float).tiny))
    return np.clip(rho, *DECAY)


def refined(grid: Grid, rho: Array, demands: Sequence[Demand], joints: int = 6) -> Grid:
    """The cheapest grid that is foreseen to meet every demand.

    rho: decay of each interval. joints: degrees of freedom of what moves.
    An interval whose demands nothing meets is cut into four.
    """
    degrees = np.array([scheme.inner_modes for scheme in grid.schemes])
    pieces, chosen = _choice(degrees, rho, demands)
    chosen = _fewer_schemes(pieces, chosen, GROUP / joints**2)
    steps = np.repeat(grid.steps / pieces, pieces)
    return Grid(steps, tuple(galerkin(int(r)) for r in np.repeat(chosen, pieces)))


def _choice(degrees: Index, rho: Array, demands: Sequence[Demand]) -> tuple[Index, Index]:
    """Pieces and inner modes of every interval, by the least work."""
    more = np.maximum(DEGREES[None, :], degrees[:, None])  # (N, D)
    log_rho = np.log(_decay_of_pieces(rho))  # (N, S)
    after = (more[:, None] + 2) * log_rho[:, :, None]  # (N, S, D)
    before = (degrees + 2) * np.log(rho)
    change = after - before[:, None, None]
    meets = np.ones(change.shape, dtype=bool)
    for demand in demands:
        wanted = np.log(np.minimum(demand.factor, 1.0))
        meets &= demand.power * change <= wanted[:, None, None] + 1e-12
    work = PIECES[:, None] * (more[:, None] + 2 + OVERHEAD)
    work = np.where(meets, work, np.inf).reshape(len(rho), -1)
    best = np.argmin(work, axis=1)
    s, d = np.divmod(best, len(DEGREES))
    hopeless = ~np.isfinite(work[np.arange(len(rho)), best])
    pieces = np.where(hopeless, PIECES[-1], PIECES[s])
    return pieces, np.where(hopeless, np.maximum(degrees, 2), more[np.arange(len(rho)), d])


def _fewer_schemes(pieces: Index, chosen: Index, group: float) -> Index:
    """Inner modes raised to the next of a few values that cost the least together.

    group: what a value costs besides its points, in points.
    """
    values = np.unique(chosen)
    best, least = chosen, np.inf
    for size in range(1, min(len(values), 4) + 1):
        for kept in itertools.combinations(values[:-1], size - 1):
            levels = np.array([*kept, values[-1]])
            raised = levels[np.searchsorted(levels, chosen)]
            work = float(np.sum(pieces * (raised + 2))) + group * size
            if work < least:
                best, least = raised, work
    return best


def _decay_of_pieces(rho: Array) -> Array:
    """rho after cutting into PIECES, shape (N, S).

    For a singularity beside the middle of the interval, at a distance of y half lengths,
    1/rho = y + sqrt(1 + y^2); cutting into s pieces makes it s y.
    """
    y = 0.5 * (1 / rho - rho)[:, None] * PIECES
    return np.asarray(np.sqrt(1 + y**2) - y)
