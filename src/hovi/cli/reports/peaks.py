"""The extreme values of a motion, and the limits of the URDF."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.robot.space.unwrapped_angles import shown_names
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

SAMPLES_PER_INTERVAL = 20
MAX_SAMPLES = 20_000
"""Number of samples at which extremes are looked for, with an upper bound for the whole motion."""


@dataclass(frozen=True, eq=False)
class Peaks:
    """Extremes over time, per velocity coordinate.

    names: of the coordinates. shown: their display names, see `shown_names`.
    q_low, q_high: range of q, in [rad] or [m]; angles of continuous joints and orientations as in
        `Trajectory.positions`.
    v, a, tau: largest |v|, |a| and |tau|.
    lower, upper, v_limit, tau_limit: limits of the URDF; infinite where it has none.
    """

    names: tuple[str, ...]
    shown: tuple[str, ...]
    q_low: Array
    q_high: Array
    v: Array
    a: Array
    tau: Array
    lower: Array
    upper: Array
    v_limit: Array
    tau_limit: Array

    def beyond(self) -> dict[str, npt.NDArray[np.bool_]]:
        """Which limits the motion exceeds: "q", "v" and "tau", shape (nv,) each."""
        above, below = _above(self.q_high, self.upper), _above(-self.q_low, -self.lower)
        return {
            "q": above | below,
            "v": _above(self.v, self.v_limit),
            "tau": _above(self.tau, self.tau_limit),
        }


def peaks(trajectory: Trajectory) -> Peaks:
    """Extremes of q, v, a and tau, from up to 20 samples per interval."""
    N = trajectory.grid.intervals
    per_interval = max(1, min(SAMPLES_PER_INTERVAL, MAX_SAMPLES // N))
    s = np.linspace(0.0, 1.0, per_interval + 1)
    where = np.repeat(np.arange(N), len(s)), np.tile(s, N)
    motion, q = trajectory.sample_intervals(*where), trajectory.positions_intervals(*where)
    nv, space = motion.v.shape[1], trajectory.space
    lower, upper = np.full(nv, -np.inf), np.full(nv, np.inf)
    robot = trajectory.robot
    v_limit, tau_limit = np.full(nv, np.inf), np.full(nv, np.inf)
    if robot is not None:
        in_q, in_v = robot.space.plain
        lower[in_v], upper[in_v] = -_stated(-robot.lower[in_q]), _stated(robot.upper[in_q])
        v_limit, tau_limit = _known(robot.velocity_limit), _known(robot.effort_limit)
    v, a, tau = (np.abs(x).max(axis=0) for x in (motion.v, motion.a, motion.tau))
    names = trajectory.coordinate_names
    shown = names if space is None else shown_names(space, names)
    low, high = q.min(axis=0), q.max(axis=0)
    return Peaks(names, shown, low, high, v, a, tau, lower, upper, v_limit, tau_limit)


def _stated(limit: Array) -> Array:
    """The limit, infinite where Pinocchio has the largest double for a missing one."""
    return np.where(limit < np.finfo(float).max, limit, np.inf)


def _known(limit: Array) -> Array:
    """The limit, infinite where a velocity or effort limit is zero: unknown."""
    return np.where(limit > 0, _stated(limit), np.inf)


def _above(value: Array, limit: Array) -> npt.NDArray[np.bool_]:
    """value > limit by more than rounding."""
    return value > limit + 1e-9 * (1.0 + np.abs(limit))
