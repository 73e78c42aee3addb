"""Control points of an interval's curve: its Bernstein coefficients on parts of the interval.

On a part the curve is an average of its control points, with positive weights, and so lies between
the least and the largest of them; halving the part brings them four times nearer to it.
[Farin2002]
"""

from __future__ import annotations

from functools import cache, lru_cache
from math import comb

import numpy as np
import numpy.typing as npt

from hovi.schemes.interval_curve import jet_rows

Array = npt.NDArray[np.float64]

MOST_PARTS = 4096
"""Number of parts whose rows are kept; most motions have the same few."""


def control_degree(k: int, inner_modes: int, derivative: int) -> int:
    """Degree d of a derivative of the curve of an interval, which has d + 1 control points."""
    return 2 * k - 1 + inner_modes - derivative


@cache
def control_nodes(degree: int) -> Array:
    """d + 1 positions on [0, 1] whose values give the control points, both ends among them."""
    if degree == 0:
        return np.array([0.5])
    return np.asarray((1.0 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2)


@cache
def control_matrix(degree: int) -> Array:
    """The control points on [0, 1] over the values at `control_nodes`, shape (d + 1, d + 1)."""
    s = control_nodes(degree)[:, None]
    i = np.arange(degree + 1)
    binomials = np.array([comb(degree, j) for j in i], dtype=np.float64)
    return np.asarray(np.linalg.inv(binomials * s**i * (1.0 - s) ** (degree - i)))


def control_rows(
    left: Array, width: Array, k: int, inner_modes: int, derivative: int
) -> tuple[Array, Array]:
    """Control points of h^j q^(j), or q - q0, on parts [left, left + width] of intervals.

    left, width: relative to the interval, shape (L,). derivative: j, at most k.
    Returns rows over (h q0', ..., h^(k-1) q0^(k-1), Z, c), (L, d + 1, 2 k - 1 + r), and with them
    those of the curve at the positions of the control points, left + width i / d.
    """
    parts = zip(left.tolist(), width.tolist(), strict=True)
    found = [_of_part(*part, k, inner_modes, derivative) for part in parts]
    points, curve = (np.stack(each) for each in zip(*found, strict=True))
    return points, curve


@lru_cache(maxsize=MOST_PARTS)
def _of_part(
    left: float, width: float, k: int, inner_modes: int, derivative: int
) -> tuple[Array, Array]:
    """As `control_rows`, of one part: (d + 1, 2 k - 1 + r) each."""
    d = control_degree(k, inner_modes, derivative)
    s = left + width * np.append(control_nodes(d), np.linspace(0.0, 1.0, d + 1))
    at_nodes, at_points = np.split(jet_rows(s, k, inner_modes)[:, derivative], 2)
    return np.asarray(control_matrix(d) @ at_nodes), at_points
