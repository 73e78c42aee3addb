"""Smallest distances along a motion, between the quadrature points, too."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import DISTANCE_SCALE, Clearance
from hovi.planning.clearance.distances import Distances
from hovi.planning.clearance.fast_obstacles import FastPairs
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

SAMPLES = 33
"""Samples per interval in the first pass, both ends included."""
REFINED_SAMPLES = 9
"""Samples around a closest approach in each refinement pass."""
REFINEMENT_PASSES = 4
"""Refinement passes, each with samples four times as dense."""
REFINEMENT_DISTANCE = 0.05 * DISTANCE_SCALE
"""Closest approaches up to this much above the required distance are refined, in [m]."""
DIGITS, MOST_DIGITS, MARGIN_DIGITS = 3, 17, 6
"""Significant digits in messages: of a distance, at most if it has to differ from a margin, and of
a margin at least."""
TOUCHING = 1e-9
"""Distance or depth up to which a pair touches, in [m]: rounding errors may have either sign."""


@dataclass(frozen=True, eq=False)
class Approach:
    """The smallest distance of every pair in every interval, and where in the interval it occurs.

    distance: shape (N, K), in [m]. at: relative position in the interval, in [0, 1].
    """

    distance: Array
    at: Array

    def worst(self) -> tuple[int, int]:
        """Interval and pair with the smallest distance."""
        k, pair = np.unravel_index(int(np.argmin(self.distance)), self.distance.shape)
        return int(k), int(pair)


def approach_along(
    trajectory: Trajectory, distances: Distances, least: float, reach: float = np.inf
) -> Approach:
    """Closest approaches along the interpolant, refined where they are near `least`, in [m].

    reach: distance in [m] beyond which a lower bound of at least that is enough.
    """
    nearest, at = _nearest(*_sampled(trajectory, distances, reach))
    nearest, at = _with_fast(trajectory, distances, least + REFINEMENT_DISTANCE, nearest, at)
    return _refined(trajectory, distances, nearest, at, least + REFINEMENT_DISTANCE)


def closest_along(trajectory: Trajectory, distances: Distances, least: float) -> Approach:
    """As `approach_along`, refined where they are near the least of all, too."""
    nearest, at = _nearest(*_sampled(trajectory, distances, np.inf))
    first = float((nearest - distances.allowance).min())
    below = max(least, first) + REFINEMENT_DISTANCE
    nearest, at = _with_fast(trajectory, distances, below, nearest, at)
    return _refined(trajectory, distances, nearest, at, below)


def nearest_pair(
    motion: Trajectory, clearance: Clearance, distances: Distances
) -> tuple[float, str]:
    """The least distance, in [m], which may be smaller where shapes may touch, and its pair."""
    approach = closest_along(motion, distances, clearance.margin)
    closest = (approach.distance - distances.allowance).min(axis=0)
    pair = int(np.argmin(closest))
    return float(closest[pair]), str(dataclasses.replace(distances.pairs[pair], touching=False))


def near_pairs(trajectory: Trajectory, distances: Distances, least: float) -> npt.NDArray[np.intp]:
    """Numbers of the pairs that come nearer than `least`, in [m], anywhere along a motion."""
    below = least + REFINEMENT_DISTANCE
    nearest, at = _nearest(*_sampled(trajectory, distances, below))
    nearest, at = _with_fast(trajectory, distances, below, nearest, at)
    closest = nearest.min(axis=0)
    unclear = np.flatnonzero((closest >= least) & (closest < below))
    some = distances.restricted(unclear.tolist())
    refined = _refined(trajectory, some, nearest[:, unclear], at[:, unclear], below)
    closest[unclear] = refined.distance.min(axis=0)
    return np.flatnonzero(closest < least)


def distances_over_time(
    trajectory: Trajectory, distances: Distances, t: Array, reach: float = np.inf
) -> Array:
    """Distances of every pair at given times, shape (M, K), in [m].

    reach: as for `approach_along`.
    """
    return distances.values(distances.at(trajectory.configurations(t), t), reach)


def _sampled(trajectory: Trajectory, distances: Distances, reach: float) -> tuple[Array, Array]:
    """Relative positions (SAMPLES,) in every interval, and the distances, (N, SAMPLES, K)."""
    N = trajectory.grid.intervals
    s = np.linspace(0.0, 1.0, SAMPLES)
    d = _measured(trajectory, distances, np.repeat(np.arange(N), SAMPLES), np.tile(s, N), reach)
    return s, d.reshape(N, SAMPLES, -1)


def _nearest(s: Array, d: Array) -> tuple[Array, Array]:
    """The smallest of the sampled distances in every interval, and where, (N, K)."""
    index = np.argmin(d, axis=1)
    return np.take_along_axis(d, index[:, None], axis=1)[:, 0], s[index]


def _with_fast(
    trajectory: Trajectory, distances: Distances, below: float, nearest: Array, at: Array
) -> tuple[Array, Array]:
    """The smallest distances with those between samples of obstacles that move fast.

    below: distance below which they are wanted, in [m].
    """
    if not distances.paths:
        return nearest, at
    N, s = trajectory.grid.intervals, np.linspace(0.0, 1.0, SAMPLES)
    k = np.repeat(np.arange(N), SAMPLES)
    t = np.minimum(trajectory.t[k] + np.tile(s, N) * trajectory.grid.steps[k], trajectory.duration)
    fast = FastPairs.of(distances, t, trajectory.configurations(t))
    if fast is None:
        return nearest, at
    some = distances.restricted(fast.numbers.tolist())

    def measure(times: Array, column: npt.NDArray[np.intp]) -> Array:
        return wanted_values(some, some.at(trajectory.configurations(times), times), column)

    found = fast.between(distances_over_time(trajectory, some, t), below, measure)
    nearest, at = nearest.copy(), at.copy()
    for i in np.argsort(-found.value):
        interval = min(int(np.searchsorted(trajectory.t, found.t[i], side="right")) - 1, N - 1)
        place = interval, fast.numbers[found.column[i]]
        if found.value[i] < nearest[place]:
            nearest[place] = found.value[i]
            at[place] = (found.t[i] - trajectory.t[interval]) / trajectory.grid.steps[interval]
    return nearest, at


def wanted_values(distances: Distances, q: Array, column: npt.NDArray[np.intp]) -> Array:
    """One distance at each configuration, (C,), in [m]. column: numbers of the pairs, (C,)."""
    rows = np.arange(len(q))
    wanted = np.zeros((len(q), len(distances.pairs)), dtype=bool)
    wanted[rows, column] = True
    return distances.values(q, np.inf, wanted)[rows, column]


def _measured(
    trajectory: Trajectory,
    distances: Distances,
    k: npt.NDArray[np.intp],
    s: Array,
    reach: float = np.inf,
) -> Array:
    """Distances at relative positions s in intervals k, shape (M, K)."""
    t = trajectory.t[k] + s * trajectory.grid.steps[k]
    return distances_over_time(trajectory, distances, np.minimum(t, trajectory.duration), reach)


def _refined(
    trajectory: Trajectory, distances: Distances, nearest: Array, at: Array, below: float
) -> Approach:
    nearest, at = nearest.copy(), at.copy()
    near = nearest < below
    for pair in np.flatnonzero(near.any(axis=0)):
        k, alone = np.flatnonzero(near[:, pair]), distances.restricted([int(pair)])
        width, rows = 1.0 / (SAMPLES - 1), np.arange(len(k))
        for _ in range(REFINEMENT_PASSES):
            around = at[k, pair][:, None] + width * np.linspace(-1.0, 1.0, REFINED_SAMPLES)
            around = np.clip(around, 0.0, 1.0)
            d = _measured(trajectory, alone, np.repeat(k, REFINED_SAMPLES), around.ravel())
            values = d.reshape(len(k), REFINED_SAMPLES)
            best = np.argmin(values, axis=1)
            nearest[k, pair], at[k, pair] = values[rows, best], around[rows, best]
            width *= 2.0 / (REFINED_SAMPLES - 1)
    return Approach(nearest, at)


def approach_sentence(
    trajectory: Trajectory, distances: Distances, approach: Approach, margin: float
) -> str:
    """The pair that comes closest: its names, the distance, the time and the margin."""
    k, pair = approach.worst()
    t = trajectory.t[k] + approach.at[k, pair] * trajectory.grid.steps[k]
    distance = float(approach.distance[k, pair] - distances.allowance[pair])
    digits = digits_between(distance, margin)
    return (
        f"{distances.pairs[pair]} {distance_in_words(distance, digits)} at "
        f"t = {t:.3g} s, the margin is {margin:.{max(digits, MARGIN_DIGITS)}g} m"
    )


def distance_in_words(distance: float, digits: int = DIGITS) -> str:
    """A signed distance as the predicate of a sentence about a pair. digits: of it."""
    if abs(distance) < TOUCHING:
        return "touch"
    if distance < 0:
        return f"overlap by {-distance:.3g} m"
    return f"are {distance:.{digits}g} m apart"


def digits_between(distance: float, margin: float) -> int:
    """The number of digits, DIGITS or more, with which a distance and a margin look different."""
    unlike = (n for n in range(DIGITS, MOST_DIGITS) if f"{distance:.{n}g}" != f"{margin:.{n}g}")
    return next(unlike, MOST_DIGITS)


def less_than_margin(distance: float, margin: float) -> str:
    """A distance below the margin as the predicate of a sentence about a pair, and the margin."""
    digits = digits_between(distance, margin)
    needed = f", less than the margin of {margin:.{max(digits, MARGIN_DIGITS)}g} m"
    return distance_in_words(distance, digits) + ("" if distance < TOUCHING else needed)
