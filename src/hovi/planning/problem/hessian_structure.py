"""Block structure of the action's Hessian, which depends on the grid and not on the motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.discrete.interval_batch import COORDINATES, Coordinates
from hovi.optimize.banded_model import BandLayout
from hovi.optimize.merge_tree import MergeTree, merge_levels

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ActionStructure:
    """Unknowns, metric and elimination order of a grid, each computed on first use.

    grid: the intervals. dof: n, the degrees of freedom.
    free_ends: which of (q, v) are free at the start and at the goal, shape (2, 2, n); None for
        fixed ends.
    """

    grid: Grid
    dof: int
    free_ends: Mask | None = None

    @cached_property
    def metric(self) -> dict[Coordinates, Array]:
        """The trust region's metric in both kinds of columns, (N, m, m)."""
        return {name: action_metric(self.grid, name) for name in COORDINATES}

    @cached_property
    def sizes(self) -> dict[Coordinates, Array]:
        """Factors from columns to changes of q, T v and h^2 c, or 0, shape (N or 1, m, 1)."""
        h = self.grid.steps
        speed = self.grid.duration / (h[:1] if np.ptp(h) == 0 else h)
        sizes = np.ones((len(speed), 4 + self.grid.inner_modes, 1))
        sizes[:, 1, 0] = sizes[:, 3, 0] = speed
        regular = sizes.copy()
        regular[:, 2:4] = 0.0
        return {"nodal": sizes, "regular": regular}

    @cached_property
    def layout(self) -> BandLayout:
        """The indices of nodes and inner modes in a banded matrix."""
        return BandLayout.of(unknowns(self.grid, self.dof, self.free_ends), self._scales())

    @cached_property
    def metric_band(self) -> Array:
        """The metric as a banded matrix."""
        return self.layout.assemble(self.metric["nodal"][..., None, None] * np.eye(self.dof))

    def _scales(self) -> Array | None:
        """Ratios of columns and unknowns, h / mean h for velocities; None if steps are equal."""
        steps = self.grid.steps
        if np.ptp(steps) == 0:
            return None
        scales = np.ones((self.grid.intervals, 4 + self.grid.inner_modes))
        scales[:, 1] = scales[:, 3] = steps / steps.mean()
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


def action_metric(grid: Grid, coordinates: Coordinates) -> Array:
    """The trust region's metric: T^3 integral |da|^2 over each interval, shape (N, m, m)."""
    metric = np.zeros((grid.intervals, 4 + grid.inner_modes, 4 + grid.inner_modes))
    for scheme, index in grid.groups:
        rows = (scheme.nodal_table if coordinates == "nodal" else scheme.regular_table)[:, 2]
        k = rows.shape[1]
        scale = (grid.duration / grid.steps[index]) ** 3
        metric[index, :k, :k] = scale[:, None, None] * ((rows.T * scheme.weights) @ rows)
    return metric


def unknowns(grid: Grid, n: int, free_ends: Mask | None = None) -> Index:
    """Indices of the unknowns of each interval's columns (q0, h v0, q1, h v1, c), -1 where fixed.

    Nodes and inner modes alternate along the motion. Shape (N, m, n).
    free_ends: as in ActionStructure.
    """
    N, r = grid.intervals, grid.inner_modes
    modes = np.zeros(N, dtype=np.intp)
    for scheme, index in grid.groups:
        modes[index] = scheme.inner_modes
    free = np.ones((2 * N + 1, max(2, r), n), dtype=bool)  # nodes and inner modes alternate
    free[0::2, 2:] = False
    free[[0, -1], :2] = False if free_ends is None else free_ends
    free[1::2] = np.arange(max(2, r))[:, None] < modes[:, None, None]
    numbers = np.where(free, np.cumsum(free).reshape(free.shape) - 1, -1)
    nodes, inner = numbers[0::2, :2], numbers[1::2, :r]
    return np.concatenate([nodes[:-1], nodes[1:], inner], axis=1)
