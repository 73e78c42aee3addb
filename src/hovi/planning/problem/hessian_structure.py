"""Block structure of the action's Hessian, which depends on the grid and not on the motion."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import MORE_MODES, Grid
from hovi.discrete.interval_batch import COORDINATES, Coordinates
from hovi.optimize.banded_model import BandLayout
from hovi.optimize.merge_tree import MergeTree, merge_levels
from hovi.planning.problem.seams import Hold
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ActionStructure:
    """Unknowns, metric and elimination order of a grid, each computed on first use.

    grid: the intervals. dof: n, the degrees of freedom.
    free_ends: which of (q, q', ..., q^(k-1)) are free at the start and at the goal, shape
        (2, k, n); None for fixed ends.
    periodic: whether both ends are one node, whose free components are those of the start.
    holds: what is fixed at inner nodes.
    """

    grid: Grid
    dof: int
    free_ends: Mask | None = None
    periodic: bool = False
    holds: tuple[Hold, ...] = ()

    @cached_property
    def finer(self) -> ActionStructure:
        """That of the grid with MORE_MODES, for error estimates."""
        return dataclasses.replace(self, grid=self.grid.enriched(MORE_MODES))

    @cached_property
    def metric(self) -> dict[Coordinates, Array]:
        """The trust region's metric in both kinds of columns, (N, m, m)."""
        durations = durations_between(self.grid, self.holds)
        return {
            name: action_metric(self.grid, name, durations, self.periodic) for name in COORDINATES
        }

    @cached_property
    def sizes(self) -> dict[Coordinates, Array]:
        """Factors from columns to changes of q, T^j q^(j) and h^k c, or 0, (N or 1, m, 1)."""
        h, k = self.grid.steps, self.grid.order
        ratio = self.grid.duration / (h[:1] if np.ptp(h) == 0 else h)
        sizes = np.ones((len(ratio), 2 * k + self.grid.inner_modes, 1))
        sizes[:, : 2 * k, 0] = ratio[:, None] ** np.tile(np.arange(k), 2)
        regular = sizes.copy()
        regular[:, k : 2 * k] = 0.0
        return {"nodal": sizes, "regular": regular}

    @cached_property
    def layout(self) -> BandLayout:
        """The indices of nodes and inner modes in a banded matrix."""
        numbers = unknowns(self.grid, self.dof, self.free_ends, self.periodic, self.holds)
        return BandLayout.of(numbers, self._scales())

    @cached_property
    def metric_band(self) -> Array:
        """The metric as a banded matrix."""
        return self.layout.assemble(self.metric["nodal"][..., None, None] * np.eye(self.dof))

    def _scales(self) -> Array | None:
        """Ratios of columns and unknowns, (h / mean h)^j of q^(j); None if steps are equal."""
        steps, k = self.grid.steps, self.grid.order
        if np.ptp(steps) == 0:
            return None
        scales = np.ones((self.grid.intervals, 2 * k + self.grid.inner_modes))
        scales[:, : 2 * k] = (steps / steps.mean())[:, None] ** np.tile(np.arange(k), 2)
        return scales

    @cached_property
    def tree(self) -> MergeTree:
        """The order in which intervals are merged."""
        grid = self.grid
        present = np.zeros((grid.intervals, grid.inner_modes), dtype=bool)
        for scheme, index in grid.groups:
            present[index, : scheme.inner_modes] = True
        levels = merge_levels(grid.steps)
        return MergeTree(levels, grid.intervals, grid.inner_modes, self.dof, present)


def durations_between(grid: Grid, holds: Sequence[Hold]) -> Array:
    """The duration between the seams before and after each interval, in [s], shape (N,).

    A change of a motion that is held at seams has the length of one from seam to seam.
    """
    nodes = np.array([0, *(each.node for each in holds), grid.intervals])
    return np.repeat(np.diff(grid.t[nodes]), np.diff(nodes))


def action_metric(
    grid: Grid, coordinates: Coordinates, durations: Array, periodic: bool = False
) -> Array:
    """The trust region's metric: T^(2k-1) integral |dq^(k)|^2 over each interval, (N, m, m).

    For periodic motions plus integral |dq|^2 / T, as without it a translation has no length.
    durations: T of each interval, shape (N,), in [s].
    """
    k = grid.order
    m = 2 * k + grid.inner_modes
    metric = np.zeros((grid.intervals, m, m))
    for scheme, index in grid.groups:
        rows = (scheme.nodal_table if coordinates == "nodal" else scheme.regular_table)[:, k]
        own = rows.shape[1]
        scale = (durations[index] / grid.steps[index]) ** (2 * k - 1)
        metric[index, :own, :own] = scale[:, None, None] * ((rows.T * scheme.weights) @ rows)
        if periodic:
            rows = (scheme.nodal_table if coordinates == "nodal" else scheme.regular_table)[:, 0]
            fraction = grid.steps[index] / grid.duration
            metric[index, :own, :own] += fraction[:, None, None] * (
                (rows.T * scheme.weights) @ rows
            )
    return metric


def unknowns(
    grid: Grid,
    n: int,
    free_ends: Mask | None = None,
    periodic: bool = False,
    holds: Sequence[Hold] = (),
) -> Index:
    """Indices of the unknowns of each interval's columns (q0, h v0, q1, h v1, c), -1 where fixed.

    Nodes and inner modes alternate along the motion. Shape (N, m, n). A periodic motion is a cycle
    of them, folded at its start: the first, second, last, third, last but one, and so on, so that
    the band is only twice as wide as that of a motion between two ends, and nothing is bordered.
    free_ends, periodic, holds: as in ActionStructure.
    """
    N, r, k = grid.intervals, grid.inner_modes, grid.order
    modes = np.zeros(N, dtype=np.intp)
    for scheme, index in grid.groups:
        modes[index] = scheme.inner_modes
    free = np.ones((2 * N + 1, max(k, r), n), dtype=bool)  # nodes and inner modes alternate
    free[0::2, k:] = False
    free[[0, -1], :k] = False if free_ends is None else free_ends
    for each in holds:
        free[2 * each.node, :2] &= ~each.fixed
        free[2 * each.node, 2:] &= each.higher is None
    free[1::2] = np.arange(max(k, r))[:, None] < modes[:, None, None]
    if periodic:
        free[-1] = False
        order = _folded(2 * N)
        numbers = np.full(free.shape, -1)
        folded = free[order]
        numbers[order] = np.where(folded, np.cumsum(folded).reshape(folded.shape) - 1, -1)
        numbers[-1] = numbers[0]
    else:
        numbers = np.where(free, np.cumsum(free).reshape(free.shape) - 1, -1)
    nodes, inner = numbers[0::2, :k], numbers[1::2, :r]
    return np.concatenate([nodes[:-1], nodes[1:], inner], axis=1)


def _folded(length: int) -> Index:
    """The numbers of a cycle from both sides: 0, 1, length - 1, 2, length - 2, ..."""
    order = np.zeros(length, dtype=np.intp)
    order[1::2] = np.arange(1, length // 2 + 1)
    order[2::2] = np.arange(length - 1, length // 2, -1)
    return order
