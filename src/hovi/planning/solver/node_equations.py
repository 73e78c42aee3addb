"""Equations at nodes, those of one function together."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import without_checks
from hovi.conditions.condition import Equation
from hovi.conditions.function import STATE, Points
from hovi.discrete.grid import DiscretePath, Grid
from hovi.optimize.kkt_model import ConstraintRows
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

_new_points = without_checks(Points)  # called at each step


@dataclass(frozen=True, eq=False)
class NodeEquations:
    """c = y(q, v, t) - value at one or more nodes of a grid.

    intervals: that contain the nodes, (B,). columns: of (q, h v) there.
    """

    given: Sequence[Equation]
    grid: Grid
    intervals: npt.NDArray[np.intp]
    columns: slice

    @classmethod
    def of(cls, equations: Sequence[Equation], grid: Grid) -> list[NodeEquations]:
        """Those of consecutive equations with the same function and value, at other nodes."""

        def alike(each: Equation) -> tuple[int, int, bool]:
            return id(each.y), id(each.on), each.where.node == grid.intervals

        found = []
        for (_, _, last), group in itertools.groupby(equations, alike):
            given = list(group)
            nodes = np.array([each.where.node for each in given])
            first = grid.order if last else 0
            columns = slice(first, first + 2)
            found.append(cls(given, grid, nodes - last, columns))
        return found

    @property
    def size(self) -> int:
        """Number of equations."""
        return len(self.given) * self.given[0].y.size

    def residual(self, x: DiscretePath) -> Array:
        """c, flat."""
        y = self.given[0].y.values(self._states(x))
        return np.asarray(self.given[0].on.missed(y).ravel())

    def rows(self, x: DiscretePath) -> ConstraintRows:
        """Their derivatives in nodal columns."""
        y, at, scale = self.given[0].y, self._states(x), self._scale
        n = at.v.shape[1]
        slopes = np.zeros((len(self.given), y.size, self.columns.stop, n))
        for name, J in y.slopes(at).items():
            i = STATE.index(name)
            slopes[:, :, self.columns.start + i] = J * scale[:, i, None, None]
        return ConstraintRows(self.intervals, slopes)

    def add_curvature(self, x: DiscretePath, multipliers: Array, hessian: Array) -> None:
        """Add sum multipliers d2c to Hessians of the intervals, (N, m, m, n, n), in place."""
        y, at, scale = self.given[0].y, self._states(x), self._scale
        first = self.columns.start
        for (one, other), block in y.curvature(at, multipliers.reshape(-1, y.size)).items():
            i, j = STATE.index(one), STATE.index(other)
            scaled = block * (scale[:, i] * scale[:, j])[:, None, None]
            hessian[self.intervals, first + i, first + j] += scaled
            if i != j:
                hessian[self.intervals, first + j, first + i] += scaled.transpose(0, 2, 1)

    @cached_property
    def _scale(self) -> Array:
        """Of q and v in the columns (q, h v), (B, 2)."""
        steps = self.grid.steps[self.intervals]
        return np.stack([np.ones_like(steps), 1.0 / steps], axis=1)

    @cached_property
    def _nodes(self) -> npt.NDArray[np.intp]:
        return np.array([each.where.node for each in self.given])

    @cached_property
    def _times(self) -> Array:
        return np.array([each.where.time for each in self.given])

    def _states(self, x: DiscretePath) -> Points:
        return _new_points(x.q[self._nodes], x.v[self._nodes], self._times)
