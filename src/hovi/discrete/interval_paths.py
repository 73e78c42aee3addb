"""Interpolation of discrete paths at quadrature points, and steps in the columns of intervals.

The compiled code works on plain arrays.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
PathArrays = tuple[Array, Array, Array, Array]
"""q (N + 1, n), v (N + 1, n), z (N, 2, n) and inner modes (N, r, n): see DiscretePath."""


def interpolate(table: Array, steps: Array, intervals: Index, path: PathArrays) -> Array:
    """(q, v, a) at the points of some intervals, on commutative groups, shape (3, B Q, n).

    (q - q0, h v, h^2 a) = table (h v0, h^2 z0, h^2 z1, h^2 inner) at every point.

    table: shape (Q, 3, 3 + r), with at most as many modes as the path.
    steps: h of the intervals, (B,). intervals: their numbers, shape (B,).
    """
    q, v, z, inner = path
    out = np.empty((3, len(steps) * len(table), v.shape[1]))
    table, h = np.ascontiguousarray(table), np.ascontiguousarray(steps)
    native.interpolate(table, h, intervals, q, v, z, inner, out)
    return out


def move(path: PathArrays, step: Array, steps: Array, nodal: bool) -> PathArrays:
    """The change of q in a step, and v, z and the inner modes after it.

    step: in the columns (q0, h v0, q1, h v1, c) if nodal, else (q0, h v0, Z0, Z1, c), which do not
        move the last node; shape (N, 4 + r, n).
    steps: h, shape (N,).
    """
    _, v, z, inner = path
    after = np.empty_like(v), np.empty_like(v), np.empty_like(z), np.empty_like(inner)
    native.move(np.ascontiguousarray(step), steps, nodal, v, z, inner, *after)
    return after


def misfit(path: PathArrays, steps: Array) -> float:
    """The largest difference between z and its values from q and v, on commutative groups.

    The largest of |q1 - q0 - h v0 - h^2 z0| and |h (v1 - v0 - h z1)|, relative to max(|q|, 1); NaN
    for a path that is not finite. steps: h, shape (N,).
    """
    return native.misfit(steps, *path)
