"""Pontryagin's equations of least torque by SciPy's solve_bvp, with Pinocchio's RNEA and ABA.

It uses neither hovi's discrete Lagrangians nor its kernel: an oracle for resolved motions.
H = p.v + p~.a - 1/2 |tau|^2, with tau = M^-1 p~, a = ABA(q, v, tau), p' = dL/dq and
p~' = dL/dv - p.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.integrate import solve_bvp

import hovi

TOLERANCES = 1e-5, 1e-4, 1e-3
MAX_NODES = 20_000
MIN_SCALE = 1e-9
"""Components smaller than this are not scaled."""


def extremal_cost(trajectory: hovi.Trajectory) -> float | None:
    """Minimum of 1/2 integral |tau|^2 near a motion with gravity; None if SciPy fails."""
    scene = trajectory.scene
    assert scene is not None
    rates, n, T = _Rates(scene.model), scene.model.nv, trajectory.duration
    p, pt = np.moveaxis(trajectory.momenta, 1, 0)
    cost = trajectory.t[:, None]  # any increasing guess
    y = np.concatenate([trajectory.q, trajectory.v, p, pt, cost], axis=1).T
    size = np.maximum(np.abs(y).max(axis=1, keepdims=True), MIN_SCALE)
    ends = trajectory.q[[0, -1]] / size[:n, 0], trajectory.v[[0, -1]] / size[n : 2 * n, 0]

    def rhs(s: np.ndarray, y: np.ndarray) -> np.ndarray:
        return T * rates((y * size)[: 4 * n]) / size

    def boundary(y0: np.ndarray, y1: np.ndarray) -> np.ndarray:
        first = [y0[:n] - ends[0][0], y0[n : 2 * n] - ends[1][0], y0[4 * n :]]
        return np.concatenate([*first, y1[:n] - ends[0][1], y1[n : 2 * n] - ends[1][1]])

    for tolerance in TOLERANCES:
        s = trajectory.t / T
        found = solve_bvp(rhs, boundary, s, y / size, tol=tolerance, max_nodes=MAX_NODES)
        if found.success:
            return float(found.y[-1, -1] * size[-1, 0])
    return None


class _Rates:
    """(q, v, p, p~)' and the integrand of the cost, (4 n + 1, M) for y of shape (4 n, M)."""

    def __init__(self, model: pin.Model) -> None:
        self.model, self.data = model, model.createData()

    def __call__(self, y: np.ndarray) -> np.ndarray:
        return np.array([self._at(*np.split(column, 4)) for column in y.T]).T

    def _at(self, q: np.ndarray, v: np.ndarray, p: np.ndarray, pt: np.ndarray) -> np.ndarray:
        tau = pin.computeMinverse(self.model, self.data, q) @ pt
        a = pin.aba(self.model, self.data, q, v, tau)
        dq, dv, _ = pin.computeRNEADerivatives(self.model, self.data, q, v, a)
        return np.concatenate([v, a, dq.T @ tau, dv.T @ tau - p, [0.5 * tau @ tau]])
