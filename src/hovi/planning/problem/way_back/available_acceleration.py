"""The largest accelerations that torques and limits on accelerations allow in a state."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.planning.problem.limits import Limits
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]

NO_PART = 1e-9
"""Entry of M^-1, relative to the largest, below which a torque has no part in an acceleration."""


def available_accelerations(
    scene: Scene | None, q: Array, v: Array, time: float, limits: Limits
) -> Array:
    """The largest accelerations down and up, shape (2, nv), 0 or more; infinite without a bound.

    a = M^-1 (tau - tau_0) is largest where every torque is at the bound that helps.
    scene: of the torques; None for coordinates of no robot. q, v: (nq,) and (nv,).
    """
    bounds = np.stack([-limits.lower[2], limits.upper[2]])
    if scene is not None and limits.bounded[3].any():
        bounds = np.minimum(bounds, _by_torques(scene, q, v, time, limits))
    return np.asarray(np.maximum(bounds, 0.0))


def _by_torques(scene: Scene, q: Array, v: Array, time: float, limits: Limits) -> Array:
    n = len(v)
    a = np.concatenate([np.zeros((1, n)), np.eye(n)])
    repeated = np.repeat(q[None], n + 1, axis=0), np.repeat(v[None], n + 1, axis=0)
    tau = scene.inverse_dynamics(*repeated, a, np.full(n + 1, time))
    inverse = np.linalg.pinv((tau[1:] - tau[0]).T)  # M, whatever the effects add to it
    inverse[np.abs(inverse) < NO_PART * np.abs(inverse).max()] = 0.0
    low, high = limits.lower[3] - tau[0], limits.upper[3] - tau[0]
    passive = scene.passive_coordinates
    low[passive], high[passive] = -tau[0, passive], -tau[0, passive]
    with np.errstate(invalid="ignore"):
        parts = np.stack([inverse * low, inverse * high])
    parts[:, inverse == 0.0] = 0.0
    return np.stack([-parts.min(axis=0).sum(axis=1), parts.max(axis=0).sum(axis=1)])
