"""R y of a solution's outputs at the points of another grid: what weights the curvature there.

Outputs, torques for instance, are read at the solution's own quadrature points and interpolated in
between: a curve of a Galerkin scheme lacks the modes beyond its own, and those vanish at its Gauss
points. Elsewhere its outputs swing about the right ones, and a Hessian that is weighted with them
may be indefinite right beside a minimum.
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
    lagrangian = ld.lagrangian
    N, Q = ld.grid.intervals, max(len(scheme.points) for scheme, _ in ld.grid.groups)
    m = len(lagrangian.output_weight)
    series = np.zeros((N, Q, m))
    parts = zip(ld.jets(path), ld.point_times, ld.point_intervals, strict=True)
    for jet, t, numbers in parts:
        scheme = ld.grid.schemes[numbers[0]]
        points = len(scheme.points)
        y = lagrangian.output(*jet, t=t).reshape(-1, points, m)
        series[numbers[::points], :points] = scheme.series @ y
    nodes, slopes = ld.grid.t, []
    for t in other.point_times:
        k = np.clip(np.searchsorted(nodes, t, side="right") - 1, 0, N - 1)
        P = legendre(2 * (t - nodes[k]) / ld.grid.steps[k] - 1, Q - 1)  # (degrees, points)
        slopes.append(lagrangian.output_slope(np.einsum("jp,pjn->pn", P, series[k])))
    return slopes
