"""hp refinement: more inner modes where the motion is smooth, shorter intervals elsewhere.

The choice depends on the decay of the Legendre coefficients of q^(k), with k the order of the
Lagrangian, in an interval: they decrease like rho^j, with 1/rho the size of the ellipse of
analyticity around the interval. More modes reduce the error by a factor of rho per mode; splitting
the interval reduces rho itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.schemes import Scheme, galerkin
from hovi.schemes.interval_curve import end_degrees, inverse_gamma
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]

DECAY_RANGE = 0.02, 0.97
"""Range to which estimates of rho are clipped."""
PIECES = np.array([1, 2, 3, 4])
"""Numbers of pieces into which an interval may be split."""
MODES = np.array([2, 3, 4, 5, 6, 8, 10, 12])
"""Numbers of inner modes that an interval may have."""
HESSIAN_COST = 0.05
"""Cost of an interval's Hessian, in points per square of the columns of the largest scheme, with
which the Hessians of all intervals are stored and factored."""
SCHEME_COST = 900.0
"""Fixed cost of a second scheme, whose intervals are evaluated separately, in points for one joint.
The cost of a point grows like the square of the number of joints; this one is constant."""
UNRESOLVED_MODES = 6
"""Largest number of inner modes while the motion is not resolved: its decay is not yet known."""
MORE_POINTS = 4
"""Quadrature points of an interval beyond r + k while the motion is not resolved, so that the
torque cannot vanish at the points alone."""
ROUNDING = 1e-12
"""Excess over a demand that is rounding, in logarithms of errors."""
USUAL_JOINTS = 6
"""Degrees of freedom of a robot where they are not given."""
INFEASIBLE_PIECES = 1000
"""Number of pieces that stands for a number of modes with which the demands cannot be satisfied."""
SPLIT_COST = 900.0
"""Fixed cost of interpolating the motion at new nodes, in points for one joint."""


@dataclass(frozen=True, eq=False)
class Demand:
    """The factor by which an error has to be reduced in each interval.

    factor: shape (N,); 1 or more where no reduction is needed.
    power: 1 for the curve between the nodes, 2 for the cost and the nodes, whose order is twice
        that of the acceleration.
    """

    factor: Array
    power: int

    def remaining(self, change: Array | float) -> float:
        """Ratio of predicted and demanded error once the acceleration's error changes by `change`.

        At most 1 if the demand is satisfied: the mean over the intervals for the cost, the maximum
        for the curve.
        """
        ratio = change**self.power / self.factor
        return float(np.mean(ratio) if self.power == 2 else np.max(ratio))


def decay(grid: Grid, path: DiscretePath) -> Array:
    """rho of each interval, from the last four Legendre coefficients of q^(k), shape (N,).

    Coefficients are taken in pairs of an even and an odd degree, over all joints.
    """
    ends = np.matmul(first_coefficients(grid.order), path.z)
    sizes = np.linalg.norm(np.concatenate([ends, path.inner], axis=1), axis=2)  # (N, k + r)
    rho = np.empty(grid.intervals)
    for scheme, index in grid.groups:
        last = sizes[index, : grid.order + scheme.inner_modes][:, -4:]
        if last.shape[1] < 4:
            rho[index] = DECAY_RANGE[1]
            continue
        low, high = np.hypot(last[:, 0], last[:, 1]), np.hypot(last[:, 2], last[:, 3])
        rho[index] = np.sqrt(high / np.maximum(low, np.finfo(float).tiny))
    return np.clip(rho, *DECAY_RANGE)


@cache
def first_coefficients(k: int) -> Array:
    """From z of an interval to the first k Legendre coefficients of q^(k), up to signs, (k, k)."""
    return np.asarray(inverse_gamma(k)[np.argsort(end_degrees(k))])


def refined(
    grid: Grid,
    rho: Array,
    demands: Sequence[Demand],
    joints: int = USUAL_JOINTS,
    decay_known: bool = True,
    few_points: bool = True,
) -> Grid:
    """The cheapest grid that is predicted to satisfy every demand, with one scheme or two.

    rho: decay of each interval, shape (N,). joints: degrees of freedom of the robot.
    decay_known: whether that is the decay of the motion; else modes are at most UNRESOLVED_MODES.
    few_points: whether an interval has r + k quadrature points, else MORE_POINTS more.
    An interval whose demands no choice satisfies is split into four.
    """
    current = np.array([scheme.inner_modes for scheme in grid.schemes])
    allowed = MODES if decay_known else MODES[MODES <= UNRESOLVED_MODES]
    more = np.maximum(allowed, current[:, None])  # (N, D)
    pieces = _pieces(current, more, rho, demands, grid.order)
    low, high = _cheapest(more, pieces, 1.0 / joints**2, grid.order)
    kept, N = np.array([low, high]), np.arange(grid.intervals)
    choice = kept[np.argmin((pieces * (more + grid.order))[:, kept], axis=1)]
    cut, modes = pieces[N, choice], more[N, choice]
    steps = np.repeat(grid.steps / cut, cut)
    table = galerkin if few_points else galerkin_with_more_points
    tables = {int(r): table(int(r), grid.order) for r in set(modes)}
    return Grid(steps, tuple(tables[int(r)] for r in np.repeat(modes, cut)))


def galerkin_with_more_points(inner_modes: int, k: int = 2) -> Scheme:
    """The Galerkin scheme for motions that are not resolved yet: MORE_POINTS beyond r + k."""
    return galerkin(inner_modes, derivatives=k, points=inner_modes + k + MORE_POINTS)


def _pieces(current: Index, more: Index, rho: Array, demands: Sequence[Demand], k: int) -> Index:
    """Pieces into which each interval is split with each number of modes, shape (N, D).

    INFEASIBLE_PIECES where only another number of modes satisfies the demands.
    """
    after = (more[:, :, None] + k) * np.log(_decay_of_pieces(rho))[:, None]  # (N, D, S)
    change = after - ((current + k) * np.log(rho))[:, None, None]
    satisfied: Mask = np.ones(change.shape, dtype=bool)
    for demand in demands:
        wanted = np.log(np.minimum(demand.factor, 1.0))
        satisfied &= demand.power * change <= wanted[:, None, None] + ROUNDING
    possible: Mask = np.any(satisfied, axis=2)
    pieces = np.where(possible, PIECES[np.argmax(satisfied, axis=2)], INFEASIBLE_PIECES)
    infeasible = ~possible.any(axis=1)
    pieces[infeasible] = PIECES[-1]
    return pieces


def _cheapest(more: Index, pieces: Index, fraction: float, k: int) -> tuple[int, int]:
    """Indices in MODES of the cheapest pair of numbers of modes, which may be equal.

    fraction: fixed costs for this number of joints, relative to those for one joint.
    """
    low, high = np.triu_indices(more.shape[1])
    points = pieces * (more + k)
    count = np.where(points[:, low] <= points[:, high], pieces[:, low], pieces[:, high])
    work = np.minimum(points[:, low], points[:, high]).sum(axis=0)
    work = work + HESSIAN_COST * count.sum(axis=0) * (more.max(axis=0)[high] + 2 * k) ** 2
    work += fraction * (SCHEME_COST * (low != high) + SPLIT_COST * (count > 1).any(axis=0))
    best = int(np.argmin(work))
    return int(low[best]), int(high[best])


def _decay_of_pieces(rho: Array) -> Array:
    """rho after splitting into PIECES, shape (N, S).

    For a singularity next to the middle of the interval, at a distance of y half lengths,
    1/rho = y + sqrt(1 + y^2); splitting into s pieces changes y to s y.
    """
    y = 0.5 * (1 / rho - rho)[:, None] * PIECES
    return np.asarray(np.sqrt(1 + y**2) - y)
