"""The logarithmic barrier of slacks between bounds, their multipliers, and Newton directions."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi._native import barrier as native
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]
Pair = tuple[Array, Array]

INITIAL_MARGIN = 1e-2
"""Minimum distance of an initial slack from its bounds, relative to the range."""
MOST_MARGIN = 0.25
"""The largest margin, as a fraction of the distance of the bounds."""
WARM_START_MARGIN = 1e-5
"""Minimum distance of the slack of a warm start from its bounds, relative to the range, unless the
start says otherwise."""
ADDED_MARGIN = 0.3
"""Minimum distance of a slack that is added, relative to mu over the scale of the multipliers."""
LEAST_ADDED_MARGIN = 1e-10
"""Least minimum distance of a slack that is added, relative to the range."""
SCALE_PER_MU = 10.0
"""Scale of the multipliers where none is given, relative to mu."""
LEAST_GAP = 1e-16
"""Least distance of a slack from its bounds."""
REACHED = 1e-9
"""Distance of a slack from a bound that its output reaches, where forces are given, relative to the
range."""
MAX_DUAL_RATIO = 1e8
"""Largest ratio, either way, of a multiplier and mu over its gap."""
FRACTION_TO_BOUNDARY = 0.99
"""Largest fraction of the distance to a bound in one step while mu is large."""
LARGEST_FRACTION = 1.0 - 1e-4
"""Largest fraction of the distance to a bound in one step when mu is small: a slack nearer to its
bound than mu over its multiplier takes a gap below rounding errors."""
CENTERED_FACTOR, CENTERED_TERM = 1.08, 0.18
"""Centered targets are those for longer fractions of a direction: the present ones times the first
number, plus the second one, and at most 1."""
SLACK_MATCHED = 1e-9
"""Largest |y - s| at which the slack has reached its output and limits the length of a step."""


@dataclass(frozen=True, eq=False)
class Bounds:
    """lower <= y <= upper for R outputs in units of their ranges; infinite where unbounded.

    lower, upper: shape (R,). weights: of the outputs in the barrier, shape (R,).
    measure: of what the objective is an integral over, such as a duration; its mean density is
        the objective over this.
    """

    lower: Array
    upper: Array
    weights: Array
    measure: float = 1.0

    def shrunk(self, room: float) -> Bounds:
        """Bounds that are further inside, by at most a quarter of their distance."""
        inside = np.minimum(room, MOST_MARGIN * (self.upper - self.lower))
        return dataclasses.replace(self, lower=self.lower + inside, upper=self.upper - inside)

    def excess(self, y: Array) -> Array:
        """By how much outputs are outside of their bounds, 0 inside, shape (R,)."""
        return np.maximum(np.maximum(self.lower - y, y - self.upper), 0.0)

    @property
    def has_lower(self) -> Mask:
        """Where there is a lower bound."""
        return np.isfinite(self.lower)

    @property
    def has_upper(self) -> Mask:
        """Where there is an upper bound."""
        return np.isfinite(self.upper)


@dataclass(frozen=True, eq=False)
class Direction:
    """A direction of the outputs, the slacks and the multipliers, (R,) each.

    primal, dual: the largest fractions of it, up to 1, that slacks and multipliers may take.
    largest_force: the largest |zu - zl| at its end. largest_residual: the largest |y - s| before.
    """

    dy: Array
    ds: Array
    dzl: Array
    dzu: Array
    primal: float
    dual: float
    largest_force: float
    largest_residual: float


@dataclass(frozen=True, eq=False)
class Barrier:
    """-mu sum weights (log(s - lower) + log(upper - s)), with multipliers zl, zu of the slacks.

    s, zl, zu: shape (R,); a multiplier is zero where there is no bound.
    scale: the objective's mean density, to which mu is compared.
    """

    bounds: Bounds
    s: Array
    zl: Array
    zu: Array
    mu: float
    scale: float

    @classmethod
    def central(
        cls,
        bounds: Bounds,
        y: Array,
        mu: float,
        scale: float | None = None,
        margin: float | Array = INITIAL_MARGIN,
        known: Barrier | None = None,
    ) -> Barrier:
        """Slacks at y, clipped to a margin inside the bounds; multipliers on the central path.

        scale: SCALE_PER_MU mu if None. margin: relative to the range. known: of a nearby solution,
        whose multipliers are kept where they are larger, for a warm start; its scale is kept, too.
        """
        inside = np.minimum(margin, MOST_MARGIN * (bounds.upper - bounds.lower))
        s = np.clip(y, bounds.lower + inside, bounds.upper - inside)
        below, above = _gaps(bounds, s)
        zl, zu = mu / below, mu / above
        if known is not None:
            zl, zu, scale = np.maximum(known.zl, zl), np.maximum(known.zu, zu), known.scale
        return cls(bounds, s, zl, zu, mu, SCALE_PER_MU * mu if scale is None else scale)._clipped()

    @classmethod
    def inactive(cls, bounds: Bounds, y: Array) -> Barrier:
        """Without forces, at outputs that may be outside: those of a point that is no solution."""
        none = np.zeros_like(y)
        return cls(bounds, y, none, none, 0.0, 1.0)

    @classmethod
    def of_forces(cls, bounds: Bounds, y: Array, z: Array, mu: float, scale: float) -> Barrier:
        """With given forces zu - zl = z at outputs that are within their bounds to rounding.

        Slacks are at the outputs, and next to the bounds that z holds or y reaches.
        """
        gap = np.clip(mu / np.maximum(np.abs(z), np.finfo(float).tiny), LEAST_GAP, REACHED)
        gap = np.minimum(gap, MOST_MARGIN * (bounds.upper - bounds.lower))
        s = np.clip(y, bounds.lower + gap, bounds.upper - gap)
        return cls(bounds, s, np.maximum(-z, 0.0), np.maximum(z, 0.0), mu, scale)._clipped()

    def refined(
        self, bounds: Bounds, y: Array, kept: Index, origin: Index, before: Array
    ) -> Barrier:
        """The barrier after some outputs were replaced: see Refinement.

        New slacks are at their outputs, as far as these are inside, and on the central path, or
        with the multiplier of the output at whose place they are if that is larger. The slack of an
        output that has moved away from its bounds has moved with it.
        y: all outputs, (R,). before: those that are kept, as they were.
        """
        old, known = len(kept), origin >= 0
        margin = ADDED_MARGIN * self.mu / self.scale
        margin = float(np.clip(margin, LEAST_ADDED_MARGIN, INITIAL_MARGIN))
        inside = np.where(np.arange(len(y)) >= old, margin, 0.0)
        moved = self._moved_inside(y[:old] - before, kept) + self._moved_with(bounds, kept)
        s = np.append(self.s[kept] + moved, y[old:])
        whole = Barrier.central(bounds, s, self.mu, self.scale, inside)
        for z, former in ((whole.zl, self.zl), (whole.zu, self.zu)):
            z[:old] = former[kept]
            z[old:][known] = np.maximum(z[old:][known], former[origin[known]])
        return whole._clipped()

    def within(self, bounds: Bounds) -> Barrier:
        """The same within other bounds of the same outputs, with which slacks have moved."""
        s = self.s + self._moved_with(bounds, np.arange(len(self.s)))
        return dataclasses.replace(self, bounds=bounds, s=s)._clipped()

    def _moved_inside(self, change: Array, kept: Index) -> Array:
        """The change of outputs that have one bound and move away from it; 0 of others."""
        bounds = self.bounds
        free_above, free_below = ~bounds.has_upper[kept], ~bounds.has_lower[kept]
        up, down = np.where(free_above, change, 0.0), np.where(free_below, change, 0.0)
        return np.maximum(up, 0.0) + np.minimum(down, 0.0)

    def _moved_with(self, bounds: Bounds, kept: Index) -> Array:
        """The changes of the bounds of outputs, of which the one with the larger multiplier."""
        old, former = len(kept), self.bounds
        low = _changes(former.lower[kept], bounds.lower[:old])
        high = _changes(former.upper[kept], bounds.upper[:old])
        return np.where(self.zu[kept] > self.zl[kept], high, low)

    def of(self, chosen: Index) -> Barrier:
        """The slacks and multipliers of some outputs; without force for the number -1."""
        bounds, known = self.bounds, chosen >= 0
        lower, upper, weights = (x[chosen] for x in (bounds.lower, bounds.upper, bounds.weights))
        some = Bounds(lower, upper, weights, bounds.measure)
        zl, zu = (np.where(known, z[chosen], 0.0) for z in (self.zl, self.zu))
        return dataclasses.replace(self, bounds=some, s=self.s[chosen], zl=zl, zu=zu)

    def at_outputs(self, bounds: Bounds, y: Array) -> Barrier:
        """The same with slacks at outputs that are within other bounds to rounding."""
        s = np.clip(y, bounds.lower + LEAST_GAP, bounds.upper - LEAST_GAP)
        return dataclasses.replace(self, bounds=bounds, s=s)

    def outside(self, y: Array) -> Array:
        """See Bounds.excess."""
        return self.bounds.excess(y)

    @property
    def multipliers(self) -> Array:
        """zu - zl."""
        return self.zu - self.zl

    @property
    def arrays(self) -> tuple[Array, Array, Array, Array, Array]:
        """lower, upper, s, zl and zu."""
        return self.bounds.lower, self.bounds.upper, self.s, self.zl, self.zu

    def condensed(self, y: Array) -> tuple[Array, Array, Array]:
        """sigma, rho and zu - zl: see hovi.optimize.interior_point."""
        sigma, rho, force = (np.empty_like(y) for _ in range(3))
        native.condense(*self.arrays, y, self.mu, sigma, rho, force)
        return sigma, rho, force

    def central_targets(self) -> Pair:
        """mu, the target of every product of a multiplier and its gap."""
        return np.full_like(self.s, self.mu), np.full_like(self.s, self.mu)

    def shift(self, mu: float, targets: Pair) -> Array:
        """Change of rho, as condensed with mu, where the products aim at targets instead."""
        change = np.empty_like(self.s)
        native.shift(*self.arrays, mu, *targets, change)
        return change

    def aim(self, y: Array, dy: Array, targets: Pair) -> Direction:
        """The Newton direction that belongs to a change dy, with products that aim at targets."""
        ds, dzl, dzu = (np.empty_like(y) for _ in range(3))
        limits = SLACK_MATCHED, self.boundary_fraction
        ends = native.aim(*self.arrays, y, dy, *targets, *limits, ds, dzl, dzu)
        return Direction(dy, ds, dzl, dzu, *ends)

    def mean_product(self, along: Direction | None = None) -> float:
        """The mean product of multipliers and gaps, here or at the end of a direction."""
        if along is None:
            still = np.zeros_like(self.s)
            return native.mean_product(*self.arrays, still, still, still, 0.0, 0.0)
        d = along
        return native.mean_product(*self.arrays, d.ds, d.dzl, d.dzu, d.primal, d.dual)

    def corrected_targets(self, y: Array, of: Direction, mu: float) -> Pair:
        """Targets at which a direction's second-order terms leave the products at mu."""
        lower, upper = np.empty_like(y), np.empty_like(y)
        d = (of.ds, of.dzl, of.dzu)
        native.correct(*self.arrays, y, *d, mu, SLACK_MATCHED, lower, upper)
        return lower, upper

    def centered_targets(self, y: Array, of: Direction, mu: float, targets: Pair) -> Pair:
        """Targets that bring outliers among the products nearer to mu, for longer fractions."""
        lower, upper = targets[0].copy(), targets[1].copy()
        fractions = (CENTERED_FACTOR * each + CENTERED_TERM for each in (of.primal, of.dual))
        primal, dual = (min(1.0, each) for each in fractions)
        d = (of.ds, of.dzl, of.dzu)
        native.center(*self.arrays, y, *d, primal, dual, mu, SLACK_MATCHED, lower, upper)
        return lower, upper

    def merit(self, y: Array, penalty: float, along: Direction, fraction: float) -> float:
        """The barrier plus penalty sum weights |y - s| after a fraction of a direction."""
        w, d = self.bounds.weights, along
        numbers = fraction, self.boundary_fraction, self.mu, penalty
        return native.merit(*self.arrays, w, y, d.dy, d.ds, *numbers)

    def moved(self, y: Array, along: Direction, fraction: float, penalty: float) -> Barrier:
        """Slacks after a fraction of a direction, multipliers as far as they stay positive.

        y: the outputs there. A slack becomes its output where that is inside the bounds and lowers
        the merit.
        """
        s, zl, zu = (np.empty_like(y) for _ in range(3))
        keep = self.boundary_fraction
        dual = 1.0 if along.dual >= 1.0 else keep * along.dual
        d = (along.ds, along.dzl, along.dzu)
        numbers = (fraction, dual, keep, self.mu, penalty, MAX_DUAL_RATIO)
        native.move(*self.arrays, y, *d, *numbers, s, zl, zu)
        return dataclasses.replace(self, s=s, zl=zl, zu=zu)

    def recentered(self, weight: float, mu: float) -> Barrier:
        """The point of the central path with another mu that belongs to this one.

        Each bound keeps z - weight gap, so that what holds a bound still does.
        """
        s, zl, zu = (np.empty_like(self.s) for _ in range(3))
        native.recenter(*self.arrays, weight, mu, s, zl, zu)
        return dataclasses.replace(self, s=s, zl=zl, zu=zu, mu=mu)

    def followed(
        self, y: Array, dy: Array, y_new: Array, mu: float, weight: float
    ) -> tuple[Barrier, float, float]:
        """The point of the central path with another mu after a Newton step dy of outputs y.

        From a point of this central path. z is what the step predicts and the gap that of y_new;
        each bound keeps z - c gap, where c is the geometric mean of the weight and of z / gap
        before, or the weight if that is larger. Returns also how far y_new is outside at most, and
        what may still be gained: sum weights |zu - zl| |y_new - s|, and by the release of bounds
        whose predicted multipliers are negative.
        """
        s, zl, zu = (np.empty_like(y) for _ in range(3))
        w, numbers = self.bounds.weights, (self.mu, mu, weight)
        misses = native.follow(*self.arrays, w, y, dy, y_new, *numbers, s, zl, zu)
        return dataclasses.replace(self, s=s, zl=zl, zu=zu, mu=mu), *misses

    def with_mu(self, mu: float) -> Barrier:
        """The barrier with another mu."""
        return dataclasses.replace(self, mu=mu)

    def complementarity(self) -> float:
        """The largest |z gap - mu|."""
        return native.largest_miss(*self.arrays, self.mu)

    @property
    def boundary_fraction(self) -> float:
        """Largest fraction of a gap that one step takes."""
        return min(max(FRACTION_TO_BOUNDARY, 1.0 - self.mu / self.scale), LARGEST_FRACTION)

    def _clipped(self) -> Barrier:
        """Multipliers limited to a range around the central path, zero where there is no bound."""
        below, above = _gaps(self.bounds, self.s)
        low, high = self.mu / MAX_DUAL_RATIO, self.mu * MAX_DUAL_RATIO
        zl = np.where(self.bounds.has_lower, np.clip(self.zl, low / below, high / below), 0.0)
        zu = np.where(self.bounds.has_upper, np.clip(self.zu, low / above, high / above), 0.0)
        return dataclasses.replace(self, zl=zl, zu=zu)


def _changes(before: Array, now: Array) -> Array:
    """Changes of bounds; 0 of those that are infinite, or were."""
    finite = np.isfinite(before) & np.isfinite(now)
    change = np.zeros(len(now))
    np.subtract(now, before, out=change, where=finite)
    return change


def _gaps(bounds: Bounds, s: Array) -> Pair:
    """(s - lower, upper - s), at least the rounding unit; infinite where there is no bound."""
    return np.maximum(s - bounds.lower, LEAST_GAP), np.maximum(bounds.upper - s, LEAST_GAP)
