"""Limits on q, v, a, ... at all times, as rows that are linear in the unknowns.

In an interval every joint coordinate that is no part of an orientation is a polynomial, linear in
the interval's columns, and lies between its control points on each part of the interval. These are
bounded: so a motion is within its limits everywhere. What it loses is the distance of the curve
from its control points where they are at a bound; there the parts are halved while the barrier
falls. This is an inner approximation of a semi-infinite program that is refined adaptively, where
exchange methods [HettichKortanek1993] approximate from outside.
"""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native
from hovi.conditions.joint_quantity import DERIVATIVES
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.instants import Instants
from hovi.discrete.interval_batch import Coordinates
from hovi.discrete.interval_paths import scaled_data
from hovi.optimize.program import Refinement
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.way_back.excused import Excused
from hovi.planning.solver.limits.graded_parts import graded
from hovi.planning.solver.limits.limited_coordinates import LimitedCoordinates
from hovi.planning.solver.limits.limited_parts import LimitedParts
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.schemes.control_points import control_degree, control_nodes, control_rows
from hovi.schemes.scheme import regular_from_nodal

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]
RowsAtNodes = tuple[int, Index, Index, Index, Array]
"""An order of derivatives, and its rows: numbers, intervals, joints, and values at the nodes."""

WEIGHT = 0.1
"""Weight of a row in a barrier, as a fraction of the interval."""
LEAST_GAP = 1e-7
"""Distance of the curve from a control point, as a fraction of the range, below which its part is
not halved."""
LEAST_LOSS = 1e-7
"""Rise of the cost by the distance of one control point, as a fraction of the cost, below
which its part is not halved."""
MAX_LOSS = 1e-5
"""Rise of the cost by the distances of all control points, as a fraction of the cost, below which
no part is halved."""
LOSS_RATIO = 20.0
"""Rise of the cost by the distances of all control points, relative to the last barrier parameter
of the solve, below which no part is halved, if that is more than MAX_LOSS."""
LEAST_SLACK = 1e-12
"""Least slack of a control point whose force is estimated, as a fraction of the range."""
MAX_HALVINGS = 4
"""Number of times that a part is halved at once."""


