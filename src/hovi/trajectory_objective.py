"""The discrete action of a trajectory problem as an objective of the trust region."""

from __future__ import annotations

from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt

from hovi.discrete_lagrangian import Coordinates, Expansion
from hovi.grid import DiscretePath, Grid
from hovi.optimize.band import BandLayout, BandModel
from hovi.optimize.merge_tree import MergeTree, MergeTreeModel, merge_levels
from hovi.optimize.quadratic_model import IntervalSum, QuadraticModel
from hovi.optimize.trust_region import Objective
from hovi.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
LinearAlgebra = Literal["band", "tree"]

BAND_INTERVALS = 1000
"""Up to this many intervals the nodal band matrix, whose condition grows like N^4, is factored."""


class ActionObjective(Objective[DiscretePath]):
    """The discrete action between fixed ends, in nodal or in regularised coordinates.

    problem: what to minimise.
    algebra: "band" (LAPACK's banded Cholesky in nodal coordinates, the faster one) or "tree"
        (merging intervals in regularised coordinates, right at every step length).
    """

    def __init__(self, problem: TrajectoryProblem, algebra: LinearAlgebra | None = None) -> None:
        self.problem = problem
        self.ld = problem.ld
        small = problem.grid.intervals <= BAND_INTERVALS
        self.algebra: LinearAlgebra = algebra or ("band" if small else "tree")
        self._expansion: Expansion | None = None

    @property
    def coordinates(self) -> Coordinates:
        """Columns in which the intervals are expanded."""
        return "nodal" if self.algebra == "band" else "regular"

    def value(self, x: DiscretePath) -> float:
        """The discrete action."""
        return self.ld.action(x)

    def model(
        self, x: DiscretePath, previous: QuadraticModel | None, step: Array | None
    ) -> QuadraticModel:
        """The quadratic model at x, its curvature weighted by the predicted torque."""
        multipliers = None
        if previous is not None and step is not None and self._expansion is not None:
            local = previous.gather(step)
            multipliers = self.ld.predict(self._expansion, local, self.coordinates)
        self._expansion = self.ld.expand(x, self.coordinates, multipliers)
        intervals = IntervalSum(self._expansion.gradient, self._expansion.hessian, self._metric)
        if self.algebra == "band":
            return BandModel(intervals, self._layout, self._metric_band)
        return MergeTreeModel(intervals, self._tree)

    def merge_model(self, x: DiscretePath) -> MergeTreeModel:
        """The exact model at x in regularised coordinates, for the inertia."""
        expansion = self.ld.expand(x, "regular")
        intervals = IntervalSum(expansion.gradient, expansion.hessian, self._metric)
        return MergeTreeModel(intervals, self._tree)

    def retract(self, x: DiscretePath, step: Array, model: QuadraticModel) -> DiscretePath:
        """The path moved by a step: nodes by `integrate`, everything else added."""
        h = self._h
        local = model.gather(step)  # (N, m, n)
        dq = np.concatenate([local[:, 0], np.zeros((1, local.shape[2]))])
        dv = np.concatenate([local[:, 1] / h, np.zeros((1, local.shape[2]))])
        dZ = local[:, 2:4]
        if self.algebra == "band":
            dZ = np.stack([dZ[:, 0] - local[:, 0] - local[:, 1], dZ[:, 1] - local[:, 1]], axis=1)
        q = self.problem.robot.integrate(x.q, dq)
        hh = h[:, None] ** 2
        return DiscretePath(q, x.v + dv, x.z + dZ / hh, x.inner + local[:, 4:] / hh)

    def relative_size(self, x: DiscretePath, step: Array, model: QuadraticModel) -> float:
        """The largest change of q or T v at a node, relative to their size (at least one)."""
        local = model.gather(step)
        T = self.problem.grid.duration
        size = max(1.0, float(np.max(np.abs(x.q))), T * float(np.max(np.abs(x.v))))
        dq = float(np.max(np.abs(local[:, 0])))
        dv = float(np.max(np.abs(local[:, 1] / self._h)))
        return max(dq, T * dv) / size

    @property
    def _h(self) -> Array:
        return self.problem.grid.steps[:, None]

    @cached_property
    def _metric(self) -> Array:
        """T^3 times the integral of |da|^2 over each interval, (N, m, m)."""
        grid = self.problem.grid
        metric = np.zeros((grid.intervals, 4 + grid.inner_modes, 4 + grid.inner_modes))
        for scheme, index in grid.groups:
            table = scheme.nodal_table if self.algebra == "band" else scheme.regular_table
            rows = table[:, 2]
            k = rows.shape[1]
            scale = (grid.duration / grid.steps[index]) ** 3
            metric[index, :k, :k] = scale[:, None, None] * ((rows.T * scheme.weights) @ rows)
        return metric

    @cached_property
    def _layout(self) -> BandLayout:
        return BandLayout.of(unknowns(self.problem.grid, self.problem.robot.nv))

    @cached_property
    def _metric_band(self) -> Array:
        eye = np.eye(self.problem.robot.nv)
        return self._layout.assemble(self._metric[..., None, None] * eye)

    @cached_property
    def _tree(self) -> MergeTree:
        grid = self.problem.grid
        present = np.zeros((grid.intervals, grid.inner_modes), dtype=bool)
        for scheme, index in grid.groups:
            present[index, : scheme.inner_modes] = True
        levels = merge_levels(grid.steps)
        n = self.problem.robot.nv
        return MergeTree(levels, grid.intervals, grid.inner_modes, n, present)


def unknowns(grid: Grid, n: int) -> Index:
    """Numbers of the unknowns of every interval's columns (q0, h v0, q1, h v1, c), -1 where fixed.

    Nodes and inner modes alternate along the motion; both ends are fixed. Shape (N, m, n).
    """
    N, r = grid.intervals, grid.inner_modes
    modes = np.zeros(N, dtype=np.intp)
    for scheme, index in grid.groups:
        modes[index] = scheme.inner_modes
    node_sizes = np.full(N + 1, 2 * n)
    node_sizes[[0, -1]] = 0
    sizes = np.zeros(2 * N + 1, dtype=np.intp)
    sizes[0::2], sizes[1::2] = node_sizes, modes * n
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    nodes = first[0::2, None] + np.arange(2 * n)
    nodes[[0, -1]] = -1
    inner = first[1::2, None] + np.arange(r * n)
    inner[np.arange(r * n) >= (modes * n)[:, None]] = -1
    return np.concatenate([nodes[:-1], nodes[1:], inner], axis=1).reshape(N, 4 + r, n)
