"""Orthonormal shifted Legendre polynomials on [0, 1], their integrals, and an interval's curve.

[ColomboFerraroMartin2016, section 2 and appendix]: the acceleration is written in the basis
b_j; the first two coefficients are fixed by the end data, the others are inner modes, which
leave both ends alone.
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


def inner_mode_rows(s: Array, j: int) -> Array:
    """(double integral, integral, value) of b_j at s, for j >= 2, shape (M, 3).

    Integrals come from P_{j+1} - P_{j-1}: integrating monomials would move the end velocity by
    3e-10 at b_10 and by 5e-3 at b_20.
    """
    P = legendre(2 * s - 1, j + 2)
    once = (P[j + 1] - P[j - 1]) / (2 * (2 * j + 1))
    upper = (P[j + 2] - P[j]) / (2 * (2 * j + 3))
    lower = (P[j] - P[j - 2]) / (2 * (2 * j - 1))
    twice = (upper - lower) / (2 * (2 * j + 1))
    rows = np.sqrt(2 * j + 1) * np.stack([twice, once, P[j]], axis=1)
    return np.asarray(rows)


def interval_rows(s: Array, inner_modes: int) -> Array:
    """(q - q0, h v, h^2 a) at s over (h v0, Z0, Z1, c_2, c_3, ...), shape (M, 3, 3 + r).

    h^2 a(s) = Z1 b_1(s) + 2 sqrt(3) (Z0 - Z1/2) b_0(s) + sum_j c_j b_j(s), with b_1 = 1 and
    b_0 = sqrt(3) (1 - 2 s); h v and q follow by integration from (q0, h v0).
    """
    s = np.asarray(s, dtype=np.float64)
    zero, one = np.zeros_like(s), np.ones_like(s)
    velocity = np.stack([s, one, zero], axis=1)
    Z0 = np.stack([s**2 * (3 - 2 * s), 6 * s * (1 - s), 6 - 12 * s], axis=1)
    Z1 = np.stack([s**2 * (s - 1), s * (3 * s - 2), 6 * s - 2], axis=1)
    modes = [inner_mode_rows(s, j) for j in range(2, 2 + inner_modes)]
    return np.stack([velocity, Z0, Z1, *modes], axis=2)
