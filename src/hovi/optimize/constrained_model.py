"""The quadratic model of a Lagrangian f + y.c with linearised constraints c, as band matrices.

The constraints of an interval contain its own columns alone, so that A^T A of their Jacobian A is a
band matrix like the Hessian H, and K = H + penalty A^T A + shift D has a banded Cholesky factor.
For a penalty large enough K is positive definite exactly where H + shift D is so on the tangent
space A s = 0. The KKT equations are solved with that factor. [NocedalWright2006, section 16.2]
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from hovi._native import band as native
from hovi.optimize.banded_model import BandFactor, BandLayout, BandModel
from hovi.optimize.ended import Outputs
from hovi.optimize.quadratic_model import Factor, IntervalSum
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
X = TypeVar("X")

MULTIPLIER_DAMPING = 1e-6
"""Damping of least-squares multipliers, relative to A^T A."""
MAX_CORRECTIONS = 15
"""Maximum number of conjugate-gradient steps on the multipliers."""


@dataclass(frozen=True, eq=False)
class ConstraintRows:
    """Jacobian of E constraints of each of B intervals, in their first columns.

    index: of the intervals. slopes: shape (B, E, m, n).
    """

    index: Index | slice
    slopes: Array

    @cached_property
    def flat(self) -> Array:
        """The slopes with one column per component, shape (B, E, m n)."""
        return self.slopes.reshape(*self.slopes.shape[:2], -1)

    def weighted(self, y: Array) -> Array:
        """A^T y in the columns of the intervals, shape (B, m, n)."""
        B, E, m, n = self.slopes.shape
        return np.asarray(np.matmul(y.reshape(B, 1, E), self.flat).reshape(B, m, n))

    @property
    def size(self) -> int:
        """B E."""
        intervals, rows = self.slopes.shape[:2]
        return int(intervals * rows)


class ConstrainedModel:
    """The gradient of f, the Hessian H of f + y.c, the Jacobian A of c, and the metric D.

    slope: gradient of f. gradient: of f + y.c.
    """

    def __init__(
        self,
        intervals: IntervalSum,
        rows: Sequence[ConstraintRows],
        multipliers: Array,
        layout: BandLayout,
        metric_band: Array,
    ) -> None:
        self.rows = rows
        self.plain = BandModel(intervals, layout, metric_band)
        self.metric_band = metric_band
        self.slope = self.plain.gradient
        self.gradient = self.slope + self.transposed_product(multipliers)
        self.hessian_band = layout.assemble(intervals.hessian)
        self._penalized = 0.0, self.hessian_band

    @cached_property
    def normal_band(self) -> Array:
        """A^T A."""
        return self.plain.layout.assemble_flat(self._normal_intervals)

    @cached_property
    def _normal_intervals(self) -> Array:
        """A^T A of every interval, shape (N, m, n, m, n)."""
        N, m, n = self.plain.intervals.gradient.shape
        squares = [np.matmul(each.flat.transpose(0, 2, 1), each.flat) for each in self.rows]
        if len(squares) == 1 and squares[0].shape[:2] == (N, m * n):
            return np.asarray(squares[0].reshape(N, m, n, m, n))
        sums = np.zeros((N, m * n, m * n))
        for each, square in zip(self.rows, squares, strict=True):
            own = square.shape[1]
            sums[each.index, :own, :own] += square
        return sums.reshape(N, m, n, m, n)

    @cached_property
    def normal_scale(self) -> float:
        """Magnitude of A^T A relative to D."""
        return self._relative_to_metric(self.normal_band)

    @cached_property
    def curvature_scale(self) -> float:
        """Magnitude of H relative to D."""
        return self._relative_to_metric(self.hessian_band)

    def _relative_to_metric(self, band: Array) -> float:
        """The largest entry of a band relative to that of D; 0 without unknowns."""
        if not band.size:
            return 0.0
        return float(np.max(np.abs(band)) / np.max(np.abs(self.metric_band)))

    def factor(self, penalty: float, shift: float) -> Factor | None:
        """Banded Cholesky of H + penalty A^T A + shift D; None where it fails."""
        if penalty != self._penalized[0]:
            self._penalized = penalty, self.hessian_band + penalty * self.normal_band
        return self._factored(self._penalized[1], shift)

    def normal_factor(self, damping: float) -> Factor | None:
        """Banded Cholesky of A^T A + damping D."""
        return self._factored(self.normal_band, damping)

    def _factored(self, band: Array, shift: float) -> Factor | None:
        layout = self.plain.layout
        factor = np.empty_like(band)
        definite = native.factor(band, self.metric_band, shift, layout.rows, layout.size, factor)
        return BandFactor(factor, layout.rows) if definite else None

    def jacobian_product(self, s: Array) -> Array:
        """A s."""
        columns = self.plain.gather(s)
        parts = []
        for rows in self.rows:
            own = columns[rows.index, : rows.slopes.shape[2]]
            parts.append(np.matmul(rows.flat, own.reshape(len(own), -1, 1)).ravel())
        return np.concatenate(parts)

    def transposed_product(self, y: Array) -> Array:
        """A^T y."""
        columns = np.zeros(self.plain.intervals.gradient.shape)
        first = 0
        for rows in self.rows:
            last = first + rows.size
            columns[rows.index, : rows.slopes.shape[2]] += rows.weighted(y[first:last])
            first = last
        return self.plain.scatter(columns)

    def hessian_product(self, s: Array) -> Array:
        """H s."""
        product = np.empty(s.shape)
        rows = self.plain.layout.rows
        native.product(self.hessian_band, rows, np.ascontiguousarray(s), product)
        return product

    def length(self, s: Array) -> float:
        """|s| in the metric."""
        return float(np.sqrt(max(float(np.vdot(s, self.plain.metric_product(s))), 0.0)))

    def negative_eigenvalues(self, penalty: float) -> int:
        """Number of negative eigenvalues of H + penalty A^T A."""
        own = self.plain.intervals
        normal = self._normal_intervals.transpose(0, 1, 3, 2, 4)
        hessian = np.ascontiguousarray(own.hessian + penalty * normal)
        sums = IntervalSum(own.gradient, hessian, own.metric)
        return BandModel(sums, self.plain.layout, self.metric_band).negative_eigenvalues()

    def least_squares_multipliers(self) -> Array:
        """The change of y that makes the gradient smallest, in the norm of D^-1."""
        factor = self.normal_factor(MULTIPLIER_DAMPING * self.normal_scale)
        if factor is None:
            return np.zeros(sum(rows.size for rows in self.rows))
        return self.jacobian_product(factor.solve(-self.gradient))

    def solve(
        self, factor: Factor, penalty: float, residual: Array, accuracy: float
    ) -> tuple[Array, Array]:
        """(s, z) of (H + shift D) s + A^T z = -gradient, A s = -residual.

        Conjugate gradients on A K^-1 A^T, whose eigenvalues are nearly 1 / penalty.
        factor: of H + penalty A^T A + shift D. accuracy: of A s, relative to the residual.
        """
        s = factor.solve(-self.gradient - penalty * self.transposed_product(residual))
        z = np.zeros_like(residual)
        r = residual + self.jacobian_product(s)
        p, square = r, float(r @ r)
        goal = accuracy**2 * max(float(residual @ residual), 1e-32)
        for _ in range(MAX_CORRECTIONS):
            if not square > goal:
                break
            u = factor.solve(self.transposed_product(p))
            Au = self.jacobian_product(u)
            curvature = float(p @ Au)
            if not 0.0 < curvature < np.inf:  # rows that depend on each other
                break
            fraction = square / curvature
            s, z, r = s - fraction * u, z + fraction * p, r - fraction * Au
            before, square = square, float(r @ r)
            p = r + (square / before) * p
        return s, z + penalty * r


def size_of(c: Array) -> float:
    """|c|; infinite where it is not finite or too large to be squared."""
    with np.errstate(over="ignore", invalid="ignore"):
        square = float(np.dot(c, c))
    return math.sqrt(square) if math.isfinite(square) else math.inf


class EqualityObjective(ABC, Generic[X]):
    """An objective f under equations c = 0, on a manifold."""

    penalty: float = 1.0
    """First weight of A^T A, which is to exceed the negative curvature across c = 0."""

    @abstractmethod
    def evaluate(self, x: X) -> Outputs:
        """f and c at x; not finite where they are not defined."""

    @abstractmethod
    def feasible(self, x: X) -> bool:
        """Whether c = 0 holds at x to its tolerances."""

    @abstractmethod
    def model(self, x: X, multipliers: Array) -> ConstrainedModel:
        """The second-order model of f + y.c at x."""

    @abstractmethod
    def retract(self, x: X, step: Array, model: ConstrainedModel) -> X:
        """The point that a step of a model leads to."""
