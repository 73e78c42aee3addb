"""The peaks of a motion, joint by joint: how large, when, and how far from the limit."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import Inequality
from hovi.conditions.excess import excess_along
from hovi.discrete.measures.motion_segments import MotionSegment, motion_segments
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.limit_conditions import AT_LIMIT, closeness_by_interval
from hovi.planning.problem.limits import KINDS, Limits, as_limits, pairs_of
from hovi.robot.robot import Robot
from hovi.robot.space.coordinates import NO_UNITS
from hovi.system.dataclass import dataclass
from hovi.viewing.curves.scheme_torque import scheme_torque
from hovi.viewing.recorded_limits import recorded_limits, segment_limits

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Score = Callable[[Array], Array]

QUANTITIES = {
    "tau": "Torque",
    "v": "Speed",
    "power": "Power |τ v|",
    "a": "Acceleration",
    "jerk": "Jerk",
    "q": "Position, where it is nearest to a limit",
}
"""What has peaks, and its heading."""
NO_LIMIT = "none"
_SAMPLES, _MAX_SAMPLES = 33, 40_000  # per interval, and in a motion
_REFINED, _PASSES = 17, 3  # samples between the neighbors of the largest one, again and again


@dataclass(frozen=True)
class Peak:
    """The largest |x| of a quantity of one joint; of its position, that nearest to a limit.

    joint: name of the coordinate. value: x there. t: in [s]. unit: of x.
    lower, upper: its limits; infinite where there is none.
    margin: the least distance of x from them in the whole segment, as a fraction of the range;
        negative beyond a limit, infinite where there is none.
    """

    joint: str
    value: float
    t: float
    unit: str
    lower: float
    upper: float
    margin: float

    @property
    def limit(self) -> str:
        """The limits, without their unit."""
        if not np.isfinite([self.lower, self.upper]).any():
            return NO_LIMIT
        if self.lower == -self.upper:
            return f"±{self.upper:.4g}"
        if np.isinf(self.lower):
            return f"at most {self.upper:.4g}"
        if np.isinf(self.upper):
            return f"at least {self.lower:.4g}"
        return f"{self.lower:.4g} to {self.upper:.4g}"

    @property
    def at_limit(self) -> bool:
        """Whether it is at a limit or beyond."""
        return self.margin <= AT_LIMIT


@dataclass(frozen=True, eq=False)
class SegmentPeaks:
    """The peaks of one segment, or of a motion that has none.

    name: of the segment; "" without one. begin, end: in [s].
    imposed: whether the motion was planned within the limits; else they are those of the URDF.
    peaks: of each joint, by quantity.
    """

    name: str
    begin: float
    end: float
    imposed: bool
    peaks: dict[str, tuple[Peak, ...]]


def motion_peaks(trajectory: Trajectory) -> list[SegmentPeaks]:
    """The peaks of every segment, from 33 samples per interval and more around the largest one."""
    whole = MotionSegment("", 0.0, trajectory.duration, slice(0, trajectory.grid.intervals))
    segments = motion_segments(trajectory) or [whole]
    parts, shared = segment_limits(trajectory), recorded_limits(trajectory)
    limits: list[Limits | None] = [shared] * len(segments)
    if len(parts) == len(segments):
        limits = list(parts)
    imposed = any(each is not None for each in limits)
    if not imposed and trajectory.robot is not None:
        limits = [_stated(trajectory.robot)] * len(segments)
    found = []
    for segment, own in zip(segments, limits, strict=True):
        peaks = dict(_peaks(trajectory, segment.intervals, own))
        found.append(SegmentPeaks(*segment[:3], imposed, peaks))
    return found


def _stated(robot: Robot) -> Limits:
    """Those of the URDF."""
    with warnings.catch_warnings():  # about ranges that look like degrees: planning says so
        warnings.simplefilter("ignore")
        return as_limits(robot, "urdf")


def _peaks(
    motion: Trajectory, intervals: slice, limits: Limits | None
) -> Iterator[tuple[str, tuple[Peak, ...]]]:
    """The quantities that the motion has, with their peaks in some of its intervals."""
    N, names = motion.grid.intervals, motion.coordinate_names
    s = np.linspace(0.0, 1.0, max(2, min(_SAMPLES, _MAX_SAMPLES // N)))
    k = np.repeat(np.arange(intervals.start, intervals.stop), len(s))
    where = k, np.tile(s, intervals.stop - intervals.start)
    for quantity, values in _values(motion, *where).items():
        bounds = _bounds(motion, intervals, limits, quantity)
        score = _Score(bounds[0], bounds[1]) if quantity == "q" else np.abs
        best = np.argmax(score(values), axis=0)
        found = _refined(motion, quantity, (where[0][best], where[1][best]), s[1], score)
        rows = zip(names, *found, _units(motion, quantity), *bounds, strict=True)
        yield quantity, tuple(Peak(*_plain(row)) for row in rows)


def _values(motion: Trajectory, k: Index, s: Array) -> dict[str, Array]:
    """The quantities at relative positions s in intervals k, (M, nv) each."""
    sample = motion.sample_intervals(k, s)
    smooth = scheme_torque(motion, motion.t[k] + s * motion.grid.steps[k])
    tau = sample.tau if smooth is None else smooth
    found = {"v": sample.v, "a": sample.a, "q": motion.positions_intervals(k, s)}
    if tau.shape == sample.v.shape:
        found |= {"tau": tau, "power": tau * sample.v}
    if motion.grid.order > 2 and motion.space is None:
        found["jerk"] = motion.jet_intervals(k, s, 3)[3]
    return {quantity: found[quantity] for quantity in QUANTITIES if quantity in found}


def _refined(
    motion: Trajectory, quantity: str, at: tuple[Index, Array], step: float, score: Score
) -> tuple[Array, Array]:
    """The value with the highest score near a place in an interval, and its time, (nv,) each."""
    k, middle = at
    joints = np.arange(len(k))
    value, t = np.empty(len(k)), np.empty(len(k))
    for _ in range(_PASSES):
        s = np.clip(middle[:, None] + step * np.linspace(-1.0, 1.0, _REFINED), 0.0, 1.0)
        values = _values(motion, np.repeat(k, _REFINED), s.ravel())[quantity]
        values = values.reshape(len(k), _REFINED, -1)
        best = np.argmax(score(values)[joints, :, joints], axis=1)
        middle, value = s[joints, best], values[joints, best, joints]
        t = motion.t[k] + middle * motion.grid.steps[k]
        step *= 2.0 / (_REFINED - 1)
    return value, t


@dataclass(frozen=True, eq=False)
class _Score:
    """How near a position is to a limit, as a fraction of the range; |x| where there is none."""

    lower: Array
    upper: Array

    def __call__(self, x: Array) -> Array:
        """Of positions (..., nv)."""
        bounded = np.isfinite(self.lower) | np.isfinite(self.upper)
        return np.where(bounded, np.maximum(self.lower - x, x - self.upper), np.abs(x))


def _bounds(
    motion: Trajectory, intervals: slice, limits: Limits | None, quantity: str
) -> tuple[Array, Array, Array]:
    """Lower and upper limit of each joint, and the margin to them, (nv,) each."""
    nv = motion.v.shape[1]
    none = np.full(nv, -np.inf), np.full(nv, np.inf), np.full(nv, np.inf)
    if limits is None:
        return none
    if quantity in limits.kinds:
        row = KINDS.index(quantity)
        margin = closeness_by_interval(motion, limits)[intervals, row].min(axis=0)
        return limits.lower[row], limits.upper[row], margin
    for each in limits.conditions:
        if each.name == quantity:
            excess = excess_along(motion, each)[:, intervals].max(axis=(0, 1))
            for joint, (bounds, over) in zip(each.of, _pairs(each, excess), strict=True):
                i = motion.coordinate_names.index(joint)
                none[0][i], none[1][i], none[2][i] = *bounds, -over
    return none


def _pairs(given: Inequality, excess: Array) -> Iterator[tuple[tuple[float, float], float]]:
    return zip(pairs_of(given).values(), excess.tolist(), strict=True)


def _units(motion: Trajectory, quantity: str) -> list[str]:
    """The unit of a quantity at each coordinate."""
    if quantity == "power":
        return ["W"] * motion.v.shape[1]
    robot = motion.robot
    units = [NO_UNITS] * motion.v.shape[1] if robot is None else robot.coordinate_units
    return [getattr(each, quantity) for each in units]


def _plain(row: tuple[str | float, ...]) -> tuple[Any, ...]:
    return tuple(each if isinstance(each, str) else float(each) for each in row)
