"""Outputs of a solution interpolated to another grid, as weights of the curvature there.

Outputs such as torques are evaluated at the solution's own quadrature points and interpolated
between them. A Galerkin curve lacks higher modes, which vanish at its Gauss points; elsewhere its
outputs oscillate about the true ones, and a Hessian weighted with these may be indefinite close to
a minimum.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath
from hovi.schemes.polynomials import legendre

Array = npt.NDArray[np.float64]


def interpolated_slopes(
    ld: DiscreteLagrangian, path: DiscretePath, other: DiscreteLagrangian
) -> list[Array]:
    """R y at the quadrature points of another grid of the same duration, (P, m) per batch.

    path: a solution on the grid of `ld`.
    """
    N, Q = ld.grid.intervals, max(len(scheme.points) for scheme, _ in ld.grid.groups)
    m = len(ld.lagrangian.output_weight)
    series = np.zeros((N, Q, m))
    parts = zip(ld.lagrangians, ld.jets(path), ld.point_times, ld.point_intervals, strict=True)
    for lagrangian, jet, t, numbers in parts:
        scheme = ld.grid.schemes[numbers[0]]
        points = len(scheme.points)
        y = lagrangian.output(*jet, t=t).reshape(len(t) // points, points, m)
        series[numbers[::points], :points] = scheme.series @ y
    nodes, slopes = ld.grid.t, []
    for lagrangian, t in zip(other.lagrangians, other.point_times, strict=True):
        k = np.clip(np.searchsorted(nodes, t, side="right") - 1, 0, N - 1)
        P = legendre(2 * (t - nodes[k]) / ld.grid.steps[k] - 1, Q - 1)  # (degrees, points)
        slopes.append(lagrangian.output_slope(np.einsum("jp,pjn->pn", P, series[k])))
    return slopes
