"""Pontryagin's equations of least torque by SciPy's solve_bvp, with Pinocchio's RNEA and ABA.

No discrete Lagrangian and no kernel of hovi has a part in it: an oracle for resolved motions.
H = p.v + p~.a - 1/2 |tau|^2, with tau = M^-1 p~, a = ABA(q, v, tau), p' = dL/dq and
p~' = dL/dv - p.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.integrate import solve_bvp

import hovi

TOLERANCES = 1e-4, 1e-3
MOST_NODES = 20_000


def extremal_cost(trajectory: hovi.Trajectory) -> float | None:
    """Least 1/2 integral |tau|^2 near a motion of a scene with gravity; None where SciPy fails."""
    scene = trajectory.scene
    assert scene is not None
    rates = _Rates(scene.model)
    T, n = trajectory.duration, scene.model.nv
    # s = t/T and (q, T v, T^3 p, T^2 p~, T^3 J), so that all numbers are of one size
    scale = np.repeat([1.0, T, T**3, T**2, T**3], [n, n, n, n, 1])[:, None]
    ends = trajectory.q[[0, -1]], T * trajectory.v[[0, -1]]

    def rhs(s: np.ndarray, y: np.ndarray) -> np.ndarray:
        return T * scale * rates((y / scale)[: 4 * n])

    def boundary(y0: np.ndarray, y1: np.ndarray) -> np.ndarray:
        first = [y0[:n] - ends[0][0], y0[n : 2 * n] - ends[1][0], y0[4 * n :]]
        return np.concatenate([*first, y1[:n] - ends[0][1], y1[n : 2 * n] - ends[1][1]])

    p, pt = np.moveaxis(trajectory.momenta, 1, 0)
    zeros = np.zeros((len(p), 1))
    y = np.concatenate([trajectory.q, trajectory.v, p, pt, zeros], axis=1).T * scale
    for tolerance in TOLERANCES:
        found = solve_bvp(rhs, boundary, trajectory.t / T, y, tol=tolerance, max_nodes=MOST_NODES)
        if found.success:
            return float(found.y[-1, -1] / T**3)
    return None


class _Rates:
    """(q, v, p, p~)' and the density of the cost, (4 n + 1, M) for y of shape (4 n, M)."""

    def __init__(self, model: pin.Model) -> None:
        self.model, self.data = model, model.createData()

    def __call__(self, y: np.ndarray) -> np.ndarray:
        return np.array([self._at(*np.split(column, 4)) for column in y.T]).T

    def _at(self, q: np.ndarray, v: np.ndarray, p: np.ndarray, pt: np.ndarray) -> np.ndarray:
        tau = pin.computeMinverse(self.model, self.data, q) @ pt
        a = pin.aba(self.model, self.data, q, v, tau)
        dq, dv, _ = pin.computeRNEADerivatives(self.model, self.data, q, v, a)
        return np.concatenate([v, a, dq.T @ tau, dv.T @ tau - p, [0.5 * tau @ tau]])
