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

from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.discrete.contraction import Expansion
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.interval_batch import IntervalBatch
from hovi.discrete.interval_charts import IntervalCharts
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class TorqueMoments:
    """The moments of passive torques over the intervals of a grid.

    batches: those of each batch of intervals. passive: indices in v of the passive joints.
    """

    batches: list[_BatchMoments]
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
        return cls([_BatchMoments(batch) for batch in ld.interval_batches], passive)

    def scaled(self, torques: Array, batch: int) -> Array:
        """sqrt(h) m_j of the intervals of a batch, flat: their squares are those of `squares`."""
        moments = self.batches[batch]
        return np.asarray(moments.of(torques[:, self.passive]) * moments.root_steps).ravel()

    def scaled_slopes(self, expansion: Expansion, batch: int) -> Array:
        """Slopes of `scaled` in the nodal columns of the intervals, shape (B, K p, m, n)."""
        moments, (_, J) = self.batches[batch], expansion.outputs[batch]
        if expansion.charts is None:
            slopes = moments.slopes(J[:, self.passive])
        else:
            charts = expansion.charts[batch]
            assert isinstance(charts, IntervalCharts)  # torques have Lagrangians of order 2
            slopes = moments.slopes_in_charts(J[:, self.passive], charts)
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

    def squares(self, torques: Array, batch: int) -> float:
        """sum h_k m_j^2 over the intervals of a batch and the passive joints; torques as above."""
        moments = self.batches[batch]
        squares = np.sum(moments.of(torques[:, self.passive]) ** 2, axis=(1, 2))
        return float(moments.batch.h @ squares)

    def add_squares(self, expansion: Expansion, weight: float) -> None:
        """Add weight h_k dm_j dm_j to the Hessian of every interval, in place.

        With the force weight sum_j m_j P_j at the points it makes the expansion that of
        weight/2 sum h_k m_j^2.
        expansion: in nodal columns.
        """
        for i, (moments, (_, J)) in enumerate(zip(self.batches, expansion.outputs, strict=True)):
            jacobian = J[:, self.passive]
            if expansion.charts is None:
                slopes = moments.slopes(jacobian)
            else:
                charts = expansion.charts[i]
                assert isinstance(charts, IntervalCharts)  # torques have Lagrangians of order 2
                slopes = moments.slopes_in_charts(jacobian, charts)
            B, rows, m, n = slopes.shape
            flat = slopes.reshape(B, rows, m * n)
            scaled = flat.transpose(0, 2, 1) * (weight / moments.batch.h[:, None, None])
            blocks = np.matmul(scaled, flat).reshape(B, m, n, m, n)
            expansion.hessian[moments.batch.index, :m, :m] += blocks.transpose(0, 1, 3, 2, 4)


@dataclass(frozen=True, eq=False)
class _BatchMoments:
    """Moments over B intervals of one scheme with Q points, against K test functions."""

    batch: IntervalBatch

    @cached_property
    def tests(self) -> Array:
        """P_j at the points, (K, Q); one per point where a torque vanishes at every point."""
        scheme = self.batch.scheme
        return np.diag(scheme.weights**-0.5) if scheme.moments is None else scheme.moments

    @cached_property
    def root_steps(self) -> Array:
        """sqrt(h), shape (B, 1, 1)."""
        return np.sqrt(self.batch.h)[:, None, None]

    @cached_property
    def _weighted(self) -> Array:
        """w_q P_j at the points, (K, Q)."""
        return self.tests * self.batch.scheme.weights

    @cached_property
    def _columns(self) -> Array:
        """P_j times the R = k + 1 rows of the table at each point, (K m, R Q)."""
        products = np.einsum("kq,qdm->kmqd", self.tests, self.batch.scheme.nodal_table)
        return np.asarray(products.reshape(-1, products.shape[2] * products.shape[3]))

    def of(self, torques: Array) -> Array:
        """m_j, shape (B, K, p), of torques at the points, shape (P, p)."""
        points = torques.reshape(-1, self.tests.shape[1], torques.shape[1])
        return np.asarray(np.matmul(self._weighted, points))

    def slopes(self, jacobian: Array) -> Array:
        """h dm_j in the nodal columns of the intervals, shape (B, K p, m, n).

        jacobian: of the torques in (q, v, ...) at the points, shape (P, p, R n).
        """
        (K, Q), B, p = self.tests.shape, len(self.batch.h), jacobian.shape[1]
        R = self.batch.scheme.nodal_table.shape[1]
        by_row = jacobian.reshape(B, Q, p, R, -1).transpose(0, 1, 3, 2, 4)
        by_row = by_row * self.batch.row_weights[..., None, None]
        slopes = np.matmul(self._columns, by_row.reshape(B, R * Q, -1))
        slopes = slopes.reshape(B, K, -1, p, by_row.shape[-1]).transpose(0, 1, 3, 2, 4)
        return np.asarray(slopes.reshape(B, K * p, *slopes.shape[3:]))

    def slopes_in_charts(self, jacobian: Array, charts: IntervalCharts) -> Array:
        """As `slopes`, by the chain rule of the charts."""
        slopes = charts.nodal_moments(self.tests, jacobian)
        return slopes.reshape(len(slopes), -1, *slopes.shape[3:])
