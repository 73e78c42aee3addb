"""Collocation tables: trapezoidal, Hermite-Simpson, Legendre-Gauss and Legendre-Gauss-Radau.

The dynamics are q' = v, v' = a with accelerations as unknowns. The states at the points of an
interval and its defects are linear in the end states and the accelerations.
[Kelly2017] [GargPattersonHager2010]
"""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import numpy.typing as npt

from hovi.errors import SchemeError, nearest
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

NAMES = ("trapezoidal", "hermite-simpson", *(f"{x}-{s}" for x in ("lg", "lgr") for s in (3, 4, 5)))


@dataclass(frozen=True, eq=False)
class CollocationTable:
    """One interval, in columns (node, inner accelerations, next node).

    A node is (q, h v) or, where its acceleration is an unknown too, (q, h v, h^2 a); inner
    accelerations are h^2 a.

    name: in NAMES. order: convergence order of the cost in h.
    node_size: 2 or 3. inner: times of the inner accelerations in [0, 1], shape (s,).
    points: rows (q, h v, h^2 a) of each inner quadrature point, shape (Q, 3, columns).
    weights: of these points, shape (Q,). end_weight: of the two nodes.
    defects: two rows that are zero on a motion, shape (2, columns).
    """

    name: str
    order: int
    node_size: int
    inner: Array
    points: Array
    weights: Array
    end_weight: float
    defects: Array


def collocation_table(name: str) -> CollocationTable:
    """The table with a name in NAMES. Raises SchemeError for other names."""
    match = re.fullmatch(r"(lgr?)-([1-9])", name)
    if match:
        return _gauss(name, int(match.group(2)), radau=match.group(1) == "lgr")
    if name in _NODAL:
        return _NODAL[name]()
    raise SchemeError(f"there is no collocation method {name!r}: {nearest(name, NAMES)}")


def _trapezoidal() -> CollocationTable:
    """q1 = q0 + h (v0 + v1)/2, v1 = v0 + h (a0 + a1)/2."""
    defects = np.array([[1, 0.5, 0, -1, 0.5, 0], [0, 1, 0.5, 0, -1, 0.5]])
    return CollocationTable(
        "trapezoidal", 2, 3, np.zeros(0), np.zeros((0, 3, 6)), np.zeros(0), 0.5, defects
    )


def _hermite_simpson() -> CollocationTable:
    """Simpson's rule for q and v, with midpoint values of Hermite cubics."""
    # q0, v0, a0, am, q1, v1, a1
    v = np.array([0, 0.5, 0.125, 0, 0, 0.5, -0.125])
    q = np.array([0.5, 0.125, 0, 0, 0.5, -0.125, 0])
    a = np.array([0, 0, 0, 1.0, 0, 0, 0])
    q_defect = np.array([1, 1 / 6, 0, 0, -1, 1 / 6, 0]) + 4 / 6 * v
    v_defect = np.array([0, 1, 1 / 6, 4 / 6, 0, -1, 1 / 6])
    middle = np.stack([q, v, a])[None]
    defects = np.stack([q_defect, v_defect])
    return CollocationTable(
        "hermite-simpson", 4, 3, np.array([0.5]), middle, np.array([4 / 6]), 1 / 6, defects
    )


_NODAL = {"trapezoidal": _trapezoidal, "hermite-simpson": _hermite_simpson}


def _gauss(name: str, s: int, radau: bool) -> CollocationTable:
    """s accelerations per interval; q and v at the points are eliminated as their integrals."""
    c = radau_points(s) if radau else (np.polynomial.legendre.leggauss(s)[0] + 1) / 2
    b, bb = (row[0] for row in lagrange_integrals(c, np.ones(1)))
    points = _points_on_curve(c, c)
    defects = np.zeros((2, s + 4))
    defects[0, :2], defects[1, 1] = 1.0, 1.0
    defects[0, 2:-2], defects[1, 2:-2] = bb, b
    defects[0, -2] = defects[1, -1] = -1.0
    return CollocationTable(name, 2 * s - radau, 2, c, points, b, 0.0, defects)


def with_points(table: CollocationTable, s: Array, weights: Array) -> CollocationTable:
    """The same curves with other quadrature points; those of weight 0 only sample limits.

    table: one whose accelerations are all inside the interval. s: points in [0, 1], shape (M,).
    weights: shape (M,). Raises SchemeError for tables with accelerations at the nodes.
    """
    if table.end_weight:
        raise SchemeError(
            f"{table.name!r} has quadrature points at the nodes, which cannot be replaced; use "
            "'lg-S' or 'lgr-S'."
        )
    points = _points_on_curve(table.inner, s)
    return dataclasses.replace(table, points=points, weights=weights)


def _points_on_curve(c: Array, s: Array) -> Array:
    """Rows (q, h v, h^2 a) at times s of curves with accelerations at c, (M, 3, len(c) + 4)."""
    points = np.zeros((len(s), 3, len(c) + 4))  # columns q0, v0, a_1 .. a_s, q1, v1
    points[:, 0, 0] = points[:, 1, 1] = 1.0
    points[:, 0, 1] = s
    points[:, 1, 2:-2], points[:, 0, 2:-2] = lagrange_integrals(c, s)
    vandermonde = np.polynomial.legendre.legvander
    degree = len(c) - 1
    to_values = np.linalg.solve(vandermonde(2 * c - 1, degree).T, vandermonde(2 * s - 1, degree).T)
    points[:, 2, 2:-2] = to_values.T
    return points


def radau_points(s: int) -> Array:
    """The s Radau points in (0, 1], the last of them 1: roots of P_s - P_{s-1}."""
    series = np.zeros(s + 1)
    series[s - 1 :] = -1.0, 1.0
    roots = np.polynomial.legendre.legroots(series)
    points = np.sort((np.real(roots) + 1) / 2)
    points[-1] = 1.0
    return points


def lagrange_integrals(c: Array, s: Array) -> tuple[Array, Array]:
    """Single and double integrals from 0 to s of the Lagrange polynomials of the points c.

    c: shape (n,). s: shape (M,). Returns two arrays of shape (M, n).
    """
    legendre = np.polynomial.legendre
    n = len(c)
    to_series = np.linalg.inv(legendre.legvander(2 * c - 1, n - 1))  # (n, n) coefficients by point
    single, double = np.empty((len(s), n)), np.empty((len(s), n))
    for j in range(n):
        first = legendre.legint(to_series[:, j], lbnd=-1, scl=0.5)
        single[:, j] = legendre.legval(2 * s - 1, first)
        double[:, j] = legendre.legval(2 * s - 1, legendre.legint(first, lbnd=-1, scl=0.5))
    return single, double
