"""The quadratic model of a Lagrangian f + y.c under linearised equations c, as one band matrix.

The equations of an interval contain its own columns alone. Their multipliers follow its last
unknown in the order of elimination, so that the KKT matrix

    [H + shift D, A^T; A, -delta I]

is a band matrix like H. It is factored as L S L^T with signs S, without pivoting: H + shift D is
positive definite on the tangent space A s = 0 exactly where as many signs are negative as there are
equations. A small delta makes equations harmless that depend on each other; refinement removes it
from the solutions. H alone may be singular, as that of a linear system is whose passive joints the
cost leaves out: H + rho A^T A, the same on the tangent space, then keeps the factor accurate.
[NocedalWright2006, section 16.2; Vanderbei1995]
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi._native import band as native
from hovi.optimize.banded_model import PANEL, BandLayout, BandModel, Runs, panel_rows
from hovi.optimize.quadratic_model import IntervalSum
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

DELTA = 1e-8
"""delta, relative to |A|^2 / |H|, where |A| is that of a family of equations."""
SMALLER_DELTA = 1e-2
"""Second delta with which negative eigenvalues are counted, relative to the first one."""


@dataclass(frozen=True, eq=False)
class ConstraintRows:
    """Jacobian of E constraints of each of B intervals, in their first columns.

    index: of the intervals. slopes: shape (B, E, m, n). families: of the constraints of an
        interval, shape (E,): those of one number are of one size, in all rows of a model.
    """

    index: Index | slice
    slopes: Array
    families: Index | None = None

    @classmethod
    def none(cls, m: int, n: int) -> Self:
        """No constraints of intervals with m columns of n components."""
        return cls(np.zeros(0, np.intp), np.zeros((0, 1, m, n)))

    @cached_property
    def flat(self) -> Array:
        """The slopes with one column per component, shape (B, E, m n)."""
        intervals, rows, m, n = self.slopes.shape
        return self.slopes.reshape(intervals, rows, m * n)

    def weighted(self, y: Array) -> Array:
        """A^T y in the columns of the intervals, shape (B, m, n)."""
        B, E, m, n = self.slopes.shape
        return np.asarray(np.matmul(y.reshape(B, 1, E), self.flat).reshape(B, m, n))

    @property
    def size(self) -> int:
        """B E."""
        intervals, rows = self.slopes.shape[:2]
        return int(intervals * rows)


@dataclass(frozen=True, eq=False)
class KktLayout:
    """Where unknowns and multipliers are in the KKT matrix.

    plain: of H. profile: number of rows of every panel of the band, as BandLayout has them.
    unknowns, multipliers: their numbers in the matrix.
    hessian, slopes: which entries of the intervals' Hessians and of every ConstraintRows enter the
    band, and where.
    """

    plain: BandLayout
    profile: Index
    unknowns: Index
    multipliers: Index
    hessian: Runs
    slopes: list[Runs]

    @classmethod
    def of(cls, plain: BandLayout, rows: Sequence[ConstraintRows]) -> Self:
        """The layout for equations of the intervals that some rows have."""
        N, _, n = plain.unknowns.shape
        flat = plain.unknowns.reshape(N, -1)
        index = [np.repeat(np.arange(N)[x.index], x.slopes.shape[1]) for x in rows]
        # every unknown, and after it the equations whose last unknown it is
        last = flat.max(axis=1)[np.concatenate(index)]
        keys = np.concatenate([2 * np.arange(plain.size), 2 * last + 1])
        numbers = np.empty(len(keys), dtype=np.intp)
        numbers[np.argsort(keys, kind="stable")] = np.arange(len(keys))
        unknowns, multipliers = numbers[: plain.size], numbers[plain.size :]
        moved = np.append(unknowns, -1)[flat]
        ends = np.cumsum([0, *map(len, index)])
        own = [multipliers[a:b] for a, b in itertools.pairwise(ends)]
        profile = _profile(moved, index, own, len(keys))
        stride = int(profile.max())
        entries, positions, scales = plain.runs.unrolled()
        j, i = np.divmod(positions, plain.shape[1])
        i += j - j % PANEL
        hessian = Runs.of(entries, _position(unknowns[i], unknowns[j], stride), scales)
        slopes = []
        for each, at, intervals in zip(rows, own, index, strict=True):
            columns = moved[intervals, : each.flat.shape[2]]
            free = columns >= 0
            scale = None
            if plain.scales is not None:
                scale = np.repeat(plain.scales, n, axis=1)[intervals, : columns.shape[1]][free]
            places = _position(np.broadcast_to(at[:, None], columns.shape), columns, stride)[free]
            slopes.append(Runs.of(np.flatnonzero(free), places, scale))
        return cls(plain, profile, unknowns, multipliers, hessian, slopes)

    @property
    def size(self) -> int:
        """Number of unknowns and multipliers."""
        return len(self.unknowns) + len(self.multipliers)

    @property
    def shape(self) -> tuple[int, int]:
        """Of the band."""
        return PANEL * len(self.profile), int(self.profile.max())

    def matrix(self, hessian: Array | None, rows: Sequence[ConstraintRows]) -> Array:
        """The band of [H, A^T; A, 0]; hessian: of the intervals, (N, m, m, n, n), 0 for None."""
        band = np.zeros(self.shape) if hessian is None else self._band(hessian, self.hessian)
        for each, runs in zip(rows, self.slopes, strict=True):
            band += self._band(each.slopes[..., None], runs)
        return band

    def _band(self, numbers: Array, runs: Runs) -> Array:
        band = np.empty(self.shape)
        numbers = np.ascontiguousarray(numbers)
        native.assemble(numbers, runs.starts, runs.positions, runs.lengths, runs.scales, band)
        return band

    def extended(self, band: Array) -> Array:
        """A band of the unknowns as one of the matrix, zero for multipliers."""
        wide, columns = np.zeros(self.shape), np.arange(self.plain.size)
        i = (columns - columns % PANEL)[:, None] + np.arange(band.shape[1])
        inside = (i >= columns[:, None]) & (i < self.plain.size)
        j = np.broadcast_to(columns[:, None], i.shape)[inside]
        numbers = band[: len(columns)][inside]
        some = numbers != 0.0
        i, j = self.unknowns[i[inside][some]], self.unknowns[j[some]]
        wide.ravel()[_position(i, j, self.shape[1])] = numbers[some]
        return wide

    @cached_property
    def corners(self) -> Index:
        """Places of the multipliers' diagonal entries in the band, flat."""
        return _position(self.multipliers, self.multipliers, self.shape[1])


