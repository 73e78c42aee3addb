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
    0 for a table that is not regular. For any order k it is of L = (q^(k))^2 / 2, shape (k, k).
    [ColomboFerraroMartin2016, section 4]
    """
    k = scheme.derivatives
    ends, highest = 2 * k, scheme.regular_table[:, k]  # (Q, 2 k + r)
    K = (highest.T * scheme.weights) @ highest
    if scheme.inner_modes:
        coupling = np.linalg.solve(K[ends:, ends:], K[ends:, :ends])
        K = K[:ends, :ends] - K[:ends, ends:] @ coupling
    R = regular_from_nodal(0, k)
    H = R.T @ K @ R
    return np.asarray(H[:k, k:])


@check_arguments
@lru_cache(maxsize=256)
def is_regular(scheme: Scheme) -> bool:
    """Whether W_d is invertible, that is whether end data determine a discrete motion."""
    rank = np.linalg.matrix_rank(regularity_matrix(scheme), tol=1e-10)
    return bool(rank == scheme.derivatives)


@check_arguments
def require_regular(scheme: Scheme) -> None:
    """Raise SchemeError for a scheme that does not support planning."""
    if not is_regular(scheme):
        rank = np.linalg.matrix_rank(regularity_matrix(scheme), tol=1e-10)
        raise SchemeError(
            f"scheme {scheme.name!r} is not regular: its matrix W_d for 1/2 |a|^2 has rank {rank} "
            "instead of 2, so positions and velocities are decoupled and the minimum cost tends to "
            "zero; use a Galerkin or a Taylor scheme."
        )
