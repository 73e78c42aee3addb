"""The cost along a motion with all narrow features of its effects, however few points a grid has.

Time is split until the effects are bounded to change little in every cell, see `Enclosure`, and
Gauss points in the cells integrate the Lagrangian.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.discrete.cells import (
    CHANGE,
    FIRST_CELLS,
    INSTANTS,
    LEAST_FRACTION,
    SPLIT,
    Cells,
    between,
)
from hovi.discrete.trajectory import Trajectory
from hovi.effects.expressions.interval_rules import Array, Bound
from hovi.effects.expressions.time_parts import TimePart, from_line
from hovi.planning.problem.presolve.formulas_of_time import base_parts
from hovi.scene.effect_bounds import EffectBounds, effect_bounds
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.scene.segmented_lagrangian import SegmentedLagrangian
from hovi.system.dataclass import dataclass

Index = npt.NDArray[np.intp]

MAX_CELLS = 20_000
"""Maximum number of cells of a motion."""
_RULES = [np.polynomial.legendre.leggauss(points) for points in (4, 6)]
"""Gauss points in [-1, 1] and weights of two rules, whose difference is the error of the first."""
_S = np.concatenate([(x + 1) / 2 for x, _ in _RULES])
"""The points of both rules in [0, 1]."""


@dataclass(frozen=True, eq=False)
class AlongMotion:
    """The integral of a Lagrangian along a motion, in cells that resolve its effects.

    cost: the integral. error: bound of what it may miss. by_interval: of the motion's grid, (N,).
    cells: of time. fault: what no cells resolve, as a clause; "" if nothing.
    sampled: names of effects without bounds, which are looked at at INSTANTS instants.
    """

    cost: float
    error: float
    by_interval: Array
    cells: Cells
    fault: str
    sampled: tuple[str, ...] = ()


def along_motion(
    lagrangian: Lagrangian, motion: Trajectory, cost: float, error: float
) -> AlongMotion:
    """The integral along a motion.

    cost: about that of the motion, positive. error: that the integral may have, relative to it.
    """
    seen = [_Seen(scene) for scene in _scenes(lagrangian)]
    return _Look(lagrangian, motion, cost, error * cost, seen).run()


def may_be_narrow(lagrangian: Lagrangian) -> bool:
    """Whether anything in a Lagrangian may change in a short time of a smooth motion.

    Not where its effects add sums and products of q, v and a alone to the dynamics.
    """
    return any(_Seen(scene).anything for scene in _scenes(lagrangian))


def _scenes(lagrangian: Lagrangian) -> list[Scene | None]:
    """The scene of every segment."""
    if isinstance(lagrangian, SegmentedLagrangian):
        return [scene for each in lagrangian.lagrangians for scene in _scenes(each)]
    scene = getattr(lagrangian, "scene", None)
    return [scene if isinstance(scene, Scene) and lagrangian.output_weight.size else None]


class _Seen:
    """What may have narrow features in a scene; without one anything may, and has no bounds."""

    def __init__(self, scene: Scene | None) -> None:
        self.effects = () if scene is None else effect_bounds(scene)
        self.base: tuple[TimePart, ...] = () if scene is None else base_parts(scene)
        self.bounded = [each for each in self.effects if each.value.known and each.rate.known]
        names = [each.name for each in self.effects if each not in self.bounded]
        self.sampled = ("the Lagrangian",) if scene is None else tuple(dict.fromkeys(names))
        self.anything = bool(self.effects or self.base or scene is None)
        values = [each.value for each in self.bounded] + [each.value for each in self.base]
        self.peaks = [np.zeros(value.size) for value in values]


@dataclass(eq=False)
class _Look:
    """See `along_motion`. budget: error that the integral may have. seen: of each segment."""

    lagrangian: Lagrangian
    motion: Trajectory
    cost: float
    budget: float
    seen: list[_Seen]
    squares: dict[int, float] = field(default_factory=dict)
    fault: str = ""

    def run(self) -> AlongMotion:
        """Split, then integrate."""
        N, sampled = self.motion.grid.intervals, tuple(x for s in self.seen for x in s.sampled)
        least = -(-INSTANTS // (len(_S) * N)) if sampled else 0
        cells, unseen, _ = self._split(Cells.of(N, max(FIRST_CELLS, least)), self._deviation)
        cells, error, values = self._split(cells, self._rule_error)
        by_interval = np.bincount(cells.interval, values, minlength=N).astype(np.float64)
        cost = float(by_interval.sum())
        return AlongMotion(cost, unseen + error, by_interval, cells, self.fault, sampled)

    def _split(
        self, cells: Cells, error_of: Callable[[Cells], tuple[Array, list[str], Array]]
    ) -> tuple[Cells, float, Array]:
        """Cells that are split until the sum of their errors is within the budget, and it.

        error_of: errors, (P,), names of what causes them, and a number of each cell, (P,),
        which is returned, too.
        """
        grid, limit = self.motion.grid, LEAST_FRACTION * self.motion.duration
        errors, names, values = error_of(cells)
        while errors.sum() > self.budget:
            cut = errors > self.budget / (2 * len(cells))
            steps = cells.lengths(grid.steps)
            more_cells = (SPLIT - 1) * np.count_nonzero(cut)
            if steps[cut].min() < SPLIT * limit or len(cells) + more_cells > MAX_CELLS:
                i = int(np.argmax(errors))
                t = grid.t[cells.interval[i]] + cells.begin[i] * grid.steps[cells.interval[i]]
                self.fault = (
                    self.fault or f"{names[i]} changes within {steps[i]:.2g} s at {t:.6g} s"
                )
                break
            split = cells.chosen(cut).split()
            more, of, others = error_of(split)
            cells = cells.chosen(~cut).joined(split)
            errors, values = np.append(errors[~cut], more), np.append(values[~cut], others)
            names = [x for x, gone in zip(names, cut, strict=True) if not gone] + of
        return cells, float(errors.sum()), values

    def _rule_error(self, cells: Cells) -> tuple[Array, list[str], Array]:
        """The differences of two Gauss rules in each cell, and the integrals."""
        fewer, value = self._integrals(cells)
        return np.abs(value - fewer), ["the cost"] * len(cells), value

    def _integrals(self, cells: Cells) -> Array:
        """The integral of L over each cell by two rules, shape (2, P)."""
        k, s = np.repeat(cells.interval, len(_S)), cells.inside(_S)
        jet = self.motion.jet_intervals(k, s, self.lagrangian.order)
        t = self.motion.t[k] + s * self.motion.grid.steps[k]
        values = self.lagrangian.value(*jet, t=t).reshape(len(cells), -1)
        steps = cells.lengths(self.motion.grid.steps)
        fewer = len(_RULES[0][0])
        pairs = zip(_RULES, (values[:, :fewer], values[:, fewer:]), strict=True)
        return np.stack([steps * (x @ rule[1]) / 2 for rule, x in pairs])

    def _deviation(self, cells: Cells) -> tuple[Array, list[str], Array]:
        """How much of the cost the effects may hide in each cell, at most, and which of them."""
        errors, names = np.zeros(len(cells)), [""] * len(cells)
        for number, seen in enumerate(self.seen):
            here = np.flatnonzero(self._segments[cells.interval] == number)
            if len(here) == 0 or not (seen.bounded or seen.base):
                continue
            found = self._of_scene(seen, cells.chosen(here))
            total = sum(each for _, each in found)
            largest = np.argmax([each for _, each in found], axis=0)
            errors[here] = total
            for place, which in zip(here, largest, strict=True):
                names[place] = found[which][0]
        return errors, names, errors

    @cached_property
    def _segments(self) -> Index:
        if isinstance(self.lagrangian, SegmentedLagrangian):
            return self.lagrangian.segments_of(self.motion.t)
        return np.zeros(self.motion.grid.intervals, dtype=np.intp)

    def _of_scene(self, seen: _Seen, cells: Cells) -> list[tuple[str, Array]]:
        """What each effect of a scene may hide, (P,) each, with its name."""
        steps = cells.lengths(self.motion.grid.steps)
        boxes, rates, tau = self._boxes(cells, steps)
        found = []
        for effect, peaks in zip(seen.bounded, seen.peaks, strict=False):
            away = _deviations(effect, boxes, rates, steps, peaks)
            cost = self._cost_of_torque(tau, away) if effect.is_torque else away.sum(axis=1)
            found.append((effect.name, steps * cost))
        for term, peaks in zip(seen.base, seen.peaks[len(seen.bounded) :], strict=True):
            found.append((term.name, self._of_base(term, peaks, cells, steps)))
        return found

    def _cost_of_torque(self, tau: Array, away: Array) -> Array:
        """R (|tau| + dtau) dtau for a change dtau of torques of absolute values |tau|, (P,)."""
        R = self.lagrangian.output_weight[: tau.shape[1]]
        with np.errstate(invalid="ignore"):
            products = np.where(away == 0, 0.0, (tau + away) * away)
        return np.asarray(products @ R)

    def _of_base(self, term: TimePart, peaks: Array, cells: Cells, steps: Array) -> Array:
        """The fraction of the cost that a cell of the base's motion may hide, of its square."""
        begin = self.motion.t[cells.interval] + cells.begin * self.motion.grid.steps[cells.interval]
        away, size = term.deviation(begin, begin + steps, peaks)
        whole = self.squares.setdefault(id(term), float(np.sum(size**2 * steps)))
        return self.cost * 2.0 * away * size * steps / max(whole, 1e-300)

    def _boxes(self, cells: Cells, steps: Array) -> tuple[list[Bound], list[Bound], Array]:
        """Bounds of (q, v, a, tau, t) in each cell, of (da/dt, dtau/dt), and the largest |tau|."""
        k, s = np.repeat(cells.interval, 3), cells.inside(np.array([0.0, 0.5, 1.0]))
        sample = self.motion.sample_intervals(k, s)
        t = self.motion.t[k] + s * self.motion.grid.steps[k]
        triples = [x.reshape(len(cells), 3, -1) for x in (*sample, t)]
        changes = [2.0 * np.diff(triples[i], axis=1) / steps[:, None, None] for i in (2, 3)]
        tau = np.abs(triples[3]).max(axis=1)
        return [between(x) for x in triples], [_slopes(x) for x in changes], tau


def _deviations(
    effect: EffectBounds, boxes: list[Bound], rates: list[Bound], steps: Array, peaks: Array
) -> Array:
    """How far an effect may be from a line in each cell, shape (P, m); 0 where it is calm."""
    bounds = effect.value(boxes, CHANGE, peaks)
    away, wild = np.zeros_like(bounds.lower), ~bounds.calm
    if wild.any():
        some = [(low[wild], high[wild]) for low, high in (*boxes, *rates)]
        slopes = effect.rate(some, CHANGE)
        away[wild] = from_line(bounds.chosen(wild), slopes, steps[wild][:, None])
    return away


def _slopes(x: Array) -> Bound:
    """Bounds of a derivative from the slopes in both halves, (P, 2, n), with a margin."""
    bend = np.abs(x[:, 1] - x[:, 0])
    return x.min(axis=1) - bend, x.max(axis=1) + bend
