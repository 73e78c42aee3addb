"""Where a grid has to be finer: more inner modes where it is smooth, more intervals elsewhere.

How fast the Legendre coefficients of an interval's acceleration decay says which of the two pays:
they fall like rho^j, where 1/rho is the size of the ellipse of analyticity around the interval.
More modes lower the error by rho per mode; cutting the interval makes rho itself smaller.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.schemes import galerkin

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]

DECAY = 0.02, 0.97
"""Range of the decay that is believed."""
PIECES = np.array([1, 2, 3, 4])
"""Pieces into which an interval may be cut at a time."""
DEGREES = np.array([2, 3, 4, 5, 6, 8, 10, 12])
"""Inner modes that intervals may be given."""
PADDING = 0.05
"""What an interval costs besides its quadrature points, in points per square of the columns of the
most flexible scheme: the Hessians of all intervals are stored and factored with as many."""
GROUP = 900.0
"""What a scheme costs besides, since its intervals are evaluated on their own: in points, for one
joint. A point's cost grows like the square of the joints, this does not."""
HOPELESS = 1000
"""Pieces that stand for a number of modes that cannot meet the demands."""
CUT = 900.0
"""What it costs to read the motion at new nodes, in points, for one joint."""


@dataclass(frozen=True, eq=False)
class Demand:
    """By which factor an error has to fall in each interval.

    factor: shape (N,), 1 or more where nothing has to be done.
    power: 1 for the curve between the nodes, 2 for the cost and the nodes, whose order is twice
        that of the acceleration.
    """

    factor: Array
    power: int

    def left(self, change: Array | float) -> float:
        """What is left to be done once the acceleration's error falls by `change`: 1 is just met.

        The cost sums the intervals up; of the curve the largest counts.
        """
        left = change**self.power / self.factor
        return float(np.mean(left) if self.power == 2 else np.max(left))


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
    """The cheapest grid that is foreseen to meet every demand, of one scheme or of two.

    rho: decay of each interval. joints: degrees of freedom of what moves.
    An interval whose demands nothing meets is cut into four.
    """
    degrees = np.array([scheme.inner_modes for scheme in grid.schemes])
    more = np.maximum(DEGREES, degrees[:, None])  # (N, D)
    pieces = _pieces(degrees, more, rho, demands)
    low, high = _cheapest(more, pieces, 1.0 / joints**2)
    kept, N = np.array([low, high]), np.arange(grid.intervals)
    choice = kept[np.argmin((pieces * (more + 2))[:, kept], axis=1)]
    cut, modes = pieces[N, choice], more[N, choice]
    steps = np.repeat(grid.steps / cut, cut)
    return Grid(steps, tuple(galerkin(int(r)) for r in np.repeat(modes, cut)))


def _pieces(degrees: Index, more: Index, rho: Array, demands: Sequence[Demand]) -> Index:
    """Into how many pieces each interval is cut with each number of modes, (N, D).

    Where no number of pieces meets the demands, but another of modes does, out of all proportion.
    """
    after = (more[:, :, None] + 2) * np.log(_decay_of_pieces(rho))[:, None]  # (N, D, S)
    change = after - ((degrees + 2) * np.log(rho))[:, None, None]
    meets: Mask = np.ones(change.shape, dtype=bool)
    for demand in demands:
        wanted = np.log(np.minimum(demand.factor, 1.0))
        meets &= demand.power * change <= wanted[:, None, None] + 1e-12
    possible: Mask = np.any(meets, axis=2)
    pieces = np.where(possible, PIECES[np.argmax(meets, axis=2)], HOPELESS)
    hopeless = ~possible.any(axis=1)
    pieces[hopeless] = PIECES[-1]
    return pieces


def _cheapest(more: Index, pieces: Index, share: float) -> tuple[int, int]:
    """Places in DEGREES of the two numbers of modes that cost the least together; they may agree.

    share: what a group or a cut costs for these joints, as a share of what it does for one.
    """
    low, high = np.triu_indices(len(DEGREES))
    points = pieces * (more + 2)
    taken = np.where(points[:, low] <= points[:, high], pieces[:, low], pieces[:, high])
    work = np.minimum(points[:, low], points[:, high]).sum(axis=0)
    work = work + PADDING * taken.sum(axis=0) * (more.max(axis=0)[high] + 4) ** 2
    work += share * (GROUP * (low != high) + CUT * (taken > 1).any(axis=0))
    best = int(np.argmin(work))
    return int(low[best]), int(high[best])


def _decay_of_pieces(rho: Array) -> Array:
    """rho after cutting into PIECES, shape (N, S).

    For a singularity beside the middle of the interval, at a distance of y half lengths,
    1/rho = y + sqrt(1 + y^2); cutting into s pieces makes it s y.
    """
    y = 0.5 * (1 / rho - rho)[:, None] * PIECES
    return np.asarray(np.sqrt(1 + y**2) - y)
