"""Orthonormal shifted Legendre polynomials on [0, 1], their integrals, and an interval's curve.

[ColomboFerraroMartin2016, section 2 and appendix]: the acceleration is written in the basis
b_j; the first two coefficients are fixed by the end data, the others are inner modes, which do
not change the ends.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def legendre(x: Array, degree: int) -> Array:
    """P_0 .. P_degree at x in [-1, 1] by the three-term recursion, shape (degree + 1, M)."""
    P = np.ones((degree + 1, len(x)))
    if degree:
        P[1] = x
    for j in range(1, degree):
        P[j + 1] = ((2 * j + 1) * x * P[j] - j * P[j - 1]) / (j + 1)
    return P


def orthonormal_legendre(s: Array, count: int) -> Array:
    """The first shifted Legendre polynomials, orthonormal on [0, 1], at s, shape (count, M)."""
    degrees = np.arange(count)[:, None]
    return np.asarray(np.sqrt(2 * degrees + 1) * legendre(2 * s - 1, count - 1))


def inner_mode_rows(s: Array, inner_modes: int) -> Array:
    """(double integral, integral, value) of b_2, b_3, ... at s, shape (M, 3, r).

    Integrals are computed from P_{j+1} - P_{j-1}: with monomials, rounding would change the end
    velocity by 3e-10 at b_10 and by 5e-3 at b_20.
    """
    P = legendre(2 * s - 1, inner_modes + 3).T  # (M, r + 4)
    j = np.arange(2, 2 + inner_modes)
    middle, above, below = P[:, 2:-2], P[:, 4:], P[:, :-4]
    rows = np.empty((len(s), 3, inner_modes))
    upper = (above - middle) / (2 * (2 * j + 3))
    lower = (middle - below) / (2 * (2 * j - 1))
    rows[:, 0] = (upper - lower) / (2 * (2 * j + 1))
    rows[:, 1] = (P[:, 3:-1] - P[:, 1:-3]) / (2 * (2 * j + 1))
    rows[:, 2] = middle
    return rows * np.sqrt(2 * j + 1)


def interval_rows(s: Array, inner_modes: int) -> Array:
    """(q - q0, h v, h^2 a) at s over (h v0, Z0, Z1, c_2, c_3, ...), shape (M, 3, 3 + r).

    h^2 a(s) = Z1 b_1(s) + 2 sqrt(3) (Z0 - Z1/2) b_0(s) + sum_j c_j b_j(s), with b_1 = 1 and
    b_0 = sqrt(3) (1 - 2 s); h v and q follow by integration from (q0, h v0).
    """
    s = np.asarray(s, dtype=np.float64)
    rows = np.empty((len(s), 3, 3 + inner_modes))
    rows[:, 0, 0], rows[:, 1, 0], rows[:, 2, 0] = s, 1.0, 0.0
    rows[:, 0, 1], rows[:, 1, 1], rows[:, 2, 1] = s**2 * (3 - 2 * s), 6 * s * (1 - s), 6 - 12 * s
    rows[:, 0, 2], rows[:, 1, 2], rows[:, 2, 2] = s**2 * (s - 1), s * (3 * s - 2), 6 * s - 2
    if inner_modes:
        rows[:, :, 3:] = inner_mode_rows(s, inner_modes)
    return rows
