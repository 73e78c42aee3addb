"""The Galerkin family: a table for every number of inner modes."""

from __future__ import annotations

import numpy as np

from hovi.errors import SchemeError
from hovi.schemes.polynomials import interval_rows
from hovi.schemes.scheme import Scheme

MAX_INNER_MODES = 40


def galerkin(inner_modes: int = 2) -> Scheme:
    """Polynomial acceleration with r inner modes, integrated with r + 2 Gauss points.

    The order of the nodes is 2 (r + 2): 4, 6, 8, 10, ...

    inner_modes: r, from 0 to 40. Raises SchemeError outside.
    """
    if not (isinstance(inner_modes, int) and 0 <= inner_modes <= MAX_INNER_MODES):
        raise SchemeError(
            f"a Galerkin scheme has 0 to {MAX_INNER_MODES} inner modes, got {inner_modes!r}; "
            "for more accuracy use more intervals."
        )
    x, w = np.polynomial.legendre.leggauss(inner_modes + 2)
    points, weights = (x + 1) / 2, w / 2
    table = interval_rows(points, inner_modes)
    return Scheme(f"galerkin-{inner_modes}", 2 * (inner_modes + 2), points, weights, table)