class LimitRows:
    """Rows on a grid: y = x / range of the control points of limited coordinates, between bounds.

    grid: on which they are. limits: imposed. space: of the configurations; None for a vector space.
    free_ends: which of (q, q', ..., q^(k-1)) are free at the start and at the goal, (2, k, nv); all
        are given if None. given: nodes between them and what is given there, (j, nv). A control
        point that is given with a node has no row, so that a joint may be at its limit there.
    halvings: of all intervals for the control points of positions, and for those of derivatives.
    barrier: the last barrier parameter, relative to the mean density of the cost.
    ends: next to which parts are short enough for what is given there; None where it is not known.

    free: which of (q, q', ..., q^(k-1)) are free at every node, (N + 1, k, nv).
    bounds: lower and upper ones of the E rows, (E,) each. weights: of the rows in a barrier, (E,),
    in [s]. at_nodes: cache of `forces_of`.
    """

    bounds: tuple[Array, Array]
    weights: Array
    at_nodes: list[RowsAtNodes] | None
    _nodal: Array | None

    def __init__(
        self,
        grid: Grid,
        limits: Limits,
        space: ConfigurationSpace | None,
        free_ends: Mask | None = None,
        halvings: tuple[int, int] = (0, 0),
        barrier: float = 0.0,
        given: Sequence[tuple[int, Mask]] = (),
    ) -> None:
        self.grid = grid
        self.space = space
        shape = grid.intervals + 1, grid.order, limits.lower.shape[1]
        self.free = np.ones(shape, dtype=bool)
        self.free[[0, -1]] = False if free_ends is None else free_ends
        for node, fixed in given:
            self.free[node, : len(fixed)] &= ~fixed
        self.limits = limits
        self.fixed = False
        self._instants: tuple[Grid, Instants] | None = None
        self.max_loss = max(MAX_LOSS, LOSS_RATIO * barrier)
        self.of = LimitedCoordinates.of(limits, grid, space)
        depth = np.where(self.of.order == 0, *halvings)
        halved = LimitedParts.halved(grid.intervals, depth)
        self.parts = graded(halved, grid, limits, self.of)
        self._set(self._rows_of(self.parts))

    def copied(self) -> LimitRows:
        """The same rows, to be refined on their own."""
        return copy.copy(self)

    def on(self, grid: Grid) -> LimitRows:
        """The rows of the same parts on another grid of as many intervals.

        In the same order, if the curves have as many modes.
        """
        rows = copy.copy(self)
        rows.grid = grid
        same = grid.inner_modes == self.grid.inner_modes
        rows._set(self._rows if same else rows._rows_of(rows.parts))
        return rows

    def stretched(self, grid: Grid) -> LimitRows:
        """The same rows on the grid with other steps."""
        if grid is self.grid:
            return self
        rows = copy.copy(self)
        rows.grid = grid
        ratios = (grid.steps / self.grid.steps)[self.intervals]
        powers = (ratios ** -self.orders.astype(float))[:, None]
        rows.weights, rows.at_nodes, rows._nodal = rows._fraction_of_intervals(), None, None
        rows._regular, rows._beyond = self._regular * powers, self._beyond * powers
        return rows

    def remaining(self, grid: Grid, first: int) -> tuple[LimitRows, Index]:
        """The rows of the parts from an interval on, and those at their places, -1 for none.

        grid: begins with that interval, whose length may be another one.
        """
        rows, left = self.copied(), self.parts.at(self.parts.k >= first)
        T = self.grid.duration
        later = self.limits.within(T - grid.duration, T)
        rows.limits = dataclasses.replace(later, excused=())  # in time of the whole motion
        rows.of = LimitedCoordinates.of(rows.limits, grid, self.space)
        rows.grid, rows.parts = grid, dataclasses.replace(left, k=left.k - first)
        rows.free = np.concatenate([self.free[:1], self.free[first + 1 :]])
        rows._set(rows._rows_of(rows.parts))
        now, before = rows._places_from(first), self._places
        if grid.inner_modes != self.grid.inner_modes or rows.size == 0:
            return rows, np.full(rows.size, -1)
        return rows, _found(now, before)

    def fixed_on(self, grid: Grid) -> LimitRows:
        """The same on another grid of as many intervals, which are not refined."""
        rows = self.on(grid)
        rows.fixed = True
        return rows

    def between(self, limits: Limits) -> tuple[LimitRows, Index]:
        """The rows of a motion between other ends, and those at their places; or -1.

        limits: which may excuse another start.
        """
        parts = graded(self.parts, self.grid, limits, self.of)
        if limits.excused == self.limits.excused and len(parts) == len(self.parts):
            return self, np.arange(self.size)
        rows = self.copied()
        rows.limits, rows.parts = limits, parts
        rows._set(rows._rows_of(rows.parts))
        return rows, _found(rows._places, self._places) if rows.size else np.arange(0)

    def freed(self) -> LimitRows:
        """The same, which may be refined."""
        rows = self.copied()
        rows.fixed = False
        return rows

    @property
    def instants(self) -> Instants:
        """The instants of the control points of positions on whole intervals."""
        if self._instants is None or self._instants[0] is not self.grid:
            grid = self.grid
            nodes = control_nodes(control_degree(grid.order, grid.inner_modes, 0))
            weights = np.repeat(grid.steps / len(nodes), len(nodes))
            k = np.repeat(np.arange(grid.intervals), len(nodes))
            self._instants = grid, Instants(k, np.tile(nodes, grid.intervals), weights)
        return self._instants[1]

    @property
    def free_ends(self) -> Mask:
        """Which of (q, q', ..., q^(k-1)) are free at the start and at the goal, (2, k, nv)."""
        return self.free[[0, -1]]

    @property
    def size(self) -> int:
        """E, the number of rows."""
        return len(self._rows.part)

    @property
    def table(self) -> Array:
        """y range h^j, without q0, over (h q0', ..., Z, c) of the interval, (E, 2 k - 1 + r)."""
        return self._rows.table

    def values(self, path: DiscretePath) -> Array:
        """y of every row, shape (E,)."""
        q = path.q if self.space is None else self.space.coordinates(path.q)
        data = np.concatenate([q[:-1, None], self._data(path)], axis=1)
        return push_rows(self, self._regular, data)

    def columns(self, coordinates: Coordinates) -> Array:
        """Derivatives of y in the columns of the interval, shape (E, m)."""
        if coordinates == "regular":
            return self._regular
        if self._nodal is None:
            nodal = self._regular @ regular_from_nodal(self.grid.inner_modes, self.grid.order)
            self._nodal = np.ascontiguousarray(nodal)
        return self._nodal

    def refine(
        self, path: DiscretePath, level: float, forces: Array | None = None
    ) -> Refinement | None:
        """Halve parts whose control points, away from the curve, raise the cost; None if none do.

        level: barrier parameter at the path, relative to the mean density of the cost.
        forces: |z| of the rows, relative to the same, (E,); None for the level over their slacks.
        Parts that are halved are halved once then, since the forces of new rows are not known.
        """
        if self.fixed or self.size == 0:
            return None
        coarse = self._coarse(path, level, forces)
        if not coarse.any():
            return None
        numbers, before = np.arange(self.size), self._places
        for _ in range(MAX_HALVINGS):
            numbers = self._halve(coarse, numbers)
            if forces is not None:
                break
            coarse = self._coarse(path, level)
            if not coarse.any():
                break
        kept = numbers[numbers >= 0]
        return Refinement(kept, self._origins(before, len(kept)))

    def _coarse(self, path: DiscretePath, level: float, forces: Array | None = None) -> Mask:
        """Which parts are worth halving, shape (L,)."""
        y, (lower, upper) = self.values(path), self.bounds
        outside = push_rows(self, self._beyond, self._data(path))
        slack = np.maximum(np.where(outside > 0, upper - y, y - lower), LEAST_SLACK)
        gap, force = np.abs(outside), level / slack if forces is None else forces
        loss = self.weights / self.grid.duration * force * gap
        coarse = np.zeros(len(self.parts), dtype=bool)
        if loss.sum() > self.max_loss:
            some = (gap > max(LEAST_GAP, level)) & (loss > LEAST_LOSS)
            coarse[self._rows.part[some]] = True
        return coarse

    def _halve(self, coarse: Mask, numbers: Index) -> Index:
        """Halve parts; returns the given numbers of the rows that remain, and -1 for the new."""
        kept, remaining = np.flatnonzero(~coarse[self._rows.part]), np.flatnonzero(~coarse)
        places = np.cumsum(~coarse) - 1
        old, new = self._rows.at(kept), self.parts.at(coarse).halves()
        rows = self._rows_of(new)
        both = old._replace(part=places[old.part]), rows._replace(part=rows.part + len(remaining))
        self.parts = self.parts.at(remaining).followed_by(new)
        self._set(_Rows(*(np.concatenate(pair) for pair in zip(*both, strict=True))))
        return np.append(numbers[kept], np.full(self.size - len(kept), -1))

    def _set(self, rows: _Rows) -> None:
        """Take rows: their intervals, coordinates, orders and joints, and what they multiply."""
        self._rows = rows
        self.intervals, self.coordinate = self.parts.k[rows.part], self.parts.coordinate[rows.part]
        self.orders, self.joints = self.of.order[self.coordinate], self.of.joint[self.coordinate]
        self.at_nodes, self._nodal = None, None
        ranges = self.of.ranges[self.coordinate]
        k = np.minimum(self.intervals, len(self.of.lower) - 1)
        lower, upper = (each[k, self.coordinate] for each in (self.of.lower, self.of.upper))
        for each in self.limits.excused:
            mine, wider = self._wider(each)
            (upper if each.side > 0 else lower)[mine] += each.side * wider
        self.bounds, self.weights = (lower / ranges, upper / ranges), self._fraction_of_intervals()
        scale = 1.0 / (ranges * self.grid.steps[self.intervals] ** self.orders)[:, None]
        base = np.where(self.orders == 0, 1.0 / ranges, 0.0)[:, None]
        self._regular = np.concatenate([base, rows.table * scale], axis=1)
        self._beyond = (rows.table - rows.curve) * scale

    def _wider(self, excused: Excused) -> tuple[Index, Array]:
        """The rows of what is excused, and by how much their bounds are wider."""
        order = DERIVATIVES.get(excused.limit, -1)
        mine = np.flatnonzero((self.orders == order) & (self.joints == excused.coordinate))
        part, h = self._rows.part[mine], self.grid.steps[self.intervals[mine]]
        begin = self.grid.t[self.intervals[mine]] + h * self.parts.left[part]
        degree = control_degree(self.grid.order, self.grid.inner_modes, max(order, 0))
        end = begin + h * self.parts.width[part]
        points = excused.control_points(begin, end - begin, degree)
        within = end[end <= excused.until * (1.0 + 1e-12)]
        # the next part, which reaches beyond, begins at this control point, too
        points[end == within.max(initial=0.0), -1] = 0.0
        return mine, points[np.arange(len(mine)), self._rows.number[mine]]

    def _fraction_of_intervals(self) -> Array:
        """The weights."""
        return np.asarray(WEIGHT * self.grid.steps[self.intervals])

    def _rows_of(self, parts: LimitedParts) -> _Rows:
        """The rows of parts."""
        columns = 2 * self.grid.order - 1 + self.grid.inner_modes
        none, empty = np.zeros(0, dtype=np.intp), np.zeros((0, columns))
        found = [_Rows(none, none, empty, empty)]
        orders = self.of.order[parts.coordinate]
        for order in np.unique(orders):
            own = np.flatnonzero(orders == order)
            left, width, which = parts.at(own).unique
            tables = control_rows(left, width, self.grid.order, self.grid.inner_modes, int(order))
            part, i = np.nonzero(self._needed(parts.at(own), int(order)))
            table, curve = (each[which[part], i] for each in tables)
            found.append(_Rows(own[part], i, table, curve))
        return _Rows(*(np.concatenate(each) for each in zip(*found, strict=True)))

    def _needed(self, parts: LimitedParts, order: int) -> Mask:
        """Which control points get rows, shape (L, d + 1): others are given.

        One at which two parts meet belongs to the part before, and where an interval has other
        limits than the one before to both.
        """
        degree = control_degree(self.grid.order, self.grid.inner_modes, order)
        # the derivatives from this one on that are given at a node determine as many points there
        given = np.cumprod(~self.free[:, order:], axis=1).sum(axis=1)  # (N + 1, nv)
        joint, begins, ends = self.of.joint[parts.coordinate], parts.left == 0, parts.k + 1
        smooth = order < self.grid.order
        at_node = np.where(self.of.differ(parts.k, parts.coordinate), 0, int(smooth))
        at_node = np.where(parts.k == 0, 0, at_node)
        known = np.maximum(given[parts.k, joint], at_node)
        first = np.where(begins, known, min(degree, 1))
        last = degree - np.where(parts.left + parts.width == 1, given[ends, joint], 0)
        i = np.arange(degree + 1)
        return np.asarray((i >= first[:, None]) & (i <= last[:, None]))

    def _data(self, path: DiscretePath) -> Array:
        """(h q0', ..., Z, c) of all intervals, (N, 2 k - 1 + r, n)."""
        numbers = np.arange(self.grid.intervals)
        return scaled_data(path, numbers, self.grid.steps[:, None], self.grid.inner_modes)

    @property
    def _places(self) -> Array:
        """A number for interval, coordinate and position of the curve at every row, (E,)."""
        return self._places_from(0)

    def _places_from(self, first: int) -> Array:
        """The same if the first interval has a number."""
        part, i = self._rows.part, self._rows.number
        degree = control_degree(self.grid.order, self.grid.inner_modes, 0) - self.orders
        s = self.parts.left[part] * degree + self.parts.width[part] * i  # in [0, degree]
        series = (self.intervals + first) * len(self.of.order) + self.coordinate
        return np.asarray(series * (degree.max(initial=0) + 1.0) + s)

    def _origins(self, before: Array, first: int) -> Index:
        """The former row at the place of each row from the given one on; -1 for none."""
        return _found(self._places[first:], before)


def _found(now: Array, before: Array) -> Index:
    """The number of each of some values among others; -1 for none."""
    order = np.argsort(before)
    at = order[np.minimum(np.searchsorted(before[order], now), len(order) - 1)]
    return np.where(before[at] == now, at, -1)


class _Rows(NamedTuple):
    """Rows of control points.

    part: number of their parts, (E,). number: of the control point in the part, (E,).
    table, curve: of the control points, and of the curve at the same places, (E, 2 k - 1 + r).
    """

    part: Index
    number: Index
    table: Array
    curve: Array

    def at(self, chosen: Index) -> _Rows:
        """Some of them."""
        table, curve = self.table[chosen], self.curve[chosen]
        return _Rows(self.part[chosen], self.number[chosen], table, curve)


def push_rows(rows: LimitRows, columns: Array, step: Array) -> Array:
    """The change of y in a step of the intervals' columns, (E,)."""
    out = np.empty(len(columns))
    native.push_rows(rows.intervals, rows.joints, columns, np.ascontiguousarray(step), out)
    return out
