"""The logarithmic barrier of slacks between bounds, and their multipliers."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

INITIAL_MARGIN = 1e-2
"""Minimum distance of an initial slack from its bounds, relative to the range."""
WARM_START_MARGIN = 1e-5
"""The same for a warm start."""
MAX_DUAL_RATIO = 1e8
"""Largest ratio, either way, of a multiplier and mu over its gap."""
MIN_GAP = 1e-16
"""Minimum gap between a slack and its bound: the rounding unit at a bound of one."""
FRACTION_TO_BOUNDARY = 0.99
"""Largest share of the distance to a bound in one step while mu is large."""


@dataclass(frozen=True, eq=False)
class Bounds:
    """lower <= y <= upper for outputs in units of their ranges; infinite where unbounded.

    lower, upper: shape (P, K). weights: of the points, shape (P, 1).
    """

    lower: Array
    upper: Array
    weights: Array

    @property
    def has_lower(self) -> Mask:
        """Where there is a lower bound."""
        return np.isfinite(self.lower)

    @property
    def has_upper(self) -> Mask:
        """Where there is an upper bound."""
        return np.isfinite(self.upper)


@dataclass(frozen=True, eq=False)
class Barrier:
    """-mu sum weights (log(s - lower) + log(upper - s)), with multipliers zl, zu of the slacks.

    s, zl, zu: shape (P, K); a multiplier is zero where there is no bound.
    scale: the objective's mean density, to which mu is compared.
    """

    bounds: Bounds
    s: Array
    zl: Array
    zu: Array
    mu: float
    scale: float

    @classmethod
    def central(cls, bounds: Bounds, y: Array, mu: float) -> Barrier:
        """Slacks at y, clipped to a margin inside the bounds; multipliers on the central path."""
        s = np.clip(y, *_interior(bounds, INITIAL_MARGIN))
        below, above = _gaps(bounds, s)
        return cls(bounds, s, mu / below, mu / above, mu, 10.0 * mu)._clipped()

    def warm(self, bounds: Bounds, y: Array, mu: float) -> Barrier:
        """A warm start from this solution, for bounds that changed little."""
        s = np.clip(y, *_interior(bounds, WARM_START_MARGIN))
        below, above = _gaps(bounds, s)
        zl, zu = np.maximum(self.zl, mu / below), np.maximum(self.zu, mu / above)
        return dataclasses.replace(self, bounds=bounds, s=s, zl=zl, zu=zu, mu=mu)._clipped()

    @property
    def sigma(self) -> Array:
        """zl/(s - lower) + zu/(upper - s)."""
        below, above = _gaps(self.bounds, self.s)
        return self.zl / below + self.zu / above

    @property
    def gradient(self) -> Array:
        """mu/(upper - s) - mu/(s - lower)."""
        below, above = _gaps(self.bounds, self.s)
        return self.mu * (1 / above - 1 / below)

    @property
    def multipliers(self) -> Array:
        """zu - zl, the force that the bounds exert on the outputs."""
        return self.zu - self.zl

    def value(self, weights: Array, s: Array | None = None) -> float:
        """The barrier function at its own or other slacks."""
        below, above = _gaps(self.bounds, self.s if s is None else s)
        finite = _log(below) + _log(above)
        return -self.mu * float(np.sum(weights * finite))

    def merit(self, weights: Array, y: Array, penalty: float) -> float:
        """The barrier plus penalty sum weights |y - s|."""
        return self.value(weights) + penalty * float(np.sum(weights * np.abs(y - self.s)))

    def dual_step(self, ds: Array) -> tuple[Array, Array]:
        """The Newton step of zl and zu that belongs to a step ds of the slacks."""
        below, above = _gaps(self.bounds, self.s)
        dzl = (self.mu - self.zl * ds) / below - self.zl
        dzu = (self.mu + self.zu * ds) / above - self.zu
        return np.where(self.zl > 0, dzl, 0.0), np.where(self.zu > 0, dzu, 0.0)

    def max_share(self, ds: Array) -> float:
        """Largest share of ds, at most 1, within the fraction to the boundary of every gap."""
        below, above = _gaps(self.bounds, self.s)
        return min(
            1.0, self._boundary_fraction() * min(_max_share(below, ds), _max_share(above, -ds))
        )

    def moved(self, ds: Array, dzl: Array, dzu: Array, share: float) -> Barrier:
        """Slacks moved by a share of ds, multipliers as far as they stay positive."""
        keep = self._boundary_fraction()
        dual = min(1.0, keep * min(_max_share(self.zl, dzl), _max_share(self.zu, dzu)))
        zl, zu = self.zl + dual * dzl, self.zu + dual * dzu
        return dataclasses.replace(self.with_slacks(ds, share), zl=zl, zu=zu)._clipped()

    def with_slacks(self, ds: Array, share: float) -> Barrier:
        """Slacks moved by a share of ds, each within the fraction to the boundary."""
        below, above = _gaps(self.bounds, self.s)
        keep = self._boundary_fraction()
        step = np.clip(share * ds, -keep * below, keep * above)
        return dataclasses.replace(self, s=self.s + step)

    def with_reset_slacks(self, y: Array, penalty: float) -> Barrier:
        """s = y wherever y is inside the bounds and the merit function decreases."""
        below, above = _gaps(self.bounds, y)
        inside = (below > MIN_GAP) & (above > MIN_GAP)
        here_below, here_above = _gaps(self.bounds, self.s)
        here = penalty * np.abs(y - self.s) - self.mu * (_log(here_below) + _log(here_above))
        there = -self.mu * (_log(np.where(inside, below, 1)) + _log(np.where(inside, above, 1)))
        s = np.where(inside & (there < here), y, self.s)
        return dataclasses.replace(self, s=s)._clipped()

    def with_mu(self, mu: float) -> Barrier:
        """The barrier with another mu."""
        return dataclasses.replace(self, mu=mu)

    def complementarity(self) -> float:
        """The largest |z s - mu|."""
        below, above = _gaps(self.bounds, self.s)
        has = np.stack([self.bounds.has_lower, self.bounds.has_upper])
        gaps = np.where(has, np.stack([below, above]), 0.0)
        products = np.stack([self.zl, self.zu]) * gaps
        return float(np.max(np.abs(products - self.mu), where=has, initial=0.0))

    def _boundary_fraction(self) -> float:
        return max(FRACTION_TO_BOUNDARY, 1.0 - self.mu / self.scale)

    def _clipped(self) -> Barrier:
        """Multipliers limited to a range around the central path, zero where there is no bound."""
        below, above = _gaps(self.bounds, self.s)
        low, high = self.mu / MAX_DUAL_RATIO, self.mu * MAX_DUAL_RATIO
        zl = np.where(self.bounds.has_lower, np.clip(self.zl, low / below, high / below), 0.0)
        zu = np.where(self.bounds.has_upper, np.clip(self.zu, low / above, high / above), 0.0)
        return dataclasses.replace(self, zl=zl, zu=zu)


def _gaps(bounds: Bounds, s: Array) -> tuple[Array, Array]:
    """(s - lower, upper - s), at least MIN_GAP; infinite where there is no bound."""
    return np.maximum(s - bounds.lower, MIN_GAP), np.maximum(bounds.upper - s, MIN_GAP)


def _interior(bounds: Bounds, share: float) -> tuple[Array, Array]:
    return bounds.lower + share, bounds.upper - share


def _log(gap: Array) -> Array:
    """log of a gap; 0 where there is no bound."""
    return np.asarray(np.log(np.where(np.isfinite(gap), gap, 1.0)))


def _max_share(gap: Array, change: Array) -> float:
    """Largest share of a change that keeps all gaps nonnegative."""
    falling = change < 0
    ratio = np.where(falling, gap, np.inf) / np.where(falling, -change, 1.0)
    return float(ratio.min(initial=np.inf))
