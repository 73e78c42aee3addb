"""The functions of the compiled unit in NumPy and LAPACK, found where it was not built.

An extension module of this name beside this file is imported in its place.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.linalg.lapack import dpbtrf, dpbtrs

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

panel_columns = 4


def contract(
    table: Array,
    weights: Array,
    steps: Array,
    gradient: Array,
    hessian: Array,
    columns_gradient: Array,
    columns_hessian: Array,
    portable: bool = False,
) -> None:
    """Derivatives in the columns of the intervals: see hovi.optimize.contraction."""
    B, (Q, _, m), n = len(steps), table.shape, columns_gradient.shape[2]
    A = table / steps[:, None, None, None] ** np.arange(3)[:, None]  # (B, Q, 3, m)
    weighted = steps[:, None, None, None] * weights[:, None, None] * A
    rows = weighted.reshape(B, 3 * Q, m).transpose(0, 2, 1)
    columns_gradient[:] = np.matmul(rows, gradient.reshape(B, 3 * Q, n))
    blocks = hessian.reshape(B, Q, 3, n, 3, n).transpose(0, 1, 2, 4, 3, 5)
    pairs = np.einsum("bqri,bqsj->bijqrs", weighted, A).reshape(B, m * m, 9 * Q)
    products = np.matmul(pairs, blocks.reshape(B, 9 * Q, n * n))
    columns_hessian[:] = products.reshape(columns_hessian.shape)


def assemble(
    hessian: Array,
    starts: Index,
    positions: Index,
    lengths: Index,
    scales: Array | None,
    band: Array,
) -> None:
    """The sum of runs of a flat Hessian in a flat band."""
    within = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    values = hessian.reshape(-1)[np.repeat(starts, lengths) + within]
    if scales is not None:
        values = values * np.repeat(scales, lengths)
    places = np.repeat(positions, lengths) + within
    band[:] = np.bincount(places, values, minlength=band.size).reshape(band.shape)


def factor(
    band: Array,
    metric: Array,
    shift: float,
    rows: Index,
    size: int,
    out: Array,
    portable: bool = False,
) -> bool:
    """The Cholesky factor of band + shift metric in `out`; False where there is none."""
    lower = _lapack(band + shift * metric, size)
    result, info = dpbtrf(lower, lower=1)
    for k in range(panel_columns):
        columns = result[:, k::panel_columns]
        out[k:size:panel_columns, k:] = columns[: out.shape[1] - k].T
    return bool(info == 0)


def solve(factor: Array, rows: Index, rhs: Array, out: Array, portable: bool = False) -> None:
    """A^-1 rhs in `out` from a factor."""
    out[:] = dpbtrs(_lapack(factor, len(rhs)), rhs, lower=1)[0]


def _lapack(band: Array, size: int) -> Array:
    """LAPACK's lower band from columns that begin with the first row of their panel."""
    lower = np.zeros((band.shape[1], size), order="F")
    for k in range(panel_columns):
        lower[: band.shape[1] - k, k::panel_columns] = band[k:size:panel_columns, k:].T
    return lower
