"""Equations along a motion in its intervals: moments of their values.

For a function y of level l, r + l moments of an interval with r inner modes,

    m_j = h^l integral of P_j(s) (y(s) - value) ds over [0, 1], j = 0 .. r + l - 1,

by the quadrature of its table, with orthonormal shifted Legendre polynomials P_j. With the k - l
conditions at every node they are as many as a curve has unknowns.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import without_checks
from hovi.conditions.condition import EquationAlong
from hovi.conditions.function import Points
from hovi.discrete.contraction import Expansion
from hovi.discrete.interval_batch import Jet
from hovi.optimize.kkt_model import ConstraintRows
from hovi.planning.problem.interval_moments import IntervalMoments
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.condition_outputs import add_curvature, jet_slopes

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

_new_points = without_checks(Points)  # called at each step


class _MomentsOf(NamedTuple):
    """The moments of a batch of intervals, by its number, of which some are asked for.

    part: which of the batch. intervals: their numbers in the grid. power: h^l of each.
    """

    batch: int
    moments: IntervalMoments
    part: slice | Index
    intervals: Index | slice
    power: Array

    @property
    def size(self) -> int:
        """Number of moments of one value."""
        return len(self.power) * len(self.moments.tests)


class AlongMoments:
    """The moments of one equation on the grid of a problem, times its factors `size`."""

    def __init__(self, problem: TrajectoryProblem, given: EquationAlong, size: Array) -> None:
        self._given, self._ld, self._size = given, problem.ld, size
        self._last: tuple[Sequence[Jet], dict[int, Array]] | None = None
        self._parts = list[_MomentsOf]()
        holds, level = given.holds_in(problem.grid), given.where.level
        for i, batch in enumerate(problem.ld.interval_batches):
            here = np.flatnonzero(holds[batch.index])
            if batch.modes + level > 0 and len(here) > 0:  # else those at the nodes are all
                whole = len(here) == len(batch.h)
                part = slice(None) if whole else here
                intervals = batch.index if whole else np.arange(len(holds))[batch.index][here]
                moments = IntervalMoments.legendre(batch, batch.modes + level)
                self._parts.append(_MomentsOf(i, moments, part, intervals, batch.h[part] ** level))

    @property
    def size(self) -> int:
        """Number of moments."""
        return self._given.y.size * sum(each.size for each in self._parts)

    def residual(self, jets: Sequence[Jet]) -> Array:
        """m_j, flat. jets: (q, v, a) at the quadrature points, per batch."""
        found = np.zeros(0)
        for i, moments, part, _, power in self._parts:
            missed = self._size * self._given.on.missed(self._given.y.values(self._points(jets, i)))
            found = np.append(found, power[:, None, None] * moments.of(missed)[part])
        return found

    def rows(self, jets: Sequence[Jet], expansion: Expansion) -> list[ConstraintRows]:
        """Their derivatives in nodal columns, per batch. expansion: at the same path."""
        found = []
        for i, moments, part, intervals, power in self._parts:
            own = self._size[:, None] * self._slopes(jets, i)
            slopes = moments.slopes(own, expansion.charts_of(i))
            factors = (power / moments.batch.h[part])[:, None, None, None]
            found.append(ConstraintRows(intervals, slopes[part] * factors))
        return found

    def terms(self, jets: Sequence[Jet], multipliers: Array) -> Iterator[tuple[int, Array, Array]]:
        """A batch, and gradient (P, 3 nv) and curvature (P, 3 nv, 3 nv) in (q, v, a) at its points.

        The action of these terms is sum_j multipliers_j m_j. multipliers: flat, as `residual`.
        """
        first, size = 0, self._given.y.size
        for i, moments, part, _, power in self._parts:
            B, K = len(power), len(moments.tests)
            mu = np.zeros((len(moments.batch.h), K, size))
            own = multipliers[first : first + B * K * size].reshape(B, K, size)
            mu[part] = own * power[:, None, None]
            first += B * K * size
            force = np.matmul(moments.tests.T, mu / moments.batch.h[:, None, None])
            force = force.reshape(-1, size) * self._size
            at, slopes = self._points(jets, i), self._slopes(jets, i)
            curvature = np.zeros((len(at.q), slopes.shape[2], slopes.shape[2]))
            add_curvature(curvature, self._given.y.curvature(at, force), None)
            yield i, np.matmul(force[:, None], slopes)[:, 0], curvature

    def _points(self, jets: Sequence[Jet], batch: int) -> Points:
        q, v, a = jets[batch]
        return _new_points(q, v, self._ld.point_times[batch], a)

    def _slopes(self, jets: Sequence[Jet], batch: int) -> Array:
        """dy / d(q, v, a) at the points, (P, size, 3 nv); cached for the last motion."""
        if self._last is None or self._last[0] is not jets:
            self._last = jets, {}
        known = self._last[1]
        if batch not in known:
            at = self._points(jets, batch)
            known[batch] = jet_slopes(self._given.y.slopes(at), None, self._given.y.size, at)
        return known[batch]
