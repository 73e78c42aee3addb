"""Limit violations along a whole motion, between the quadrature points, too."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Sample, Trajectory
from hovi.dynamics.torque_rate import TorqueRate
from hovi.planning.problem.arms.limit_set import KIND_NAMES
from hovi.planning.problem.limits import FIRST_KINDS, KINDS, Limits
from hovi.planning.problem.way_back.excused import Excused
from hovi.robot.robot import Robot
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

SAMPLES = 33
"""Samples per interval in the first pass, both ends included."""
POSITIONS = (1.0 - np.cos(np.pi * np.arange(SAMPLES) / (SAMPLES - 1))) / 2
"""Their positions, closer at both ends, where polynomials of high degree oscillate faster."""
REFINED_SAMPLES = 25
"""Samples of each further pass, between the neighbours of an extreme sample."""
BATCH = 128
"""Extremes that are refined at once."""
REFINEMENT_FRACTION = 0.05
"""The largest extreme of an output in an interval is refined if it is closer than this to a bound,
as a fraction of its range."""
COARSE_MODES = 4
COARSE = 4, 2
"""Stride of the samples that `excess_of` looks at first: on grids of at most COARSE_MODES inner
modes, and on others."""
PEAK_FRACTION = 2e-3
"""The same for every other local extreme; smaller, as a motion along a bound has many of them."""
AT_LIMIT = 1e-3
"""Distance to a bound, as a fraction of its range, within which an output is at the bound."""


class SampledBounds(ABC):
    """Bounds of other outputs of a motion than those of Limits: these are at most zero.

    upper: zero, or infinity where there is no bound, shape (1, K). tolerance: of an excess.
    """

    upper: Array
    tolerance: float
    excused: ClassVar[tuple[Excused, ...]] = ()

    @abstractmethod
    def outputs(self, trajectory: Trajectory, k: Index, s: Array) -> Array:
        """Them at relative positions s in intervals k, shape (M, 1, K)."""

    @property
    def lower(self) -> Array:
        """None."""
        return np.full_like(self.upper, -np.inf)

    @property
    def bounded(self) -> npt.NDArray[np.bool_]:
        """Where there is a bound, (1, K)."""
        return np.isfinite(self.upper)

    @property
    def ranges(self) -> Array:
        """One, the scale of the outputs, (1, K)."""
        return np.ones_like(self.upper)

    def on(self, nodes: Array) -> tuple[Array, Array]:
        """Both bounds in every interval, (1, 1, K)."""
        return self.lower[None], self.upper[None]

    def wider(self, side: int, t: Array) -> Array:
        """Nothing is excused, (*t.shape, 1, K)."""
        return np.zeros((*t.shape, *self.upper.shape))


Bounds = Limits | SampledBounds


@dataclass(frozen=True, eq=False)
class Excess:
    """Largest excess over each bound in each interval, as a fraction of its range; negative inside.

    lower, upper: shape (N, kinds, nv). at_lower, at_upper: relative position in the interval of
        that excess, in [0, 1].
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


def excess_along(
    trajectory: Trajectory,
    limits: Bounds,
    refined: npt.NDArray[np.bool_] | bool = True,
) -> Excess:
    """The extremes of the limited quantities along the interpolant, compared with the limits.

    refined: whether they are looked for between the samples, for all or for each, (kinds, nv).

    Every interval is sampled, and again more densely around all extremes that are near a bound, and
    wherever the curvature of the samples allows an excess between them: a motion along a bound has
    several extremes, and the largest one is not always next to the largest sample.
    """
    every = np.arange(trajectory.grid.intervals)
    return _excess_in(every, trajectory, limits, limits.bounded & refined)


def excess_of(
    trajectory: Trajectory, limits: Bounds, chosen: npt.NDArray[np.bool_]
) -> tuple[Array, Array]:
    """The excess over the lower and upper bounds of chosen outputs, (N, kinds, nv) each.

    -inf for others. It is that of `excess_along` wherever that may be positive; elsewhere it is
    that of a few samples, which are further from their bounds than neighboring ones differ.
    chosen: shape (kinds, nv).
    """
    raise_if_late()
    N, grid = trajectory.grid.intervals, trajectory.grid
    found = np.full((2, N, *limits.lower.shape), -np.inf)
    kinds, joints = np.nonzero(limits.bounded & chosen)
    if len(kinds) == 0:
        return found[0], found[1]
    s = POSITIONS[:: COARSE[int(grid.inner_modes > COARSE_MODES)]]
    outputs = _outputs(trajectory, np.repeat(np.arange(N), len(s)), np.tile(s, N), limits)
    y = outputs.reshape(N, len(s), *limits.lower.shape)[:, :, kinds, joints]
    ranges = limits.ranges[kinds, joints]
    change = np.abs(np.diff(y, axis=1)).max(axis=1)
    below, above = (each[:, kinds, joints] for each in limits.on(trajectory.t))
    sides = np.stack([below - y.min(axis=1), y.max(axis=1) - above]) / ranges
    safe = sides + change / ranges <= -REFINEMENT_FRACTION  # false where it is no number
    found[:, :, kinds, joints] = sides
    near = np.flatnonzero(~safe.all(axis=(0, 2)))
    if len(near) > 0:
        some = _excess_in(near, trajectory, limits, limits.bounded & chosen)
        for side, each in zip(found, (some.lower, some.upper), strict=True):
            side[near[:, None], kinds, joints] = each[:, kinds, joints]
    return found[0], found[1]


