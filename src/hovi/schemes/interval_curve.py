"""The curve of an interval for Lagrangians of any order k: basis b^[k], matrix gamma^[k], rows.

[ColomboFerraroMartin2016, section 2]. With Q^[k](s) = h^k q^(k) the k-th derivative on [0, 1], the
end data fix exactly its moments w_j = <b_j, Q^[k]>, j < k. The rest of the curve is in the
orthogonal complement, spanned by the next Legendre polynomials, the inner modes (the paper's E and
E-perp).
"""

from __future__ import annotations

from functools import cache
from math import factorial

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.checks.shapes import require_shape
from hovi.errors import InputError, SchemeError
from hovi.schemes.polynomials import legendre

Array = npt.NDArray[np.float64]

MAX_ORDER = 20
"""Maximum order k of a Lagrangian whose curves have a basis here."""
MAX_POSITION = 1e3
"""Largest |s| to which polynomials on [0, 1] are extrapolated: their powers stay finite."""


def end_degrees(k: int) -> list[int]:
    """Degrees of b^[k]_0 .. b^[k]_{k-1}, in descending order like those of a^[k]_j."""
    return [k - 1 - j for j in range(k)]


@check_arguments
def end_basis(s: Array, k: int) -> Array:
    """The paper's b^[k]_j(s) = sqrt(2 m + 1) P_m(1 - 2 s), m = k - 1 - j, shape (k, M).

    Orthonormal on [0, 1]; b^[2] = (sqrt(3) (1 - 2 s), 1).
    s: shape (M,). Raises InputError for positions beyond MAX_POSITION.
    """
    _require_order(k)
    require_positions(s)
    P = legendre(1 - 2 * s, max(k - 1, 1))
    return np.array([np.sqrt(2 * m + 1) * P[m] for m in end_degrees(k)])


def require_positions(s: Array) -> None:
    """Raise InputError unless s holds positions of an interval, shape (M,)."""
    require_shape("s", s, None)
    beyond = ~(np.abs(s) <= MAX_POSITION)
    if beyond.any():
        raise InputError(
            "positions s in an interval go from 0 to 1, and are extrapolated up to "
            f"{MAX_POSITION:g}, got {s[beyond][0]:g}: give the time since its start over its "
            "length."
        )


def end_weights(s: Array, k: int) -> Array:
    """The paper's a^[k]_j(s) = (1 - s)^(k-j-1) / (k-j-1)!, with z_j = <a_j, Q^[k]>, (k, M)."""
    s = np.asarray(s, dtype=np.float64)
    return np.array([(1 - s) ** m / factorial(m) for m in end_degrees(k)])


@check_arguments
def gamma(k: int) -> Array:
    """gamma[j, i] of a^[k]_j = sum_i gamma[j, i] b^[k]_i, so that z = gamma w, shape (k, k).

    With d = k - 1 - j and m = k - 1 - i it is sqrt(2 m + 1) d! / ((d - m)! (d + m + 1)!), and 0
    where m > d. gamma^[2] = [[1 / (2 sqrt(3)), 1/2], [0, 1]].
    """
    _require_order(k)
    matrix = np.zeros((k, k))
    for j, d in enumerate(end_degrees(k)):
        for i, m in enumerate(end_degrees(k)):
            if m <= d:
                scale = factorial(d) / (factorial(d - m) * factorial(d + m + 1))
                matrix[j, i] = np.sqrt(2 * m + 1) * scale
    return matrix


@check_arguments
def inverse_gamma(k: int) -> Array:
    """The matrix of w = gamma^-1 z, (k, k); for k = 2: w0 = 2 sqrt(3) (z0 - z1/2), w1 = z1."""
    return np.asarray(np.linalg.inv(gamma(k)))


def _require_order(k: int) -> None:
    if not 1 <= k <= MAX_ORDER:
        raise SchemeError(f"the order k of a curve must be from 1 to {MAX_ORDER}, got {k}.")


def repeated_integral(coefficients: Array, times: int) -> Array:
    """Legendre coefficients of the m-fold integral from 0, in x = 2 s - 1, of a Legendre series.

    The integral of P_j is (P_{j+1} - P_{j-1}) / (2 (2 j + 1)), for j = 0 it is (P_0 + P_1) / 2.
    There is no cancellation, as there would be with monomials.
    coefficients: shape (degree + 1,). Returns shape (degree + 1 + times,).
    """
    for _ in range(times):
        integral = np.zeros(len(coefficients) + 1)
        for j, c in enumerate(coefficients):
            integral[j + 1] += c / (2 * (2 * j + 1))
            integral[max(j - 1, 0)] += c / 2 if j == 0 else -c / (2 * (2 * j + 1))
        coefficients = integral
    return coefficients


def jet_rows(s: Array, k: int, inner_modes: int, highest: int | None = None) -> Array:
    """(q - q0, h q', ..., h^k q^(k)) at s over (h q0', ..., h^(k-1) q0^(k-1), Z, c).

    Z_j = h^k z_j, j < k, are the regularized end data and c the inner modes.
    s: shape (M,). highest: the highest derivative, k or more; k when None.
    Returns shape (M, highest + 1, 2 k - 1 + r).
    """
    s, top = np.asarray(s, dtype=np.float64), k if highest is None else highest
    taylor = [_taylor_column(s, top, i) for i in range(1, k)]
    first = np.stack(taylor, axis=2) if taylor else np.zeros((len(s), top + 1, 0))
    series = curve_series(k, inner_modes, top)
    modes = legendre(2 * s - 1, len(series) - 1).T @ series.reshape(len(series), -1)
    return np.concatenate([first, modes.reshape(len(s), *series.shape[1:])], axis=2)


@cache
def curve_series(k: int, inner_modes: int, top: int) -> Array:
    """Legendre coefficients of the columns of (Z, c) in each derivative, (D, top + 1, k + r)."""
    degrees = end_degrees(k)
    columns = [
        _mode_series(k, m, top, k + inner_modes) for m in (*degrees, *range(k, k + inner_modes))
    ]
    series = np.stack(columns, axis=2)
    signs = np.array([(-1.0) ** m for m in degrees])
    series[:, :, :k] = (signs * series[:, :, :k]) @ inverse_gamma(k)
    return series


def _taylor_column(s: Array, top: int, i: int) -> Array:
    """Coefficients of h^i q0^(i) in each derivative: s^(i-j) / (i-j)!, shape (M, top + 1)."""
    column = np.zeros((len(s), top + 1))
    for j in range(i + 1):
        column[:, j] = s ** (i - j) / factorial(i - j)
    return column


def _mode_series(k: int, degree: int, top: int, modes: int) -> Array:
    """Of the k integrals of sqrt(2 m + 1) P_m(2 s - 1), the k-fold one first, (k + modes, top + 1).

    Derivatives of the polynomial itself follow where top > k. degree: m, less than modes.
    """
    own = np.zeros(degree + 1)
    own[degree] = np.sqrt(2 * degree + 1)
    series = np.zeros((k + modes, top + 1))
    for j in range(top + 1):
        terms: Array = repeated_integral(own, max(k - j, 0))
        if j > k:
            terms = np.asarray(2.0 ** (j - k) * np.polynomial.legendre.legder(own, j - k))
        series[: len(terms), j] = terms
    return series
