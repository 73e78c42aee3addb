"""Inner modes of a path brought to where each interval wants them, its end data kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.discrete_lagrangian import DiscreteLagrangian
from hovi.grid import DiscretePath

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RelaxedPath:
    """A path whose inner modes make every L_d extremal between its end data, to first order.

    path: with these modes. values: L_d of every interval there, as foreseen, shape (N,).
    """

    path: DiscretePath
    values: Array


def relaxed(ld: DiscreteLagrangian, path: DiscretePath) -> RelaxedPath:
    """One Newton step of every interval on its own.

    A curve from a coarser grid lacks modes, so that its torques swing about the right ones. They
    weight the curvature of the action, which may lose its sign by that; within an interval the
    inertia rules.
    """
    expansion = ld.expand(path, "nodal")
    N, m, n = expansion.gradient.shape
    size = (m - 4) * n
    g = expansion.gradient[:, 4:].reshape(N, size, 1)
    H = expansion.hessian[:, 4:, 4:].transpose(0, 1, 3, 2, 4).reshape(N, size, size)
    # modes that an interval does not have are rows of zeros
    absent = np.asarray(~H.any(axis=2))
    step = -np.linalg.solve(H + absent[:, :, None] * np.eye(size), g)
    inner = path.inner + step.reshape(N, m - 4, n) / ld.grid.steps[:, None, None] ** 2
    values = expansion.values + 0.5 * np.sum(g * step, axis=(1, 2))
    return RelaxedPath(DiscretePath(path.q, path.v, path.z, inner), values)
