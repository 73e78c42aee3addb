"""Moments of functions of a motion over the intervals of a grid."""

from __future__ import annotations

from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.discrete.interval_batch import IntervalBatch
from hovi.discrete.interval_charts import Charts, IntervalCharts
from hovi.schemes.polynomials import orthonormal_legendre
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class IntervalMoments:
    """m_j = integral of P_j(s) y(s) ds over [0, 1], by the quadrature of a scheme with Q points.

    Of B intervals, against K test functions P_j.

    tests: P_j at the points, (K, Q).
    """

    batch: IntervalBatch
    tests: Array

    @classmethod
    def legendre(cls, batch: IntervalBatch, count: int) -> Self:
        """Against the first orthonormal shifted Legendre polynomials; count: at least 1."""
        return cls(batch, orthonormal_legendre(batch.scheme.points, count))

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

    def of(self, values: Array) -> Array:
        """m_j, shape (B, K, p), of values at the points, shape (P, p)."""
        points = values.reshape(-1, self.tests.shape[1], values.shape[1])
        return np.asarray(np.matmul(self._weighted, points))

    def slopes(self, jacobian: Array, charts: Charts | None = None) -> Array:
        """h dm_j in the nodal columns of the intervals, shape (B, K p, m, n).

        jacobian: of the values in (q, v, ...) at the points, shape (P, p, R n). charts: of the
        intervals; None if they are the identity.
        """
        if charts is not None:
            assert isinstance(charts, IntervalCharts)  # equations have Lagrangians of order 2
            slopes = charts.nodal_moments(self.tests, jacobian)
            return slopes.reshape(len(slopes), -1, *slopes.shape[3:])
        (K, Q), B, p = self.tests.shape, len(self.batch.h), jacobian.shape[1]
        R = self.batch.scheme.nodal_table.shape[1]
        by_row = jacobian.reshape(B, Q, p, R, -1).transpose(0, 1, 3, 2, 4)
        by_row = by_row * self.batch.row_weights[..., None, None]
        slopes = np.matmul(self._columns, by_row.reshape(B, R * Q, -1))
        slopes = slopes.reshape(B, K, -1, p, by_row.shape[-1]).transpose(0, 1, 3, 2, 4)
        return np.asarray(slopes.reshape(B, K * p, *slopes.shape[3:]))
