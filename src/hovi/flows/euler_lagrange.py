"""Discrete Euler-Lagrange equations and the flows that they define.

[ColomboFerraroMartin2016, sections 3 and 4, theorem 2 and its corollary]

Points of T^(k-1)Q and momenta have shape (B, k, n) or (k, n); points on groups are rows.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.flows.interval import IntervalLagrangian
from hovi.flows.legendre_transforms import (
    batch,
    inverse_legendre_minus,
    inverse_legendre_plus,
    legendre_minus,
    legendre_plus,
    unbatched,
)
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Form = Literal["plus", "minus", "momentum"]


@dataclass(frozen=True, eq=False)
class Regularity:
    """Regularity of L_d, that is whether end points determine a motion: W_d = [D_{i, k+j} L_d].

    matrix: shape (B, k n, k n). determinant: (B,). condition: (B,), in the 2-norm, of the unscaled
    W_d, whose blocks have different powers of h.
    """

    matrix: Array
    determinant: Array
    condition: Array


@check_arguments
def regularity(ld: IntervalLagrangian, x0: Array, x1: Array) -> Regularity:
    """W_d at (x0, x1), with determinant and condition.

    For k = 2 its leading terms are D13 = -12/h^3 W, D14 = 6/h^2 W, D23 = -6/h^2 W, D24 = 2/h W, and
    det W_d = (12/h^4)^n det(W)^2, with W = d2L/da2.
    """
    matrix = ld.joining(batch(x0), batch(x1)).regularity_matrix
    return Regularity(matrix, np.linalg.det(matrix), np.linalg.cond(matrix))


@check_arguments
def euler_lagrange_residual(ld: IntervalLagrangian, x0: Array, x1: Array, x2: Array) -> Array:
    """D_{i+k} L_d(x0, x1) + D_i L_d(x1, x2), i = 1 .. k, which is F^+ - F^-; shape as momenta."""
    return legendre_plus(ld, x0, x1)[1] - legendre_minus(ld, x1, x2)[1]


@check_arguments
def discrete_lagrangian_map(ld: IntervalLagrangian, x0: Array, x1: Array) -> tuple[Array, Array]:
    """F_{L_d} = (F^-)^-1 o F^+: (x0, x1) -> (x1, x2)."""
    return inverse_legendre_minus(ld, *legendre_plus(ld, x0, x1))


@check_arguments
def discrete_hamiltonian_flow(
    ld: IntervalLagrangian, x0: Array, p0: Array, form: Form = "momentum"
) -> tuple[Array, Array]:
    """The discrete Hamiltonian flow (x0, p0) -> (x1, p1) on T*T^(k-1)Q, in three forms.

    "momentum": F^+ o (F^-)^-1, the steps of `flow`.
    "plus": F^+ o F_{L_d} o (F^+)^-1. "minus": F^- o F_{L_d} o (F^-)^-1.
    They are equal [ColomboFerraroMartin2016, corollary to theorem 2].
    """
    if form == "momentum":
        interval = ld.from_start(batch(x0), batch(p0))
        return unbatched(x0, interval.x1), unbatched(x0, interval.p1)
    if form == "plus":
        ends = discrete_lagrangian_map(ld, *inverse_legendre_plus(ld, x0, p0))
        return legendre_plus(ld, *ends)
    ends = discrete_lagrangian_map(ld, *inverse_legendre_minus(ld, x0, p0))
    return legendre_minus(ld, *ends)
