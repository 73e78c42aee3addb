"""Limit violations along a whole motion, between the quadrature points, too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Sample, Trajectory
from hovi.planning.problem.limits import KIND_NAMES, KINDS, Limits
from hovi.robot.robot import Robot
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]

SAMPLES = 33
"""Samples per interval in the first pass, both ends included."""
REFINEMENT_SHARE = 0.05
"""Extremes closer than this to a bound, as a share of its range, are refined."""
PEAK_SHARE = 2e-3
"""Distance of a local extreme from a bound, as a share of its range, within which it is refined."""
AT_LIMIT = 1e-3
"""Distance to a bound, as a share of its range, within which an output is at the bound."""


@dataclass(frozen=True, eq=False)
class Excess:
    """Largest excess over each bound in each interval, as a share of its range; negative inside.

    lower, upper: shape (N, 4, nv). at_lower, at_upper: relative position in the interval of that
        excess, in [0, 1].
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
        """The largest excess over any bound."""
        return float(max(self.lower.max(), self.upper.max()))


def excess_along(trajectory: Trajectory, limits: Limits) -> Excess:
    """The extremes of q, v, a and tau along the interpolant, compared with the limits.

    Every interval is sampled, and again more densely around all extremes that are near a bound:
    a motion along a bound has several, and the highest sample need not be next to the highest one.
    """
    raise_if_late()
    N, nv = trajectory.grid.intervals, trajectory.v.shape[1]
    s = np.linspace(0.0, 1.0, SAMPLES)
    outputs = _outputs(trajectory, np.repeat(np.arange(N), SAMPLES), np.tile(s, N))
    outputs = outputs.reshape(N, SAMPLES, 4, nv)
    sides = []
    for sign, bound in ((-1.0, limits.lower), (1.0, limits.upper)):
        raise_if_late()
        outside = sign * (outputs - bound) / limits.ranges
        index = np.argmax(outside, axis=1)  # (N, 4, nv)
        largest = np.take_along_axis(outside, index[:, None], axis=1)[:, 0]
        sides.append(_refined(trajectory, limits, sign, bound, outside, largest, s[index]))
    (lower, at_lower), (upper, at_upper) = sides
    return Excess(lower, upper, at_lower, at_upper)


def _outputs(trajectory: Trajectory, k: npt.NDArray[np.intp], s: Array) -> Array:
    """(q, v, a, tau) at relative positions s in intervals k, shape (M, 4, nv)."""
    q, v, a, tau = trajectory.sample_intervals(k, s)
    q = q if trajectory.space is None else trajectory.space.coordinates(q)
    return np.stack([q, v, a, tau], axis=1)


def _refined(
    trajectory: Trajectory,
    limits: Limits,
    sign: float,
    bound: Array,
    outside: Array,
    largest: Array,
    s: Array,
) -> tuple[Array, Array]:
    """Excesses and their positions, sampled more densely around extremes near a bound.

    outside: of the samples, (N, SAMPLES, 4, nv). largest, s: of the highest ones, (N, 4, nv).
    """
    k, sample, kind, joint = np.nonzero(_near_extremes(outside, largest))
    if len(k) == 0:
        return largest, s
    largest, s = largest.copy(), s.copy()
    at, width, rows = sample / (SAMPLES - 1), 1.0 / (SAMPLES - 1), np.arange(len(k))
    for _ in range(2):
        around = np.clip(at[:, None] + width * np.linspace(-1, 1, SAMPLES), 0.0, 1.0)
        values = _outputs(trajectory, np.repeat(k, SAMPLES), around.ravel())
        values = values.reshape(len(k), SAMPLES, 4, -1)[rows, :, kind, joint]
        beyond = sign * (values - bound[kind, joint][:, None])
        beyond /= limits.ranges[kind, joint][:, None]
        best = np.argmax(beyond, axis=1)
        at, width = around[rows, best], width / (SAMPLES - 1)
    found = beyond[rows, best]
    for row in np.argsort(found):  # the highest of each interval and output comes last
        place = k[row], kind[row], joint[row]
        if found[row] >= largest[place]:
            largest[place], s[place] = found[row], at[row]
    return largest, s


def _near_extremes(outside: Array, largest: Array) -> npt.NDArray[np.bool_]:
    """Samples that are local extremes, and the highest of their output or next to its bound."""
    padded = np.pad(outside, ((0, 0), (1, 1), (0, 0), (0, 0)), constant_values=-np.inf)
    with np.errstate(invalid="ignore"):
        peak = (outside >= padded[:, :-2]) & (outside >= padded[:, 2:])
    highest = (outside == largest[:, None]) & (outside > -REFINEMENT_SHARE)
    return np.asarray(peak & np.isfinite(outside) & (highest | (outside > -PEAK_SHARE)))


def worst_sentence(trajectory: Trajectory, limits: Limits, robot: Robot) -> str:
    """The limit that is exceeded most: kind, joint, time, value and bound."""
    excess = excess_along(trajectory, limits)
    above = excess.upper.max() >= excess.lower.max()
    side = excess.upper if above else excess.lower
    position = excess.at_upper if above else excess.at_lower
    k, kind, joint = np.unravel_index(int(np.argmax(side)), side.shape)
    s = float(position[k, kind, joint])
    value = _outputs(trajectory, np.array([k]), np.array([s]))[0, kind, joint]
    bound = (limits.upper if above else limits.lower)[kind, joint]
    t = trajectory.t[k] + s * trajectory.grid.steps[k]
    unit = robot.coordinate_units[joint][kind]
    return (
        f"the {KIND_NAMES[KINDS[kind]]} of joint {robot.coordinate_names[joint]!r} reaches "
        f"{value:.4g} {unit} at t = {t:.3g} s, its limit is {bound:.4g}"
    )


def closeness(trajectory: Trajectory, limits: Limits) -> Array:
    """Smallest distance of each output from its bounds, as a share of its range, (4, nv).

    Negative where a limit is exceeded, infinite where there is none. Rows as in limits.KINDS.
    """
    excess = excess_along(trajectory, limits)
    return np.asarray(-np.maximum(excess.lower.max(axis=0), excess.upper.max(axis=0)))


def at_limit(limits: Limits, motion: Sample, robot: Robot | None) -> npt.NDArray[np.bool_]:
    """Which of q, v, a and tau are at a bound, shape (M, 4, nv)."""
    q = motion.q
    if robot is not None and not robot.vector_joints:
        q = robot.space.coordinates(q)
    outputs = np.stack([q, motion.v, motion.a, motion.tau], axis=1)
    return np.asarray(limits.excess(outputs) >= -AT_LIMIT)
