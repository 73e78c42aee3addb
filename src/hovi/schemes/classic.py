"""The tables of the paper's discrete Lagrangians and of Hermite-Simpson.

Columns are (h v0, Z0, Z1), with Z0 = q1 - q0 - h v0 and Z1 = h v1 - h v0. The Taylor
accelerations of the paper are a0 = 2/h^2 (q1 - q0 - h v0), so h^2 a0 = 2 Z0, and
a1 = 2/h^2 (q0 - q1 + h v1), so h^2 a1 = 2 (Z1 - Z0).
"""

from __future__ import annotations

import numpy as np

from hovi.schemes.polynomials import interval_rows
from hovi.schemes.scheme import Scheme

Row = tuple[float, float, float]

_FIRST: tuple[Row, Row] = (0, 0, 0), (1, 0, 0)
_LAST: tuple[Row, Row] = (1, 1, 0), (1, 0, 1)
_MIDDLE: tuple[Row, Row] = (0.5, 0.5, 0), (1, 0, 0.5)
_TAYLOR_FIRST: Row = (0, 2, 0)
_TAYLOR_LAST: Row = (0, -2, 2)
_DIFFERENCE: Row = (0, 0, 1)


def _scheme(name: str, order: int, points: list[float], rows: list[list[Row]]) -> Scheme:
    """A scheme with equal weights and a table given by nested lists."""
    weights = np.full(len(points), 1 / len(points))
    return Scheme(name, order, np.array(points), weights, np.array(rows, dtype=np.float64))


def taylor_midpoint() -> Scheme:
    """Midpoints of q and v with both Taylor accelerations [ColomboFerraroMartin2016, section 5]."""
    rows = [[*_MIDDLE, _TAYLOR_FIRST], [*_MIDDLE, _TAYLOR_LAST]]
    return _scheme("taylor-midpoint", 2, [0.5, 0.5], rows)


def taylor_trapezoid() -> Scheme:
    """End points with Taylor accelerations: the spline example of section 3."""
    rows = [[*_FIRST, _TAYLOR_FIRST], [*_LAST, _TAYLOR_LAST]]
    return _scheme("taylor-trapezoid", 2, [0.0, 1.0], rows)


def mean_difference() -> Scheme:
    """h L((q0+q1)/2, (q1-q0)/h, (v1-v0)/h): in the paper, but not regular."""
    return _scheme("mean-difference", 0, [0.5], [[_MIDDLE[0], (1, 1, 0), _DIFFERENCE]])


def trapezoid_difference() -> Scheme:
    """End points with the acceleration (v1-v0)/h: in the paper, but not regular."""
    rows = [[*_FIRST, _DIFFERENCE], [*_LAST, _DIFFERENCE]]
    return _scheme("trapezoid-difference", 0, [0.0, 1.0], rows)


def hermite_simpson() -> Scheme:
    """The cubic through the end data with Simpson's rule."""
    points = np.array([0.0, 0.5, 1.0])
    weights = np.array([1.0, 4.0, 1.0]) / 6
    return Scheme("hermite-simpson", 4, points, weights, interval_rows(points, 0))
