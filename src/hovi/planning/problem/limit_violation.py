"""How a motion stands to its limits everywhere, not only at the quadrature points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Sample, Trajectory
from hovi.planning.problem.limits import KINDS, NAMES, Limits
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

SAMPLES = 33
"""Samples of an interval in the first pass, both ends included."""
NEAR = 0.05
"""Outputs that come this near to a bound, as a share of its range, are searched again."""
AT_LIMIT = 1e-3
"""Share of its range within which an output counts as standing at its bound."""


@dataclass(frozen=True, eq=False)
class Excess:
    """By which share of its range each bound is exceeded in each interval; negative inside.

    lower, upper: shape (N, 4, nv). at_lower, at_upper: where in the interval, in [0, 1].
    """

    lower: Array
    upper: Array
    at_lower: Array
    at_upper: Array

    @property
    def by_interval(self) -> Array:
        """The largest excess of each interval, shape (N,)."""
        return np.asarray(np.maximum(self.lower, self.upper).max(axis=(1, 2)))

    @property
    def worst(self) -> float:
        """The largest excess of all."""
        return float(max(self.lower.max(), self.upper.max()))


def excess_along(trajectory: Trajectory, limits: Limits) -> Excess:
    """The extremes of q, v, a and tau of the interpolant, against the limits.

    Every interval is sampled, and sampled again around the extremes that come near a bound.
    """
    N, nv = trajectory.grid.intervals, trajectory.v.shape[1]
    s = np.linspace(0.0, 1.0, SAMPLES)
    outputs = _outputs(trajectory, np.repeat(np.arange(N), SAMPLES), np.tile(s, N))
    outputs = outputs.reshape(N, SAMPLES, 4, nv)
    sides = []
    for sign, bound in ((-1.0, limits.lower), (1.0, limits.upper)):
        outside = sign * (outputs - bound) / limits.ranges
        index = np.argmax(outside, axis=1)  # (N, 4, nv)
        largest = np.take_along_axis(outside, index[:, None], axis=1)[:, 0]
        sides.append(_refined(trajectory, limits, sign, bound, largest, s[index]))
    (lower, at_lower), (upper, at_upper) = sides
    return Excess(lower, upper, at_lower, at_upper)


def _outputs(trajectory: Trajectory, k: npt.NDArray[np.intp], s: Array) -> Array:
    """(q, v, a, tau) at places of intervals, shape (M, 4, nv)."""
    q, v, a, tau = trajectory.sample_intervals(k, s)
    q = q if trajectory.space is None else trajectory.space.coordinates(q)
    return np.stack([q, v, a, tau], axis=1)


def _refined(
    trajectory: Trajectory, limits: Limits, sign: float, bound: Array, largest: Array, s: Array
) -> tuple[Array, Array]:
    """Excesses and their places, searched again around the samples that come near a bound."""
    largest, s = largest.copy(), s.copy()
    near = np.isfinite(largest) & (largest > -NEAR)
    spots = np.argwhere(near)
    width = 1.0 / (SAMPLES - 1)
    for _ in range(2):
        if len(spots) == 0:
            break
        around = s[near][:, None] + width * np.linspace(-1, 1, SAMPLES)
        around = np.clip(around, 0.0, 1.0)
        k, kind, joint = spots.T
        outputs = _outputs(trajectory, np.repeat(k, SAMPLES), around.ravel())
        values = outputs.reshape(len(spots), SAMPLES, 4, -1)[np.arange(len(spots)), :, kind, joint]
        outside = sign * (values - bound[kind, joint][:, None])
        outside /= limits.ranges[kind, joint][:, None]
        best = np.argmax(outside, axis=1)
        rows = np.arange(len(spots))
        largest[near] = outside[rows, best]
        s[near] = around[rows, best]
        width /= SAMPLES - 1
    return largest, s


def worst_sentence(trajectory: Trajectory, limits: Limits, robot: Robot) -> str:
    """Which limit is exceeded most: kind, joint, time, values."""
    excess = excess_along(trajectory, limits)
    above = excess.upper.max() >= excess.lower.max()
    side = excess.upper if above else excess.lower
    place = excess.at_upper if above else excess.at_lower
    k, kind, joint = np.unravel_index(int(np.argmax(side)), side.shape)
    s = float(place[k, kind, joint])
    value = _outputs(trajectory, np.array([k]), np.array([s]))[0, kind, joint]
    bound = (limits.upper if above else limits.lower)[kind, joint]
    t = trajectory.t[k] + s * trajectory.grid.steps[k]
    unit = robot.coordinate_units[joint][kind]
    return (
        f"the {NAMES[KINDS[kind]]} of joint {robot.coordinate_names[joint]!r} reaches {value:.4g} "
        f"{unit} at t = {t:.3g} s, its limit is {bound:.4g}"
    )


def closeness(trajectory: Trajectory, limits: Limits) -> Array:
    """Share of its range that each output stays away from its nearest bound, (4, nv).

    Negative where a limit is exceeded, infinite where there is none. Kinds as in limits.KINDS.
    """
    excess = excess_along(trajectory, limits)
    return np.asarray(-np.maximum(excess.lower.max(axis=0), excess.upper.max(axis=0)))


def at_limit(limits: Limits, motion: Sample, robot: Robot | None) -> npt.NDArray[np.bool_]:
    """Which of q, v, a and tau stand at a bound, shape (M, 4, nv)."""
    q = motion.q
    if robot is not None and not robot.vector_joints:
        q = robot.space.coordinates(q)
    outputs = np.stack([q, motion.v, motion.a, motion.tau], axis=1)
    return np.asarray(limits.excess(outputs) >= -AT_LIMIT)