def _excess_in(
    intervals: Index,
    trajectory: Trajectory,
    limits: Bounds,
    refined: npt.NDArray[np.bool_],
) -> Excess:
    """As `excess_along`, in some intervals."""
    raise_if_late()
    N = len(intervals)
    k, s = np.repeat(intervals, SAMPLES), np.tile(POSITIONS, N)
    outputs = _outputs(trajectory, k, s, limits).reshape(N, SAMPLES, *limits.lower.shape)
    chosen = np.nonzero(refined)
    below, above = limits.on(trajectory.t)
    sides = _Side(trajectory, limits, -1.0, below), _Side(trajectory, limits, 1.0, above)
    (lower, at_lower), (upper, at_upper) = (
        side.extremes(outputs, intervals, chosen) for side in sides
    )
    return Excess(lower, upper, at_lower, at_upper)


@dataclass(frozen=True, eq=False)
class _Side:
    """The lower or the upper bounds of a motion's outputs.

    sign: -1 for lower bounds, 1 for upper ones. bound: shape (N or 1, kinds, nv).
    """

    trajectory: Trajectory
    limits: Bounds
    sign: float
    bound: Array

    def extremes(
        self, outputs: Array, intervals: Index, chosen: tuple[Index, ...]
    ) -> tuple[Array, Array]:
        """The largest excess in each interval, and its relative position, (N, kinds, nv) each.

        outputs: of all samples, shape (N, SAMPLES, kinds, nv). intervals: their numbers, (N,).
        chosen: kinds and joints that are refined.
        """
        raise_if_late()
        bound = self.bound[np.minimum(intervals, len(self.bound) - 1)]
        excess = self.sign * (outputs - bound[:, None]) / self.limits.ranges
        if self.limits.excused:
            excess -= self.wider(intervals[:, None], POSITIONS) / self.limits.ranges
        index = np.argmax(excess, axis=1)
        largest = np.take_along_axis(excess, index[:, None], axis=1)[:, 0]
        s = POSITIONS[index]
        kinds, joints = chosen
        some = excess[:, :, kinds, joints]
        k, sample, column = np.nonzero(
            _near_extremes(some, largest[:, kinds, joints])
            | _may_exceed(some, self.limits.tolerance)
        )
        if len(k) == 0:
            return largest, s
        kind, joint = kinds[column], joints[column]
        found, at = self.refined(intervals[k], sample, kind, joint)
        for row in np.argsort(found):  # the largest of each interval and output comes last
            entry = k[row], kind[row], joint[row]
            if found[row] >= largest[entry]:
                largest[entry], s[entry] = found[row], at[row]
        return largest, s

    def wider(self, k: Index, s: Array) -> Array:
        """By how much bounds are wider at positions s in intervals k, (*s.shape, kinds, nv)."""
        t = self.trajectory.t[k] + s * self.trajectory.grid.steps[k]
        return self.limits.wider(int(self.sign), t)

    def refined(self, *extremes: Index) -> tuple[Array, Array]:
        """As `_refined_batch`, in batches, since a deadline may be in force."""
        parts = []
        for first in range(0, len(extremes[0]), BATCH):
            raise_if_late()
            parts.append(self._refined_batch(*(x[first : first + BATCH] for x in extremes)))
        found, at = zip(*parts, strict=True)
        return np.concatenate(found), np.concatenate(at)

    def _refined_batch(
        self, k: Index, sample: Index, kind: Index, joint: Index
    ) -> tuple[Array, Array]:
        """The excess at M extremes and their positions, from three denser samplings around them.

        k: intervals. sample: the extreme samples. kind, joint: of the outputs. All (M,).
        """
        rows = np.arange(len(k))
        bound = self.bound[np.minimum(k, len(self.bound) - 1), kind, joint]
        begin = POSITIONS[np.maximum(sample - 1, 0)]
        end = POSITIONS[np.minimum(sample + 1, SAMPLES - 1)]
        for _ in range(3):
            step = (end - begin) / (REFINED_SAMPLES - 1)
            around = np.minimum(begin[:, None] + step[:, None] * np.arange(REFINED_SAMPLES), 1.0)
            every = np.repeat(k, REFINED_SAMPLES)
            outputs = _outputs(self.trajectory, every, around.ravel(), self.limits)
            shape = len(k), REFINED_SAMPLES, *self.bound.shape[1:]
            values = outputs.reshape(shape)[rows, :, kind, joint]
            excess = self.sign * (values - bound[:, None])
            if self.limits.excused:
                excess -= self.wider(k[:, None], around)[rows, :, kind, joint]
            excess /= self.limits.ranges[kind, joint][:, None]
            best = np.argmax(excess, axis=1)
            at = around[rows, best]
            begin, end = np.maximum(at - step, 0.0), np.minimum(at + step, 1.0)
        return excess[rows, best], at


