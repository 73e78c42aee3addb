"""Distances of pairs of shapes at instants of a motion, as rows of an interior point.

Most pairs are far from each other at most times. A pair has rows where it is near: at positions
spread over the interval, and where its distance is least along the motion. While the barrier falls
the motion is looked at, and rows are added where pairs have come near: an exchange method for a
semi-infinite program [HettichKortanek1993].
"""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.instants import InstantBatch, Instants
from hovi.discrete.interval_batch import Coordinates
from hovi.discrete.interval_charts import charts_on
from hovi.planning.clearance.clearance import DISTANCE_SCALE
from hovi.planning.clearance.distances import Distances
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.planning.solver.near.approaches import (
    SPREAD,
    Approaches,
    approaches_along,
    configurations,
    free_ones,
    spread,
    spread_approaches,
)
from hovi.planning.solver.near.expanded_rows import ExpandedRows, RowSums
from hovi.planning.solver.near.recent_paths import RecentPaths
from hovi.scene.lagrangian import PointTerms, over_time

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]

ROUNDED_FRACTION, LEAST_ROUNDING, MOST_ROUNDING = 0.1, 2e-5, 1e-3
"""Size by which the shapes of a row are rounded, as a fraction of what the row is above its bound,
and the least and the largest, in [m]: see Distances.values."""
SHARPENED = 0.5
"""Ratio of such a size to the present one below which it takes its place."""
MOST_INFLATION = 10.0
"""Bound of what a rounded distance is shorter by, relative to the size."""
WEIGHT = 0.1
"""Weight of a row in a barrier, as a fraction of the interval."""
CUTOFF = 1.0, 3.0
"""Excess over the margin, in DISTANCE_SCALE, from which outputs level off, and are constant."""
GUARD = 0.05
"""Distance beyond the least one below which pairs get rows at once, in [m]."""


