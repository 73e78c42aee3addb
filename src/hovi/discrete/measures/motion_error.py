"""The difference of two motions along their whole duration, from which all errors are derived."""

from __future__ import annotations

import dataclasses
from dataclasses import field

import numpy as np
import numpy.typing as npt

from hovi.discrete.output.stored_torque import chebyshev_points
from hovi.discrete.trajectory import Sample, Trajectory
from hovi.errors import InputError
from hovi.robot.frame_distance import FrameDistance
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

FROM_NODES = 1e-9
"""Distance from the nodes, in intervals, at which motions in segments are compared."""
MIN_SAMPLES = 9
"""Minimum number of sample points per interval, both ends included."""


@dataclass(frozen=True, eq=False)
class MotionError:
    """The largest differences of two motions in each interval.

    cost: |J - J'| / |J'|, of the two costs; 0 if both are 0.
    q, v, tau: of every joint coordinate, shape (N, nv), in [rad], [rad/s] and [N m]; metres and
        newtons for prismatic joints.
    tip: of the origin of a frame, or the largest of several, shape (N,), in [m]. frame: its name,
        or that of the frame with the largest error.
    q_at_nodes, tip_at_nodes: the same at the nodes, shape (N + 1, nv) and (N + 1,).
    sliding: which joint coordinates are lengths, shape (nv,).
    """

    cost: float
    q: Array = field(repr=False)
    v: Array = field(repr=False)
    tau: Array = field(repr=False)
    tip: Array = field(repr=False)
    q_at_nodes: Array = field(repr=False)
    tip_at_nodes: Array = field(repr=False)
    frame: str
    sliding: npt.NDArray[np.bool_] = field(repr=False)

    def scaled(self, factor: float) -> MotionError:
        """All differences times a factor."""
        names = "cost", "q", "v", "tau", "tip", "q_at_nodes", "tip_at_nodes"
        return dataclasses.replace(self, **{name: factor * getattr(self, name) for name in names})

    @property
    def angle(self) -> float:
        """The largest angle difference, in [rad]; 0 without angles."""
        return float(np.max(self.q[:, ~self.sliding], initial=0.0))

    @property
    def slide(self) -> float:
        """The largest difference of lengths, in [m]; 0 without prismatic joints."""
        return float(np.max(self.q[:, self.sliding], initial=0.0))

    @property
    def largest_q(self) -> float:
        """The largest of q, in [rad] or [m]."""
        return float(np.max(self.q))

    @property
    def largest_tip(self) -> float:
        """The largest anywhere, at `frame`, in [m]."""
        return float(np.max(self.tip))

    @property
    def largest_v(self) -> float:
        """The largest of v, in [rad/s] or [m/s]."""
        return float(np.max(self.v))

    @property
    def largest_tau(self) -> float:
        """The largest of tau, in [N m] or [N]."""
        return float(np.max(self.tau))


def deviation(
    trajectory: Trajectory,
    reference: Trajectory,
    costs: tuple[float, float],
    frame: str | None = None,
) -> MotionError:
    """The difference of a motion and a reference of the same duration and scene.

    Both interpolants are evaluated at the same sample points of the motion's intervals, ends
    included. The grid of the reference may be different.
    costs: of the motion and of the reference. frame: by default the robot's tip_frames, of which
        the largest error counts.
    Raises InputError for another duration, a motion without a scene, or a frame that is unknown or
    does not move.
    """
    robot = _robot_of(trajectory, reference)
    k, s = sample_points(trajectory)
    one, other = trajectory.sample_intervals(k, s), _at_samples(reference, trajectory, k, s)
    tip = FrameDistance.between(robot, one.q, other.q, frame)
    q = np.abs(robot.difference(other.q, one.q))
    return MotionError(
        relative_difference(*costs),
        _by_interval(trajectory, q),
        _by_interval(trajectory, np.abs(one.v - other.v)),
        _by_interval(trajectory, np.abs(one.tau - other.tau)),
        _by_interval(trajectory, tip.largest),
        _at_nodes(trajectory, q),
        _at_nodes(trajectory, tip.largest),
        tip.frame,
        robot.sliding,
    )


def relative_difference(value: float, reference: float, least: float = 0.0) -> float:
    """|value - reference| / max(|reference|, least); 0 if both are 0."""
    difference, size = abs(value - reference), max(abs(reference), least, np.finfo(float).tiny)
    return 0.0 if difference == 0 else float(difference / size)


def sample_points(trajectory: Trajectory) -> tuple[Index, Array]:
    """Sample points of a comparison: intervals and Chebyshev points in [0, 1], ends included.

    Their number per interval depends on the largest number of inner modes.
    """
    count = max(MIN_SAMPLES, 2 * trajectory.grid.inner_modes + 7)
    N = trajectory.grid.intervals
    return np.repeat(np.arange(N), count), np.tile(chebyshev_points(count), N)


def _at_samples(reference: Trajectory, trajectory: Trajectory, k: Index, s: Array) -> Sample:
    """The reference at sample points of the other motion's intervals."""
    if np.array_equal(reference.grid.steps, trajectory.grid.steps):
        return reference.sample_intervals(k, s)
    return reference.sample(np.clip(times_of(trajectory, k, s), 0.0, reference.duration))


def times_of(trajectory: Trajectory, k: Index, s: Array) -> Array:
    """The times of points in intervals, (M,); in segments none at nodes, where torques may jump."""
    if trajectory.segments is not None:
        s = np.clip(s, FROM_NODES, 1 - FROM_NODES)
    return np.asarray(trajectory.t[k] + s * trajectory.grid.steps[k])


def _by_interval(trajectory: Trajectory, errors: Array) -> Array:
    """The largest value in each interval."""
    N = trajectory.grid.intervals
    return np.asarray(errors.reshape(N, -1, *errors.shape[1:]).max(axis=1))


def _at_nodes(trajectory: Trajectory, errors: Array) -> Array:
    """The values at the nodes."""
    by_sample = errors.reshape(trajectory.grid.intervals, -1, *errors.shape[1:])
    return np.concatenate([by_sample[:, 0], by_sample[-1:, -1]])


def _robot_of(trajectory: Trajectory, reference: Trajectory) -> Robot:
    robot = trajectory.robot
    if robot is None or reference.robot is None:
        raise InputError("comparing motions needs their scenes; one of these was saved without.")
    if abs(trajectory.duration - reference.duration) > 1e-9 * reference.duration:
        raise InputError(
            f"only motions of the same duration can be compared, not {trajectory.duration:g} s "
            f"with {reference.duration:g} s."
        )
    return robot