def _outputs(trajectory: Trajectory, k: Index, s: Array, limits: Bounds) -> Array:
    """The limited kinds at relative positions s in intervals k, shape (M, kinds, nv)."""
    if isinstance(limits, SampledBounds):
        return limits.outputs(trajectory, k, s)
    if len(limits.kinds) == FIRST_KINDS:
        return _stacked(trajectory.sample_intervals(k, s), trajectory.space)
    q, v, a, j = trajectory.jet_intervals(k, s, 3)
    first = _stacked(Sample(q, v, a, trajectory.torques(k, s, (q, v, a))), trajectory.space)
    rate = np.zeros_like(v)
    if trajectory.scene is not None and limits.on_torque_rate:
        rate = TorqueRate(trajectory.scene.torques, q, v, a, j, trajectory.space).value()
    return np.concatenate([first, j[:, None], rate[:, None]], axis=1)


def _stacked(motion: Sample, space: ConfigurationSpace | None) -> Array:
    """(q, v, a, tau), shape (M, 4, nv); zeros for the torques of a motion without any."""
    q = motion.q if space is None else space.coordinates(motion.q)
    tau = motion.tau if motion.tau.shape[1] > 0 else np.zeros_like(motion.v)
    return np.stack([q, motion.v, motion.a, tau], axis=1)


def _near_extremes(excess: Array, largest: Array) -> npt.NDArray[np.bool_]:
    """Samples that are local extremes, and are the largest of their output or next to its bound.

    excess: of the samples, shape (N, SAMPLES, K). largest: of each interval, shape (N, K).
    """
    padded = np.pad(excess, ((0, 0), (1, 1), (0, 0)), constant_values=-np.inf)
    with np.errstate(invalid="ignore"):
        peak = (excess >= padded[:, :-2]) & (excess >= padded[:, 2:])
    highest = (excess == largest[:, None]) & (excess > -REFINEMENT_FRACTION)
    return np.asarray(peak & np.isfinite(excess) & (highest | (excess > -PEAK_FRACTION)))


def _may_exceed(excess: Array, tolerance: float) -> npt.NDArray[np.bool_]:
    """Samples next to which a parabola through three of them may exceed a bound.

    excess: of the samples, shape (N, SAMPLES, K). tolerance: of an excess.
    """
    with np.errstate(invalid="ignore"):
        bend = np.abs(np.diff(excess, 2, axis=1))
        bend = np.concatenate([bend[:, :1], bend, bend[:, -1:]], axis=1)
        return np.asarray(excess + 0.5 * bend > tolerance) & np.isfinite(excess)


def worst_sentence(trajectory: Trajectory, limits: Limits, coordinates: Coordinates) -> str:
    """The limit that is exceeded most anywhere: kind, joint, time, value and bound."""
    excess = excess_along(trajectory, limits)
    above = excess.upper.max() >= excess.lower.max()
    side = excess.upper if above else excess.lower
    position = excess.at_upper if above else excess.at_lower
    k, kind, joint = np.unravel_index(int(np.argmax(side)), side.shape)
    s, sign = float(position[k, kind, joint]), 1 if above else -1
    bounds = limits.on(trajectory.t)[int(above)]
    value = _outputs(trajectory, np.array([k]), np.array([s]), limits)[0, kind, joint]
    bound = bounds[min(int(k), len(bounds) - 1), kind, joint]
    t = trajectory.t[k] + s * trajectory.grid.steps[k]
    bound += sign * limits.wider(sign, np.array(t))[kind, joint]
    unit = coordinates.coordinate_units[joint][kind]
    return (
        f"the {KIND_NAMES[KINDS[kind]]} of joint {coordinates.coordinate_names[joint]!r} reaches "
        f"{value:.4g} {unit} at t = {t:.3g} s, its limit is {bound:.4g}"
    )


def closeness(trajectory: Trajectory, limits: Limits) -> Array:
    """Smallest distance of each output from its bounds, as a fraction of its range, (kinds, nv).

    Negative where a limit is exceeded, infinite where there is none. Rows as in limits.kinds.
    """
    excess = excess_along(trajectory, limits)
    return np.asarray(-np.maximum(excess.lower.max(axis=0), excess.upper.max(axis=0)))


def at_limit(limits: Limits, motion: Sample, robot: Robot | None) -> npt.NDArray[np.bool_]:
    """Which of q, v, a and tau are at a bound, shape (M, 4, nv)."""
    outputs = _stacked(motion, None if robot is None else robot.curved_space)
    return np.asarray(limits.first_kinds.excess(outputs) >= -AT_LIMIT)