class ClearanceRows:
    """Rows y >= 0 of pairs at instants: what their distances exceed the least one by.

    y = (phi(d) - least) / DISTANCE_SCALE with the pair's distance d. phi(d) = d for near pairs and
    constant for far ones, with two continuous derivatives: far pairs have no influence, and need no
    derivatives. None at first; `extend` adds some.

    problem: with the grid and the ends. distances: of all pairs. least: lower bound, in [m].
    intervals, positions, pairs, rounding: of each row, shape (E,): its interval, where it is in it,
        from 0 to 1, the number of its pair, and the size by which its shapes are rounded, in [m].
    order: see `stand_behind`.
    fixed: whether rows stay as they are. guard: distance beyond the least one below which `follow`
        adds rows, in [m]. probing, blocked: see `extend`. watchful: whether pairs are followed even
        before there are any rows.
    """

    def __init__(self, problem: TrajectoryProblem, distances: Distances, least: float) -> None:
        self.distances, self.least = distances, least
        self.fixed, self.guard = False, GUARD
        self.probing = self.blocked = self.watchful = False
        self.order: Index = np.zeros(0, dtype=np.intp)
        self._followed: LimitRows | None = None
        self._problem, self._spread = problem, RecentPaths[Array]()
        self.grid, self._spread_batch = problem.grid, spread(problem, SPREAD)
        self._measured, self._normals = RecentPaths[Array](), np.zeros((0, 3))
        none = np.zeros(0, dtype=np.intp)
        self._set(problem, none, np.zeros(0), none, np.zeros(0))

    def copied(self, fixed: bool = False) -> ClearanceRows:
        """The same rows, to be extended on their own, or not at all."""
        rows = copy.copy(self)
        rows.fixed, rows._normals = fixed, self._normals.copy()
        return rows

    def on(self, problem: TrajectoryProblem, behind: LimitRows | None = None) -> ClearanceRows:
        """The same rows of another problem, on as many intervals.

        behind: rows of limits of that problem, if `order` is to be kept; it starts anew if None.
        """
        rows = copy.copy(self)
        rows._followed = behind
        rows._set(problem, self.intervals, self.positions, self.pairs, self.rounding)
        rows._normals = self._normals.copy()
        return rows

    @property
    def size(self) -> int:
        """E, the number of rows."""
        return len(self.pairs)

    @property
    def watched(self) -> bool:
        """Whether steps follow pairs, and are refused where they take one too deep."""
        return self.watchful or self.size > 0

    @property
    def weights(self) -> Array:
        """Weights in a barrier, shape (E,), in [s]."""
        return np.asarray(WEIGHT * self.grid.steps[self.intervals])

    def values(self, path: DiscretePath) -> Array:
        """y of every row, shape (E,)."""
        return saturated(self._excess(path))[0]

    def _excess(self, path: DiscretePath) -> Array:
        """What distances exceed the least one by, shape (E,); those of the last paths are kept."""
        known = self._measured.get(path)
        beyond = np.full(self.size, np.nan) if known is None else known
        unknown = np.isnan(beyond)
        if unknown.any():
            beyond = np.where(unknown, self._measured_excess(path, unknown), beyond)
            self._measured = self._measured.with_entry(path, beyond)
        return beyond

    def _measured_excess(
        self, path: DiscretePath, chosen: Mask, times: Array | None = None
    ) -> Array:
        """What distances exceed the least one by in chosen rows, (E,); NaN in others.

        times: of obstacles at the instants, instead of their own.
        """
        some = self._some if times is None else self._some.always()
        instant, column = self._instant[chosen], self._column[chosen]
        used = np.zeros(len(self._wanted), dtype=bool)
        used[instant] = True
        place = (np.cumsum(used) - 1)[instant]
        wanted = np.zeros((int(place.max()) + 1, self._wanted.shape[1]), dtype=bool)
        wanted[place, column] = True
        t = self._batch.t if times is None else times
        q = some.at(configurations(self._problem, path, self._batch), t)[used]
        sizes = self._sizes[used]
        normals = np.zeros((*wanted.shape, 3))
        normals[place, column] = self._normals[chosen]
        d = some.values(q, self._reach, wanted, sizes, normals)
        self._normals[chosen] = normals[place, column]
        beyond = np.full(self.size, np.nan)
        beyond[chosen] = (d[place, column] - self.least) / DISTANCE_SCALE
        return beyond

    def expanded(self, path: DiscretePath, force: Array, coordinates: Coordinates) -> ExpandedRows:
        """The rows with their derivatives. force: weights of their curvature, shape (E,)."""
        weights = np.zeros(self._wanted.shape)
        q, sums = self._configurations(path), self._sums
        _, slope, bend = saturated(self._excess(path))
        weights[self._instant, self._column] = force * slope / DISTANCE_SCALE
        normals = np.zeros((*weights.shape, 3))
        normals[self._instant, self._column] = self._normals
        given = self._reach, self._wanted, self._sizes, normals
        found = self._some.expansion(q, weights, *given)
        self._normals[:] = normals[self._instant, self._column]
        J = found[1][self._instant, self._column] / DISTANCE_SCALE
        curvature = found[2]
        if bend.any():
            bent = ((force * bend)[:, None] * J)[:, :, None] * J[:, None]
            curvature = curvature + sums.by_instant(bent)
        table, chart = self._batch.tables[coordinates][:, 0], self._problem.ld.chart
        charts = None if chart is None else charts_on(chart, self._batch, path)
        common = sums, np.ascontiguousarray(table), slope[:, None] * J, curvature
        return ExpandedRows(*common, charts, self.grid.order)

    def forces(self, path: DiscretePath, multipliers: Array) -> tuple[Instants, list[PointTerms]]:
        """The multipliers of the rows, (E,), as forces on q at their instants, one batch."""
        none = np.zeros_like(multipliers)
        J = self.expanded(path, none, "nodal").jacobian
        nv, instants = J.shape[1], self._batch
        slope = np.zeros((len(instants.s), (self.grid.order + 1) * nv))
        slope[:, :nv] = self._sums.by_instant((self.weights * multipliers)[:, None] * J)
        weights = WEIGHT * instants.h
        outputs = np.zeros((len(slope), 0))
        slope /= weights[:, None]
        terms = PointTerms(slope, np.zeros_like(slope), outputs, np.zeros_like(outputs))
        if self.distances.paths:
            rates = self._sums.by_instant(self.weights * multipliers * self._rates_in_time(path))
            terms = dataclasses.replace(terms, time_gradient=rates / weights)
        return Instants(instants.numbers, instants.s, weights), [terms]

    def _rates_in_time(self, path: DiscretePath) -> Array:
        """dy/dt of every row at fixed configurations, as obstacles move, shape (E,)."""
        all_of_them = np.ones(self.size, dtype=bool)

        def excess(t: Array) -> Array:
            return saturated(self._measured_excess(path, all_of_them, t))[0]

        return over_time(excess, self._batch.t)

    def stand_behind(self, rows: LimitRows) -> None:
        """Take the place behind rows of limits, unless these are the ones that they have it behind.

        order: of the outputs, numbers of rows of limits and then of these.
        """
        if self._followed is not rows or len(self.order) != rows.size + self.size:
            self.order, self._followed = np.arange(rows.size + self.size), rows

    def extend(self, problem: TrajectoryProblem, path: DiscretePath, ahead: float) -> int:
        """Add rows where pairs come near along a motion; returns how many.

        While they are `probing`, the first motion that does not keep its distances sets `blocked`.
        ahead: distance beyond the least one up to which a pair counts as near, in [m].
        """
        if self.fixed:
            return 0
        found = approaches_along(problem, path, self.distances, self.least, ahead)
        if self.probing and found.nearest < self.least:
            self.blocked = True
            return 0
        self.probing = False
        return self._add(problem, path, found)

    def sharpen(self, path: DiscretePath) -> bool:
        """Round shapes less in rows that have come nearer to their bounds; whether there are any.

        Their outputs grow by that. Rounder shapes bend the motion less where it is far, so that
        steps may be longer; at a bound they are nearly as they are.
        """
        size = _rounding_of(self.values(path))
        sharper = size < SHARPENED * self.rounding
        if not sharper.any():
            return False
        self._round(np.where(sharper, size, self.rounding))
        return True

    def thinned(self, path: DiscretePath, within: float) -> tuple[ClearanceRows, Index]:
        """The rows of pairs that are near along a motion alone; others get rows later from now on.

        Returns them, and the numbers of what remains of the outputs of rows, those of limits first.
        within: distance beyond the least one, in [m]; half of it counts as near from then on.
        """
        kept = self.values(path) <= within / DISTANCE_SCALE
        rows = copy.copy(self)
        rows._followed, rows.guard, rows._spread = None, 0.5 * within, RecentPaths()
        some = self.intervals[kept], self.positions[kept], self.pairs[kept], self.rounding[kept]
        rows._set(self._problem, *some)
        rows._normals = self._normals[kept]
        limits = len(self.order) - self.size
        slots = np.empty(len(self.order), dtype=np.intp)
        slots[self.order] = np.arange(len(self.order))
        return rows, np.append(slots[:limits], slots[limits:][kept])

    def depth(self, path: DiscretePath) -> float:
        """How much too close pairs come, in [m]; negative if they do not.

        At the positions that near pairs have rows at.
        """
        if self.fixed:
            return -np.inf
        d = self._spread_distances(path)
        return float((self.least - d[free_ones(self._problem, len(d))]).max(initial=-np.inf))

    def follow(self, path: DiscretePath) -> int:
        """Add rows where pairs without rows have come near; returns how many."""
        if self.fixed:
            return 0
        d = self._spread_distances(path)
        found = spread_approaches(d, self._watched, self.least, self.guard)
        return self._add(self._problem, path, found)

    def _spread_distances(self, path: DiscretePath) -> Array:
        """Distances of all pairs at positions spread over the motion, (N SPREAD + 1, K)."""
        d = self._spread.get(path)
        if d is None:
            batch = self._spread_batch
            q = self.distances.at(configurations(self._problem, path, batch), batch.t)
            d = self.distances.values(q, self.least + self.guard)
            self._spread = self._spread.with_entry(path, d)
        return d

    def _add(self, problem: TrajectoryProblem, path: DiscretePath, found: Approaches) -> int:
        """Add rows at approaches of a path at which there are none yet."""
        found = found.other_than(self.intervals + self.positions, self.pairs)
        if len(found.pairs) == 0:
            return 0
        k = np.minimum(found.at.astype(np.intp), self.grid.intervals - 1)
        both = (self.intervals, k), (self.positions, found.at - k), (self.pairs, found.pairs)
        intervals, positions, pairs = (np.concatenate(each) for each in both)
        added = len(found.pairs)
        rounding = np.append(self.rounding, np.full(added, LEAST_ROUNDING))
        before = self._measured if problem is self._problem else RecentPaths[Array]()
        normals = np.concatenate([self._normals, np.zeros((added, 3))])
        self._set(problem, intervals, positions, pairs, rounding)
        # with the rows, since measuring them may run out of time
        self.order = np.append(self.order, len(self.order) + np.arange(added))
        self._measured = before.mapped(lambda known: np.append(known, np.full(added, np.nan)))
        self._normals = normals
        rounding = rounding.copy()
        rounding[-added:] = _rounding_of(self.values(path)[-added:])
        self._round(rounding)
        return added

    def _set(
        self,
        problem: TrajectoryProblem,
        intervals: Index,
        positions: Array,
        pairs: Index,
        rounding: Array,
    ) -> None:
        """Take rows: their intervals, positions in these, numbers of pairs, and rounding, (E,)."""
        if problem is not self._problem:
            self._spread = RecentPaths()
        if problem.grid is not self.grid:
            self._spread_batch = spread(problem, SPREAD)
        self.grid = problem.grid
        self._problem, self._measured = problem, RecentPaths()
        self._normals = np.zeros((len(pairs), 3))
        self.intervals, self.positions, self.pairs = intervals, positions, pairs
        at, self._instant = np.unique(intervals + 1j * positions, return_inverse=True)
        chosen, self._column = np.unique(pairs, return_inverse=True)
        self._some = self.distances.restricted(chosen.tolist())
        self._wanted = np.zeros((len(at), len(chosen)), dtype=bool)
        self._wanted[self._instant, self._column] = True
        self._take_rounding(rounding)
        self._sums = RowSums.of(at.real.astype(np.intp), self._instant)
        number = problem.grid.intervals * SPREAD + 1
        self._watched = np.tile(free_ones(problem, number)[:, None], (1, len(self.distances.pairs)))
        self._watched[np.rint((intervals + positions) * SPREAD).astype(np.intp), pairs] = False
        k, s = at.real.astype(np.intp), np.ascontiguousarray(at.imag)
        self._batch = InstantBatch(self.grid, k, s, np.ones(len(k)))

    def _round(self, rounding: Array) -> None:
        """Round the shapes of rows by other sizes, (E,), in [m]; these rows are measured again."""
        changed = rounding != self.rounding
        self._measured = self._measured.mapped(lambda known: np.where(changed, np.nan, known))
        self._take_rounding(rounding)

    def _take_rounding(self, rounding: Array) -> None:
        self.rounding = rounding
        self._sizes = np.zeros(self._wanted.shape)
        self._sizes[self._instant, self._column] = rounding

    def _configurations(self, path: DiscretePath) -> Array:
        """q at the instants, as distances take it."""
        return self._some.at(configurations(self._problem, path, self._batch), self._batch.t)

    @property
    def _reach(self) -> float:
        """Distance beyond which a row is constant, in [m]."""
        return self.least + CUTOFF[1] * DISTANCE_SCALE + MOST_INFLATION * MOST_ROUNDING


def _rounding_of(y: Array) -> Array:
    """Sizes by which the shapes of rows are rounded, in [m]. y: of the rows, (E,)."""
    return np.clip(ROUNDED_FRACTION * DISTANCE_SCALE * y, LEAST_ROUNDING, MOST_ROUNDING)


def saturated(y: Array) -> tuple[Array, Array, Array]:
    """phi(y) and its two derivatives, in DISTANCE_SCALE.

    y up to the first CUTOFF, then width (x - x^3 + x^4/2) more with x in [0, 1], then constant.
    """
    near, far = CUTOFF
    if not np.any(y > near):  # as mostly: rows are of near pairs
        return y.copy(), np.ones_like(y), np.zeros_like(y)
    width = far - near
    x = np.clip((y - near) / width, 0.0, 1.0)
    level = near + width * (x - x**3 + 0.5 * x**4)
    slope, bend = (1.0 - x) ** 2 * (1.0 + 2.0 * x), -6.0 * x * (1.0 - x) / width
    return np.where(y > near, level, y), slope, bend
