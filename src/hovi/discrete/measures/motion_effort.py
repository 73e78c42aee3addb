"""The effort of a motion: 1/2 integral |tau|^2 dt, whatever the cost was that it minimizes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.interval_batch import IntervalBatch, interval_batches
from hovi.discrete.interval_charts import jet_on
from hovi.discrete.trajectory import Trajectory
from hovi.scene.scene import without_inertia

Array = npt.NDArray[np.float64]


def effort_of(trajectory: Trajectory) -> float | None:
    """1/2 integral |tau|^2 dt over the motion, in [N^2 m^2 s] (N^2 s for sliding joints).

    By the quadrature rule of the grid's schemes, at whose points the cost is measured, so that it
    equals a cost that is nothing but the effort. Torques have weight one; those of passive joints,
    which vanish in the limit of fine grids, are left out.
    Returns None for a motion without torques, such as one of a robot without inertia, and for
    schemes of order 1, which have no accelerations.
    """
    stored = trajectory.torque
    known = stored is None or stored.values.shape[2] > 0
    if not known or trajectory.grid.order < 2 or _without_inertia(trajectory):
        return None
    active = _active(trajectory)
    total = 0.0
    for batch in interval_batches(trajectory.grid):
        tau = _torques(trajectory, batch)[:, active]
        total += 0.5 * float(batch.weights.ravel() @ np.vecdot(tau, tau))
    return total


def _without_inertia(trajectory: Trajectory) -> bool:
    """Whether a joint has no inertia in one of the scenes, so that its torques are not known."""
    return any(bool(without_inertia(scene)) for scene in trajectory.scenes)


def _active(trajectory: Trajectory) -> npt.NDArray[np.bool_]:
    """Which coordinates are actuated, (nv,)."""
    active = np.ones(trajectory.v.shape[1], dtype=bool)
    if trajectory.scene is not None:
        active[trajectory.scene.passive_coordinates] = False
    return active


def _torques(trajectory: Trajectory, batch: IntervalBatch) -> Array:
    """tau at the quadrature points of a batch, (P, nv)."""
    points, space, path = batch.scheme.points, trajectory.space, trajectory.path
    k, s = np.repeat(batch.numbers, len(points)), np.tile(points, len(batch.numbers))
    q, v, a = (batch.jet(path) if space is None else jet_on(space, batch, path))[:3]
    return trajectory.torques(k, s, (q, v, a))
