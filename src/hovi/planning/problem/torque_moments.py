"""Torques of passive joints as moments over intervals, for tables with more points than modes.

A curve with r inner modes has r + 2 coefficients per interval and joint. With more quadrature
points than that, zero torque at each of them would lock the motion. Instead r + 2 moments vanish,

    m_j = integral of P_j(s) tau(s) ds over [0, 1], j = 0 .. r + 1,

by the table's own quadrature, with orthonormal shifted Legendre polynomials P_j. What acts on the
motion is the projected torque sum_j m_j P_j(s): at the points its multipliers are a polynomial
lambda(s), and its square is a sum of squares of moments, which couples the points of an interval.
With r + 2 points the moments vanish exactly where the torque vanishes at every point.
"""

from __future__ import annotations

from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.discrete.contraction import Expansion
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.interval_batch import IntervalBatch
from hovi.planning.problem.interval_moments import IntervalMoments
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class TorqueMoments:
    """The moments of passive torques over the intervals of a grid.

    batches: those of each batch of intervals. passive: indices in v of the passive joints.
    """

    batches: list[IntervalMoments]
    passive: Index

    @classmethod
    def of(cls, ld: DiscreteLagrangian, passive: Index) -> Self | None:
        """The moments; None where passive torques vanish at all points of every interval."""
        if len(passive) == 0 or all(scheme.moments is None for scheme, _ in ld.grid.groups):
            return None
        return cls.everywhere(ld, passive)

    @classmethod
    def everywhere(cls, ld: DiscreteLagrangian, passive: Index) -> Self:
        """As `of`, and where passive torques vanish at all points one moment for each of these."""
        return cls([_moments(batch) for batch in ld.interval_batches], passive)

    def scaled(self, torques: Array, batch: int) -> Array:
        """sqrt(h) m_j of the intervals of a batch, flat."""
        moments = self.batches[batch]
        return np.asarray(moments.of(torques[:, self.passive]) * moments.root_steps).ravel()

    def scaled_slopes(self, expansion: Expansion, batch: int) -> Array:
        """Slopes of `scaled` in the nodal columns of the intervals, shape (B, K p, m, n)."""
        moments, (_, J) = self.batches[batch], expansion.outputs[batch]
        slopes = moments.slopes(J[:, self.passive], expansion.charts_of(batch))
        return np.asarray(slopes / moments.root_steps[..., None])

    def spread(self, multipliers: Array, batch: int) -> Array:
        """Multipliers of `scaled` as lambda at the points, shape (P, passive)."""
        moments = self.batches[batch]
        K = len(moments.tests)
        weights = multipliers.reshape(-1, K, len(self.passive)) / moments.root_steps
        return np.asarray(np.matmul(moments.tests.T, weights).reshape(-1, len(self.passive)))

    def size(self, batch: int) -> int:
        """Number of moments of a batch."""
        moments = self.batches[batch]
        return len(moments.batch.h) * len(moments.tests) * len(self.passive)

    def projected(self, torques: Array, batch: int) -> Array:
        """sum_j m_j P_j of the passive joints at the points of a batch, shape (P, passive).

        torques: of all joints at the points, shape (P, nv).
        """
        moments = self.batches[batch]
        projected = np.matmul(moments.tests.T, moments.of(torques[:, self.passive]))
        return np.asarray(projected.reshape(len(torques), -1))


def _moments(batch: IntervalBatch) -> IntervalMoments:
    """Against P_0 .. P_(r+1), or one for each point where a torque vanishes at every point."""
    scheme = batch.scheme
    tests = np.diag(scheme.weights**-0.5) if scheme.moments is None else scheme.moments
    return IntervalMoments(batch, tests)