def _position(i: Index, j: Index, stride: int) -> Index:
    """Place of entry (i, j), i >= j, in a band: see BandLayout.assemble."""
    return np.asarray(j * stride + i - (j - j % PANEL))


def _profile(moved: Index, index: list[Index], own: list[Index], size: int) -> Index:
    """Number of rows of every panel of the KKT matrix: see BandLayout.

    moved: numbers of the unknowns of every interval, (N, m n), -1 where fixed. index, own: interval
    and number of every equation.
    """
    count = np.bincount(np.concatenate(index), minlength=len(moved))
    columns = np.full((len(moved), moved.shape[1] + int(count.max(initial=0))), -1)
    columns[:, : moved.shape[1]] = moved
    intervals, numbers = np.concatenate(index), np.concatenate(own)
    order = np.argsort(intervals, kind="stable")
    first = np.cumsum(count) - count
    place = np.arange(len(order)) - first[intervals[order]]
    columns[intervals[order], moved.shape[1] + place] = numbers[order]
    return panel_rows(columns, size)


class KktFactor:
    """L S L^T of [H + shift D, A^T; A, -delta I].

    negative: number of negative signs; -1 where there is no factor. delta: what refinement removes,
    by equation; None where delta belongs to the system to solve. rho: of A^T diag(rho) A in the
    matrix, which changes the multipliers alone.
    """

    def __init__(
        self,
        layout: KktLayout,
        matrix: Array,
        metric: Array,
        shift: float,
        delta: Array | None,
        rho: Array | float,
    ) -> None:
        self.layout, self.matrix, self.metric, self.shift = layout, matrix, metric, shift
        self.delta, self.rho = delta, rho
        self.factor, self.signs = np.empty_like(matrix), np.ones(len(matrix))
        out = layout.profile, layout.size, self.signs, self.factor
        self.negative: int = native.factor_signed(matrix, metric, shift, *out)

    def solve(self, force: Array, target: Array) -> tuple[Array, Array]:
        """(s, z) of (H + shift D) s + A^T z = force, A s = target.

        One refinement removes delta, down to rounding errors.
        """
        at = self.layout
        rhs = np.empty(at.size)
        rhs[at.unknowns], rhs[at.multipliers] = force, target
        x = self._solved(rhs)
        if self.delta is not None:
            x = x + self._solved(rhs - self._product(x))
        return x[at.unknowns], x[at.multipliers] + self.rho * target

    def _solved(self, rhs: Array) -> Array:
        x = np.empty_like(rhs)
        native.solve(self.factor, self.layout.profile, rhs, x, signs=self.signs)
        return x

    def _product(self, x: Array) -> Array:
        """The product with the matrix for delta = 0."""
        assert self.delta is not None
        product, shifted = np.empty_like(x), np.empty_like(x)
        rows, at = self.layout.profile, self.layout.multipliers
        native.product(self.matrix, rows, x, product)
        product[at] += self.delta * x[at]
        if self.shift:
            native.product(self.metric, rows, x, shifted)
            product += self.shift * shifted
        return product


