"""How far a motion keeps from obstacles everywhere, not only at the quadrature points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import SCALE
from hovi.planning.clearance.distances import Distances

Array = npt.NDArray[np.float64]

SAMPLES = 33
"""Samples of an interval in the first pass, both ends included."""
AROUND = 9
"""Samples around a nearest approach in each later pass."""
PASSES = 4
"""Later passes, in each of which the samples are four times as dense."""
NEAR = 0.05 * SCALE
"""Approaches within this of the least distance are searched again, in [m]."""


@dataclass(frozen=True, eq=False)
class Approach:
    """The least distance of every pair in every interval, and where in the interval it is.

    distance: shape (N, K), in [m]. at: in [0, 1].
    """

    distance: Array
    at: Array

    def worst(self) -> tuple[int, int]:
        """Interval and pair of the least distance of all."""
        k, pair = np.unravel_index(int(np.argmin(self.distance)), self.distance.shape)
        return int(k), int(pair)


def approach_along(trajectory: Trajectory, distances: Distances, least: float) -> Approach:
    """Nearest approaches along the interpolant, searched again where they come near `least`."""
    N = trajectory.grid.intervals
    s = np.linspace(0.0, 1.0, SAMPLES)
    d = _measured(trajectory, distances, np.repeat(np.arange(N), SAMPLES), np.tile(s, N))
    d = d.reshape(N, SAMPLES, -1)
    index = np.argmin(d, axis=1)  # (N, K)
    nearest = np.take_along_axis(d, index[:, None], axis=1)[:, 0]
    return _refined(trajectory, distances, nearest, s[index], least + NEAR)


def distances_over_time(trajectory: Trajectory, distances: Distances, t: Array) -> Array:
    """Distances of every pair at given times, shape (M, K), in [m]."""
    return distances.values(trajectory.configurations(t))


def _measured(
    trajectory: Trajectory, distances: Distances, k: npt.NDArray[np.intp], s: Array
) -> Array:
    """Distances at places of intervals, shape (M, K)."""
    t = trajectory.t[k] + s * trajectory.grid.steps[k]
    return distances_over_time(trajectory, distances, np.minimum(t, trajectory.duration))


def _refined(
    trajectory: Trajectory, distances: Distances, nearest: Array, at: Array, below: float
) -> Approach:
    nearest, at = nearest.copy(), at.copy()
    k, pair = np.nonzero(nearest < below)
    width = 1.0 / (SAMPLES - 1)
    rows = np.arange(len(k))
    for _ in range(PASSES if len(k) else 0):
        around = at[k, pair][:, None] + width * np.linspace(-1.0, 1.0, AROUND)
        around = np.clip(around, 0.0, 1.0)
        d = _measured(trajectory, distances, np.repeat(k, AROUND), around.ravel())
        values = d.reshape(len(k), AROUND, -1)[rows, :, pair]
        best = np.argmin(values, axis=1)
        nearest[k, pair], at[k, pair] = values[rows, best], around[rows, best]
        width *= 2.0 / (AROUND - 1)
    return Approach(nearest, at)


def approach_sentence(
    trajectory: Trajectory, distances: Distances, approach: Approach, margin: float
) -> str:
    """Which pair comes nearest: its names, the distance, the time and the margin."""
    k, pair = approach.worst()
    t = trajectory.t[k] + approach.at[k, pair] * trajectory.grid.steps[k]
    return (
        f"{distances.pairs[pair]} {in_words(float(approach.distance[k, pair]))} at "
        f"t = {t:.3g} s, the margin is {margin:g} m"
    )


def in_words(distance: float) -> str:
    """A signed distance as a person says it."""
    if distance < 0:
        return f"overlap by {-distance:.3g} m"
    return f"are {distance:.3g} m apart"
