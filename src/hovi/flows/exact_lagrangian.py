"""The exact discrete Lagrangian: the action of the exact solution between two points.

[ColomboFerraroMartin2016, section 3]: L_d^e(x0, x1) = integral of L along the solution of the
Euler-Lagrange equations with these ends. The degree of the curve is raised until it converges.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from hovi.checks.arguments import check_arguments
from hovi.checks.shapes import require_shape
from hovi.errors import InputError
from hovi.flows.charted_interval import ChartedInterval
from hovi.flows.charted_lagrangian import ChartedLagrangian
from hovi.flows.interval import Interval, IntervalLagrangian, flat
from hovi.flows.scheme_lagrangian import SchemeLagrangian, check_step
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import Scheme, galerkin
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

AnyInterval = Interval | ChartedInterval
Approximation = SchemeLagrangian | ChartedLagrangian

INNER_MODES = (4, 7, 10, 14, 19, 25, 32, 40)
"""Numbers of inner modes, in the order in which they are tried."""


@check_arguments
@dataclass(frozen=True, eq=False)
class ExactDiscreteLagrangian(IntervalLagrangian):
    """L_d^e to a tolerance, with all its derivatives; on groups for k = 1 and 2.

    lagrangian: L on T^(k)Q. h: in [s]. tolerance: of the ends, and of the regularized momenta (for
        k = 2 h p and p~ - h p), relative to the largest.
    It belongs to the solution that exists for small h. InputError is raised if h is beyond its
    first conjugate point, or if the tolerance is not reached.
    """

    lagrangian: Lagrangian
    h: float
    tolerance: float = 1e-12

    def __post_init__(self) -> None:
        check_step(self.h)

    def between(self, x0: Array, w: Array, t0: float = 0.0) -> AnyInterval:
        """The exact solution with given ends, in regularized coordinates."""
        return self._raised(lambda ld: ld.between(x0, w, t0))

    def joining(self, x0: Array, x1: Array, t0: float = 0.0) -> AnyInterval:
        """The exact solution between two points of T^(k-1)Q."""
        return self._raised(lambda ld: ld.joining(x0, x1, t0))

    def from_start(
        self, x0: Array, p0: Array, t0: float = 0.0, guess: AnyInterval | None = None
    ) -> AnyInterval:
        """The exact solution that starts at (x0, p0): F_H, by theorem 3; `guess` is not used."""
        return self._raised(lambda ld: ld.from_start(x0, p0, t0))

    def from_end(self, x1: Array, p1: Array, t0: float = 0.0) -> AnyInterval:
        """The exact solution that ends at (x1, p1)."""
        return self._raised(lambda ld: ld.from_end(x1, p1, t0))

    def _raised(self, solve: Callable[[Approximation], AnyInterval]) -> AnyInterval:
        """Raise the degree until the ends and their momenta stop changing."""
        before: AnyInterval | None = None
        for inner_modes in INNER_MODES:
            table = _table(inner_modes, self.k)
            interval = solve(approximation(self.lagrangian, table, self.h))
            if before is not None and _change(before, interval) <= self.tolerance:
                _refuse_conjugate_points(interval)
                return interval
            before = interval
        raise InputError(
            f"the exact discrete Lagrangian did not converge to {self.tolerance:g} at "
            f"h = {self.h:g} s with {INNER_MODES[-1]} inner modes; use a shorter step or a larger "
            "tolerance."
        )


def approximation(lagrangian: Lagrangian, scheme: Scheme, h: float) -> Approximation:
    """L_d of a scheme on one interval, on a vector space or on a group."""
    space = lagrangian.space
    if space is None:
        return SchemeLagrangian(lagrangian, scheme, h)
    return ChartedLagrangian(lagrangian, space, scheme, h)


@check_arguments
def conjugate_time(lagrangian: Lagrangian, x0: Array, p0: Array, longest: float) -> float:
    """The first conjugate point along a solution, the upper bound of h of L_d^e, in [s].

    By Morse's index theorem the action between fixed ends is a minimum up to it; there, the
    smallest eigenvalue of the inner modes' Hessian is zero.
    x0, p0: start, shape (k, n); on groups x0 is a row (1, nq + (k - 1) nv).
    longest: end of the search, in [s]. Returns inf if there is none.
    Raises InputError for other shapes, and a `longest` that is not positive.
    """
    k, n = lagrangian.order, lagrangian.nv
    shape = (k, n) if lagrangian.space is None else (1, lagrangian.nq + (k - 1) * n)
    require_shape("x0", x0, *shape)
    require_shape("p0", p0, k, n)
    if not 0 < longest < np.inf:
        raise InputError(f"longest must be positive and finite, in seconds, got {longest}.")
    scheme = _table(INNER_MODES[-1], lagrangian.order)

    def least(h: float) -> float:
        interval = approximation(lagrangian, scheme, h).from_start(x0[None], p0[None])
        return float(_inner_eigenvalues(interval)[0, 0])

    h = longest / 16
    while least(h) > 0:
        if h >= longest:
            return float("inf")
        h = min(1.25 * h, longest)
    return float(brentq(least, h / 1.25 if h > longest / 16 else longest * 1e-3, h, xtol=1e-12))


def _change(before: AnyInterval, after: AnyInterval) -> float:
    """The relative change by a higher degree, of the derivatives of phi in (h x0, w) and the ends.

    On groups of L_d in (q0, h v0, q1, h v1).
    """
    old, new = before.scaled_momenta, after.scaled_momenta
    size = np.abs(new).max(axis=(1, 2), keepdims=True)
    changes = [np.max(np.abs(new - old) / np.where(size > 0, size, 1.0))]
    for old, new in ((before.x0, after.x0), (before.x1, after.x1)):
        changes.append(np.max(np.abs(new - old)) / max(1.0, np.max(np.abs(new))))
    return float(max(changes))


def _refuse_conjugate_points(interval: AnyInterval) -> None:
    negative = _inner_eigenvalues(interval) < 0
    r = interval.inner.shape[1]
    last = interval.hessian[:, -1, -1]
    indefinite = np.sum(np.linalg.eigvalsh((last + last.transpose(0, 2, 1)) / 2) < 0, axis=1)
    passed = int(np.max(np.sum(negative, axis=1) - r * indefinite))
    if passed > 0:
        raise InputError(
            f"h = {interval.h:g} s is too long for the exact discrete Lagrangian: {passed} "
            "conjugate point(s) lie before its end, so the solution between the two ends does not "
            "minimize the action; use a shorter step."
        )


def _inner_eigenvalues(interval: AnyInterval) -> Array:
    m = 2 * interval.k * interval.w.shape[2]
    inner = flat(interval.hessian)[:, m:, m:]
    return np.asarray(np.linalg.eigvalsh((inner + inner.transpose(0, 2, 1)) / 2))


@lru_cache(maxsize=64)
def _table(inner_modes: int, k: int) -> Scheme:
    return galerkin(inner_modes, k)
