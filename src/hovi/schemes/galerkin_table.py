"""The Galerkin family: a table for every number of inner modes and of points, and every order k."""

from __future__ import annotations

from functools import cache

import numpy as np

from hovi.checks.kinds import is_whole
from hovi.errors import SchemeError
from hovi.schemes.interval_curve import jet_rows
from hovi.schemes.polynomials import interval_rows
from hovi.schemes.scheme import Scheme

MAX_INNER_MODES = 40
MAX_DERIVATIVES = 4
MAX_POINTS = 100
"""Gauss points of an interval."""


def galerkin(inner_modes: int = 2, derivatives: int = 2, points: int | None = None) -> Scheme:
    """The scheme whose k-th derivative is a polynomial with r inner modes, with Q Gauss points.

    L_d = h sum_j w_j L(q(t_j), ..) over the Gauss points t_j of the interval. The degree of the
    curve and Q are chosen independently [OberBloebaumSaake2015]. The order at the nodes is
    2 (r + k) for every Q >= r + k: 4, 6, 8, 10, ... for k = 2. With Q = r + k an interval has as
    many points as its k-th derivative has coefficients, and on coarse grids the integrand may
    vanish at the points and swing between them; with more points the action is nearly the integral
    along the curve.

    inner_modes: r, from 0 to 40. derivatives: k, the order of the Lagrangian: 1 for mechanics, 2
        for torques and accelerations, 3 for jerk. points: Q, from r + k to 100; r + k when None.
    Raises SchemeError otherwise.
    """
    if not (is_whole(inner_modes) and 0 <= inner_modes <= MAX_INNER_MODES):
        raise SchemeError(
            f"a Galerkin scheme has 0 to {MAX_INNER_MODES} inner modes, got {inner_modes!r}; "
            "for more accuracy use more intervals."
        )
    if not (is_whole(derivatives) and 1 <= derivatives <= MAX_DERIVATIVES):
        raise SchemeError(
            f"a Galerkin scheme is for Lagrangians of order 1 to {MAX_DERIVATIVES}, "
            f"got {derivatives!r}."
        )
    fewest = int(inner_modes) + int(derivatives)
    points = fewest if points is None else points
    if not (is_whole(points) and fewest <= points <= MAX_POINTS):
        raise SchemeError(
            f"a Galerkin scheme with {inner_modes} inner modes has {fewest} to {MAX_POINTS} "
            f"quadrature points, got {points!r}."
        )
    return _table(int(inner_modes), int(derivatives), int(points))


@cache
def _table(inner_modes: int, derivatives: int, count: int) -> Scheme:
    """The scheme with `count` points, cached since schemes are immutable."""
    x, w = np.polynomial.legendre.leggauss(count)
    points, weights = (x + 1) / 2, w / 2
    fewest = inner_modes + derivatives
    name = f"galerkin-{inner_modes}" + (f"x{count}" if count > fewest else "")
    if derivatives == 2:
        return Scheme(name, 2 * fewest, points, weights, interval_rows(points, inner_modes))
    table = jet_rows(points, derivatives, inner_modes)
    return Scheme(f"{name}-k{derivatives}", 2 * fewest, points, weights, table)


def is_galerkin(scheme: Scheme) -> bool:
    """Whether a scheme is a member of the family: its action is that of its interpolant."""
    r, k, points = scheme.inner_modes, scheme.derivatives, len(scheme.points)
    known = 0 <= r <= MAX_INNER_MODES and k <= MAX_DERIVATIVES and r + k <= points <= MAX_POINTS
    return known and scheme.key == _table(r, k, points).key


def of_order(scheme: Scheme, k: int) -> Scheme:
    """The member of the family with as many inner modes for Lagrangians of order k.

    With as many quadrature points, if it has other ones than r + k. Other schemes are unchanged.
    """
    r, points = scheme.inner_modes, len(scheme.points)
    if scheme.derivatives == k or not is_galerkin(scheme):
        return scheme
    own = points == r + scheme.derivatives
    return galerkin(r, k, None if own else max(points, r + k))
