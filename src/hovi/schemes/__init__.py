"""Schemes: tables that turn a Lagrangian into a discrete Lagrangian.

This file lists them: a scheme in CLASSIC, or a family in FAMILIES, can be named in Python, scene
files, motion files and on the command line.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from hovi.checks.arguments import check_arguments
from hovi.errors import SchemeError, nearest
from hovi.schemes.classic import (
    hermite_simpson,
    mean_difference,
    taylor_midpoint,
    taylor_trapezoid,
    trapezoid_difference,
)
from hovi.schemes.galerkin_table import galerkin, is_galerkin, of_order
from hovi.schemes.interval_curve import end_basis, gamma, inverse_gamma
from hovi.schemes.regularity import is_regular, regularity_matrix, require_regular
from hovi.schemes.scheme import Scheme

CLASSIC: dict[str, Callable[[], Scheme]] = {
    "taylor-midpoint": taylor_midpoint,
    "taylor-trapezoid": taylor_trapezoid,
    "mean-difference": mean_difference,
    "trapezoid-difference": trapezoid_difference,
    "hermite-simpson": hermite_simpson,
}
FAMILIES: dict[str, Callable[[int, int, int | None], Scheme]] = {"galerkin": galerkin}
"""By the number of inner modes, the order of the Lagrangian and the number of points."""

_MEMBER = re.compile(r"(.+?)-(\d{1,4})(?:x(\d{1,4}))?(?:-k([1-9]))?")
"""FAMILY-R, FAMILY-RxQ and both with -kK."""


@check_arguments
def by_name(name: str) -> Scheme:
    """The scheme with a name, as in files and on the command line.

    name: one of CLASSIC; `FAMILY-R` with R inner modes, as `galerkin-2`; `FAMILY-RxQ` with Q
        points as well, as `galerkin-2x8`. Both with `-kK` for Lagrangians of an order other than 2.
    Raises SchemeError for an unknown name.
    """
    if name in CLASSIC:
        return CLASSIC[name]()
    match = _MEMBER.fullmatch(name)
    if match and match[1] in FAMILIES:
        points = None if match[3] is None else int(match[3])
        return FAMILIES[match[1]](int(match[2]), int(match[4] or 2), points)
    known = [*CLASSIC, *(f"{family}-{modes}" for family in FAMILIES for modes in range(4))]
    raise SchemeError(f"there is no scheme {name!r}: {nearest(name, known)}")


__all__ = [
    "CLASSIC",
    "FAMILIES",
    "Scheme",
    "by_name",
    "end_basis",
    "galerkin",
    "gamma",
    "hermite_simpson",
    "inverse_gamma",
    "is_galerkin",
    "is_regular",
    "mean_difference",
    "of_order",
    "regularity_matrix",
    "require_regular",
    "taylor_midpoint",
    "taylor_trapezoid",
    "trapezoid_difference",
]