class KktModel:
    """The gradient and the Hessian H of f + y.c, the Jacobian A of c, and the metric D.

    metric: D as `KktLayout.extended` has it.
    """

    def __init__(
        self,
        intervals: IntervalSum,
        rows: Sequence[ConstraintRows],
        layout: KktLayout,
        metric_band: Array,
        metric: Array,
    ) -> None:
        self.rows, self.layout, self.metric = rows, layout, metric
        self.plain = BandModel(intervals, layout.plain, metric_band)
        self.gradient = self.plain.gradient

    @property
    def equations(self) -> int:
        """Number of equations."""
        return len(self.layout.multipliers)

    @cached_property
    def _matrix(self) -> Array:
        return self.layout.matrix(self.plain.intervals.hessian, self.rows)

    @cached_property
    def _regular(self) -> Array:
        """The matrix with H + A^T diag(rho) A in place of H."""
        hessian, first = self.plain.intervals.hessian.copy(), 0
        for each in self.rows:
            B, E, m, n = each.slopes.shape
            scale = self._scale[first : first + each.size].reshape(B, E, 1)
            first += each.size
            product = np.matmul(each.flat.transpose(0, 2, 1), each.flat / scale)
            blocks = product.reshape(B, m, n, m, n).transpose(0, 1, 3, 2, 4)
            hessian[each.index, :m, :m] += blocks
        return self.layout.matrix(hessian, self.rows)

    @property
    def curvature_scale(self) -> float:
        """Magnitude of H relative to D."""
        return self.plain.curvature_scale()

    @cached_property
    def largest_slope(self) -> float:
        """The largest entry of A."""
        return max(float(np.max(np.abs(each.slopes), initial=0.0)) for each in self.rows)

    @cached_property
    def _scale(self) -> Array:
        """|A|^2 / |H| of the family of every equation, which is 1 / rho, shape (E,)."""
        families, sizes = [], []
        for each in self.rows:
            B, E = each.slopes.shape[:2]
            own = np.zeros(E, np.intp) if each.families is None else each.families
            families.append(np.tile(own, B))
            sizes.append(np.abs(each.flat).max(axis=2, initial=0.0).ravel())
        known = np.concatenate(families)
        largest = np.zeros(int(known.max(initial=0)) + 1)
        np.maximum.at(largest, known, np.concatenate(sizes))
        curvature = float(np.max(np.abs(self.plain.intervals.hessian), initial=0.0))
        scale = largest**2 / curvature if curvature > 0.0 else np.zeros_like(largest)
        return np.where(scale > 0.0, scale, 1.0)[known]

    def factor(self, shift: float, delta: float | None = None) -> KktFactor | None:
        """The factor; None where H + shift D is not positive definite on A s = 0.

        delta: as a part of the system to solve; a small one, which refinement removes, if None.
        """
        factor = (
            self.exact_factor(shift)
            if delta is None
            else self._factored(self._matrix, shift, delta)
        )
        return factor if factor.negative == self.equations else None

    def normal_factor(self, damping: float) -> KktFactor:
        """The factor with damping D in place of H."""
        small = DELTA * self._scale
        return self._factored(self.layout.matrix(None, self.rows), damping, small, small)

    def exact_factor(self, shift: float = 0.0, delta: float = DELTA) -> KktFactor:
        """The factor of any inertia; refinement removes delta |A|^2 / |H| from its solutions."""
        small = delta * self._scale
        return self._factored(self._regular, shift, small, small, 1.0 / self._scale)

    def _factored(
        self,
        band: Array,
        shift: float,
        delta: Array | float,
        removed: Array | None = None,
        rho: Array | float = 0.0,
    ) -> KktFactor:
        matrix = band.copy()
        matrix.ravel()[self.layout.corners] = -delta
        return KktFactor(self.layout, matrix, self.metric, shift, removed, rho)

    def negative_eigenvalues(self, border: tuple[Array, Array] | None = None) -> int:
        """Number of negative eigenvalues of H on the tangent space A s = 0; -1 if undecided.

        Those of the KKT matrix less the number of equations: see [Gould1985]. Two values of delta
        have to agree.
        border: further columns B of H, (size, p), and their corner C, of unknowns that are in no
            equation.
        """
        factors = [self.exact_factor(0.0, d * DELTA) for d in (1.0, SMALLER_DELTA)]
        counts = {factor.negative + _negative_pivots(factor, border) for factor in factors}
        return -1 if len(counts) > 1 else max(counts.pop() - self.equations, -1)

    def jacobian_product(self, s: Array) -> Array:
        """A s."""
        return self.pushed_columns(self.plain.gather(s))

    def pushed_columns(self, columns: Array) -> Array:
        """A s for a step in the columns of the intervals, (N, m, n)."""
        parts = []
        for rows in self.rows:
            own = columns[rows.index, : rows.slopes.shape[2]]
            parts.append(np.matmul(rows.flat, own.reshape(*rows.flat.shape[::2], 1)).ravel())
        return np.concatenate(parts)

    def pulled_columns(self, y: Array) -> Array:
        """A^T y in the columns of the intervals, (N, m, n)."""
        columns = np.zeros(self.plain.intervals.gradient.shape)
        first = 0
        for rows in self.rows:
            last = first + rows.size
            columns[rows.index, : rows.slopes.shape[2]] += rows.weighted(y[first:last])
            first = last
        return columns

    def curvature(self, s: Array) -> float:
        """s.H s."""
        return self.plain.curvature(s)

    def least_squares_multipliers(self) -> Array:
        """The change of y that makes the gradient smallest, in the norm of D^-1."""
        return self.normal_factor(1.0).solve(-self.gradient, np.zeros(self.equations))[1]


def _negative_pivots(factor: KktFactor, border: tuple[Array, Array] | None) -> int:
    """Negative eigenvalues of the pivot C - B^T H^-1 B of a border: Haynsworth's additivity.

    H^-1 B under the equations.
    """
    if border is None or factor.negative < 0:
        return 0
    columns, corner = border
    none = np.zeros(len(factor.layout.multipliers))
    solved = np.stack([factor.solve(b, none)[0] for b in columns.T], axis=1)
    return int(np.sum(np.linalg.eigvalsh(corner - columns.T @ solved) < 0))


def size_of(c: Array) -> float:
    """|c|; infinite where it is not finite or too large to be squared."""
    with np.errstate(over="ignore", invalid="ignore"):
        square = float(np.dot(c, c))
    return math.sqrt(square) if math.isfinite(square) else math.inf
