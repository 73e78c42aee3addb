"""Regularity of a scheme: the matrix W_d of the paper for L = 1/2 |a|^2."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.errors import SchemeError
from hovi.schemes.scheme import Scheme, regular_from_nodal

Array = npt.NDArray[np.float64]


@check_arguments
def regularity_matrix(scheme: Scheme) -> Array:
    """W_d = [[D13, D14], [D23, D24]] L_d for L = a^2/2, n = 1 and h = 1, shape (2, 2).

    With a step h the determinant is 12/h^4 for Galerkin schemes, 4/h^4 for the Taylor schemes, and
    0 for a table that is not regular.
    [ColomboFerraroMartin2016, section 4]
    """
    r = scheme.inner_modes
    acceleration = scheme.regular_table[:, 2]  # (Q, 4 + r)
    K = (acceleration.T * scheme.weights) @ acceleration
    if r:
        K = K[:4, :4] - K[:4, 4:] @ np.linalg.solve(K[4:, 4:], K[4:, :4])
    R = regular_from_nodal(0)
    H = R.T @ K @ R
    return np.asarray(H[:2, 2:])


@check_arguments
@lru_cache(maxsize=256)
def is_regular(scheme: Scheme) -> bool:
    """Whether W_d is invertible, that is whether end data determine a discrete motion."""
    return bool(np.linalg.matrix_rank(regularity_matrix(scheme), tol=1e-10) == 2)


@check_arguments
def require_regular(scheme: Scheme) -> None:
    """Raise SchemeError for a scheme that does not support planning."""
    if scheme.derivatives != 2:
        raise SchemeError(
            f"scheme {scheme.name!r} is for Lagrangians of order {scheme.derivatives}; torques "
            "need a scheme for order 2."
        )
    if not is_regular(scheme):
        rank = np.linalg.matrix_rank(regularity_matrix(scheme), tol=1e-10)
        raise SchemeError(
            f"scheme {scheme.name!r} is not regular: its matrix W_d for 1/2 |a|^2 has rank {rank} "
            "instead of 2, so positions and velocities are decoupled and the minimum cost tends to "
            "zero; use a Galerkin or a Taylor scheme."
        )
