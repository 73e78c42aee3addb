"""The Galerkin family: a table for every number of inner modes and order of the Lagrangian."""

from __future__ import annotations

from functools import cache
from numbers import Integral

import numpy as np

from hovi.errors import SchemeError
from hovi.schemes.interval_curve import jet_rows
from hovi.schemes.polynomials import interval_rows
from hovi.schemes.scheme import Scheme

MAX_INNER_MODES = 40
MAX_DERIVATIVES = 4


def galerkin(inner_modes: int = 2, derivatives: int = 2) -> Scheme:
    """A polynomial k-th derivative with r inner modes, and r + k Gauss points.

    The order at the nodes is 2 (r + k): 4, 6, 8, 10, ... for k = 2.

    inner_modes: r, from 0 to 40. derivatives: k, the order of the Lagrangian, from 1 to 4: 1 for
        mechanics, 2 for torques and accelerations, 3 for jerk. Raises SchemeError otherwise.
    """
    if not (isinstance(inner_modes, Integral) and 0 <= inner_modes <= MAX_INNER_MODES):
        raise SchemeError(
            f"a Galerkin scheme has 0 to {MAX_INNER_MODES} inner modes, got {inner_modes!r}; "
            "for more accuracy use more intervals."
        )
    if not (isinstance(derivatives, Integral) and 1 <= derivatives <= MAX_DERIVATIVES):
        raise SchemeError(
            f"a Galerkin scheme is for Lagrangians of order 1 to {MAX_DERIVATIVES}, "
            f"got {derivatives!r}."
        )
    return _table(int(inner_modes), int(derivatives))


@cache
def _table(inner_modes: int, derivatives: int) -> Scheme:
    """The scheme, cached since schemes are immutable."""
    x, w = np.polynomial.legendre.leggauss(inner_modes + derivatives)
    points, weights = (x + 1) / 2, w / 2
    order = 2 * (inner_modes + derivatives)
    if derivatives == 2:
        table = interval_rows(points, inner_modes)
        return Scheme(f"galerkin-{inner_modes}", order, points, weights, table)
    table = jet_rows(points, derivatives, inner_modes)
    return Scheme(f"galerkin-{inner_modes}-k{derivatives}", order, points, weights, table)
