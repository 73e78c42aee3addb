"""Where a condition may change faster than between the samples that a motion is checked at.

Functions of CasADi, and bounds that can be read as such, are bounded in cells of time, which are
split until nothing changes much in any: nothing is missed. Other functions and bounds are sampled.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import Condition, scales
from hovi.conditions.expression import Expression
from hovi.conditions.function import ARGUMENTS, Points
from hovi.conditions.sets import Between
from hovi.discrete.cells import (
    CHANGE,
    FIRST_CELLS,
    INSTANTS,
    LEAST_FRACTION,
    SPLIT,
    Cells,
    between,
)
from hovi.discrete.grid import Grid
from hovi.discrete.trajectory import Trajectory
from hovi.effects.expressions.enclosure import Enclosure
from hovi.scene.effect_bounds import effect_bounds
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Index = npt.NDArray[np.intp]
Sampled = Callable[[Index, Array], Array]
"""Values at relative positions s in intervals k, as fractions of the scale, (M, K)."""
At = Callable[[Index, Array], Points]
"""The motion at relative positions s in intervals k."""
Look = Callable[[Cells], tuple[Mask, Mask]]
"""Which cells are to be sampled, and which to be split first, (P,) each."""

NO_BOUND = 1e3
"""Distance from a bound, as a fraction of the scale, where it is infinite, or further away."""
PEAK_FRACTION = 2e-3
"""Distance from a bound, or of samples from lines between them, that is looked at more closely, as
a fraction of the scale; small, as a motion along a bound has many extremes."""
COARSE_CELLS = 8
"""Parts of a cell between whose ends the samples of a first pass, 33 an interval, see all."""


@dataclass(frozen=True, eq=False)
class Features:
    """What is known of the sides lower - y and y - upper of a condition.

    enclosed: bounds of them, or of y where `whole` is false; None where nothing can be narrow, or
    nothing is known. names: of the arguments of y. whole: whether of the sides. sampled: what has
    no bounds, "its function" or "its bounds"; "" if all has.
    """

    enclosed: Enclosure | None
    names: tuple[str, ...]
    whole: bool
    sampled: str


@lru_cache(maxsize=64)
def features_of(given: Condition[Between, Any]) -> Features:
    """The features of a condition `with_function`."""
    y, n, on = given.y, given.y.size, given.on
    names = tuple(x for x in ARGUMENTS if x in y.needs or x == "t")
    if not isinstance(y, Expression):
        return Features(None, names, False, "its function")
    function = y.function
    known = [x for x in ARGUMENTS if x in y.needs]
    symbols = {x: ca.SX.sym(x, function.numel_in(i)) for i, x in enumerate(known)}
    symbols.setdefault("t", ca.SX.sym("t"))
    value = function(*(symbols[x] for x in known))
    lower, upper = (_traced(bound, symbols["t"], n) for bound in (on.lower, on.upper))
    whole = lower is not None and upper is not None
    if lower is not None and upper is not None:
        value = _sides(value, lower, upper, scales(given))
    arguments = [symbols[x] for x in names]
    enclosed = Enclosure(ca.Function("sides", arguments, [ca.densify(value)]))
    if not enclosed.bends:
        return Features(None, names, whole, "" if whole else "its bounds")
    if not enclosed.known:
        return Features(None, names, False, "its function")
    return Features(enclosed, names, whole, "" if whole else "its bounds")


def _sides(y: ca.SX, lower: ca.SX, upper: ca.SX, scale: Array) -> ca.SX:
    """(lower - y, y - upper) over the scale, without those of infinite numbers."""
    sides = ca.vertcat((lower - y) / scale, (y - upper) / scale)
    bounds = ca.vertsplit(ca.vertcat(lower, upper))
    finite = [i for i, x in enumerate(bounds) if not (x.is_constant() and np.isinf(float(x)))]
    return sides[finite]


def _traced(bound: object, t: ca.SX, size: int) -> ca.SX | None:
    """A bound as an expression of time, a column of size; None if it cannot be read as one.

    A function that decides by the time, or calls others than those of NumPy, cannot. Its symbol is
    an MX, of which float(t) fails; of an SX it is NaN.
    """
    if not callable(bound):
        return ca.SX(np.broadcast_to(np.asarray(bound), (size,)))
    time, times = ca.MX.sym("t"), np.linspace(0.0, 1.0, 9)
    try:
        with warnings.catch_warnings(action="ignore"):
            read = ca.Function("bound", [time], [_column(bound(time))]).expand()
            agrees = all(np.allclose(np.ravel(read(x)), bound(float(x))) for x in times)
        column = read(t)
    except Exception:  # a user's own function may raise anything
        return None
    if not (agrees and ca.depends_on(column, t) and column.numel() in (1, size)):
        return None
    return column if column.numel() == size else ca.repmat(column, size, 1)


def _column(given: Any) -> ca.MX:
    """A number or several, or expressions, as a column."""
    parts = np.ravel(given) if isinstance(given, np.ndarray) else given
    several = isinstance(parts, list | tuple | np.ndarray)
    return ca.densify(ca.vertcat(*map(ca.MX, parts)) if several else ca.MX(parts))


class NarrowCells:
    """The cells of a motion in which a condition has to be sampled anew.

    cells: what is not seen at SAMPLES samples of an interval. unresolved: whether more of them
    would be needed than are looked at.
    """

    def __init__(
        self, given: Condition[Between, Any], grid: Grid, sampled: Sampled, at: At
    ) -> None:
        self._given, self._of = given, features_of(given)
        self._grid, self._at = grid, at
        self.unresolved, N = False, grid.intervals
        self.cells = Cells.none()
        if self._of.enclosed is not None:
            self._add(self._enclosed)
        if self._of.sampled == "its function":
            self._add(partial(_look, sampled, _parts(N)))
        elif self._of.sampled:
            cells, unresolved = _of_bounds(given, self._grid)
            self._join(cells, unresolved)

    def _add(self, look: Look) -> None:
        self._join(*_split_where(look, self._grid))

    def _join(self, cells: Cells, unresolved: bool) -> None:
        self.cells, self.unresolved = self.cells.joined(cells), self.unresolved or unresolved

    def _enclosed(self, cells: Cells) -> tuple[Mask, Mask]:
        """Calm cells are sampled, but for those in which the bounds hold for sure."""
        enclosed = self._of.enclosed
        assert enclosed is not None
        k, P = np.repeat(cells.interval, 3), len(cells)
        at = self._at(k, cells.inside(np.array([0.0, 0.5, 1.0])))
        boxes = [between(at.argument(x).reshape(P, 3, -1)) for x in self._of.names]
        bounds = enclosed(boxes, CHANGE)
        holds = np.zeros(P, dtype=bool)
        if self._of.whole:
            holds = np.asarray((bounds.upper <= 0.0).all(axis=1))
        holds |= ~self._given.holds_in(self._grid)[cells.interval]
        return ~holds, ~bounds.calm & ~holds


class TorqueCells:
    """The cells of a motion in which effects change torques faster than its samples show."""

    def __init__(self, motion: Trajectory, over: Sampled, joints: Index, scale: Array) -> None:
        self._motion, self._over, self._joints, self._scale = motion, over, joints, scale
        number = [motion.grid.intervals] if motion.segments is None else motion.segments.intervals
        found = [_torque_bounds(scene) for scene in motion.scenes]
        self._of = np.repeat(np.arange(len(found)), number) if found else np.zeros(0, dtype=np.intp)
        self._effects = [(i, x, np.zeros(x.size)) for i, some in enumerate(found) for x in some]

    @property
    def cells(self) -> Cells:
        """What is to be sampled anew."""
        if not self._effects:
            return Cells.none()
        return _split_where(self._look, self._motion.grid)[0]

    def _look(self, cells: Cells) -> tuple[Mask, Mask]:
        """Cells in which an effect changes much, but for limits that are far from their bounds."""
        k, s = np.repeat(cells.interval, 3), cells.inside(np.array([0.0, 0.5, 1.0]))
        P, n = len(cells), self._motion.v.shape[1]
        q, v, a = self._motion.jet_intervals(k, s)
        t = self._motion.t[k] + s * self._motion.grid.steps[k]
        boxes = [between(x.reshape(P, 3, -1)) for x in (q, v, a, np.zeros_like(v), t)]
        wild, holds, width = np.zeros(P, dtype=bool), np.zeros(P, dtype=bool), np.zeros((P, n))
        for number, effect, peaks in self._effects:
            here = self._of[cells.interval] == number
            bounds = effect([(low[here], high[here]) for low, high in boxes], CHANGE, peaks)
            wild[here] |= ~bounds.calm
            width[here] += bounds.width
        if len(self._joints):
            over = self._over(k, s).reshape(P, 3, 2, -1).max(axis=(1, 2))
            most = over + width[:, self._joints] / self._scale
            holds = np.asarray((most <= -PEAK_FRACTION).all(axis=1))
        return ~holds, wild & ~holds


@lru_cache(maxsize=64)
def _torque_bounds(scene: Scene) -> tuple[Enclosure, ...]:
    """Of the torques of effects that are more than sums and products."""
    return tuple(x.value for x in effect_bounds(scene) if x.is_torque and x.value.known)


@lru_cache(maxsize=64)
def _of_bounds(given: Condition[Between, Any], grid: Grid) -> tuple[Cells, bool]:
    """Cells in which bounds that are functions of time bend, whatever the motion."""
    scale = scales(given)

    def sampled(k: Index, s: Array) -> Array:
        sides = given.on.at(grid.t[k] + s * grid.steps[k], given.y.size)
        most = NO_BOUND * np.tile(scale, 2)
        return np.clip(np.concatenate(sides, axis=1), -most, most) / np.tile(scale, 2)

    return _split_where(partial(_look, sampled, _parts(grid.intervals)), grid)


def _parts(intervals: int) -> int:
    """Samples of a cell such that there are INSTANTS of a motion: a multiple of COARSE_CELLS."""
    return COARSE_CELLS * -(-INSTANTS // (COARSE_CELLS * FIRST_CELLS * intervals))


def _look(sampled: Sampled, parts: int, cells: Cells) -> tuple[Mask, Mask]:
    """Which cells to split: where samples are far from lines between those of a first pass."""
    s = np.arange(parts + 1) / parts
    y = sampled(np.repeat(cells.interval, len(s)), cells.inside(s)).reshape(len(cells), len(s), -1)
    coarse = y[:, :: parts // COARSE_CELLS]
    x = s * COARSE_CELLS
    i = np.minimum(x.astype(np.intp), COARSE_CELLS - 1)
    line = coarse[:, i] + (x - i)[:, None] * (coarse[:, i + 1] - coarse[:, i])
    wild = np.asarray((np.abs(y - line) > PEAK_FRACTION).any(axis=(1, 2)))
    return np.ones_like(wild), wild


def _split_where(look: Look, grid: Grid) -> tuple[Cells, bool]:
    """The pieces of those cells that are to be split, until none is, and whether some still are."""
    cells = Cells.of(grid.intervals, FIRST_CELLS)
    found = Cells.none()
    whole = True  # whose samples are those of a first pass
    while len(cells) > 0:
        raise_if_late()
        sampled, wild = look(cells)
        steps = cells.lengths(grid.steps)
        split = wild & (steps > SPLIT * LEAST_FRACTION * grid.duration)
        if not whole:
            found = found.joined(cells.chosen(sampled & ~split))
        if len(found) + SPLIT * np.count_nonzero(split) > INSTANTS:
            return found.joined(cells.chosen(split)), True
        cells, whole = cells.chosen(split).split(), False
    return found, False
