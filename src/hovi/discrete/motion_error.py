"""How far one motion is from another, everywhere along it: the measure behind every error."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hovi.discrete.stored_torque import chebyshev_points
from hovi.discrete.trajectory import Sample, Trajectory
from hovi.errors import InputError
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

LEAST_PLACES = 9
"""Places of an interval at which two motions are compared, both ends included, at the least."""


@dataclass(frozen=True, eq=False)
class MotionError:
    """The distance of a motion from another one, the largest of each interval.

    cost: |J - J'| / |J'|, of the two costs; 0 where both are 0.
    q, v, tau: of every joint coordinate, shape (N, nv), in [rad], [rad/s] and [N m]; metres and
        newtons for sliding joints.
    tip: of the origin of the frame, shape (N,), in [m]. frame: its name.
    q_at_nodes, tip_at_nodes: the same at the nodes alone, shape (N + 1, nv) and (N + 1,).
    sliding: which joint coordinates slide, shape (nv,).
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

    @property
    def angle(self) -> float:
        """The largest of the turning joints, in [rad]; 0 where none turns."""
        return float(np.max(self.q[:, ~self.sliding], initial=0.0))

    @property
    def slide(self) -> float:
        """The largest of the sliding joints, in [m]; 0 where none slides."""
        return float(np.max(self.q[:, self.sliding], initial=0.0))

    @property
    def largest_q(self) -> float:
        """The largest of all joints, in [rad] or [m]."""
        return float(np.max(self.q))

    @property
    def largest_tip(self) -> float:
        """The largest of the frame, in [m]."""
        return float(np.max(self.tip))

    @property
    def largest_v(self) -> float:
        """The largest of all joints, in [rad/s] or [m/s]."""
        return float(np.max(self.v))

    @property
    def largest_tau(self) -> float:
        """The largest of all joints, in [N m] or [N]."""
        return float(np.max(self.tau))


def deviation(
    trajectory: Trajectory,
    reference: Trajectory,
    costs: tuple[float, float],
    frame: str | None = None,
) -> MotionError:
    """The distance of a motion from a reference of the same duration and scene.

    Both are read by their interpolants at the same places of the motion's intervals, ends
    included. The reference's grid may be any other.
    costs: of the motion and of the reference. frame: by default the robot's tip_frame.
    Raises InputError for another duration, a motion without a scene, or an unknown frame.
    """
    robot = _robot_of(trajectory, reference)
    name = robot.tip_frame if frame is None else frame
    k, s = places(trajectory)
    one, other = trajectory.sample_intervals(k, s), _at_places(reference, trajectory, k, s)
    tips = [robot.frame_position(name, q) for q in (one.q, other.q)]
    tip = np.linalg.norm(tips[0] - tips[1], axis=1)
    q = np.abs(robot.difference(other.q, one.q))
    return MotionError(
        relative_difference(*costs),
        _by_interval(trajectory, q),
        _by_interval(trajectory, np.abs(one.v - other.v)),
        _by_interval(trajectory, np.abs(one.tau - other.tau)),
        _by_interval(trajectory, tip),
        _at_nodes(trajectory, q),
        _at_nodes(trajectory, tip),
        name,
        robot.sliding,
    )


def relative_difference(value: float, reference: float) -> float:
    """|value - reference| / |reference|; 0 where both are 0."""
    difference = abs(value - reference)
    return 0.0 if difference == 0 else difference / max(abs(reference), np.finfo(float).tiny)


def places(trajectory: Trajectory) -> tuple[Index, Array]:
    """Intervals and places in [0, 1] that a comparison looks at: Chebyshev points, ends included.

    All intervals have as many as the most flexible scheme needs.
    """
    count = max(LEAST_PLACES, 2 * trajectory.grid.inner_modes + 7)
    N = trajectory.grid.intervals
    return np.repeat(np.arange(N), count), np.tile(chebyshev_points(count), N)


def _at_places(reference: Trajectory, trajectory: Trajectory, k: Index, s: Array) -> Sample:
    """The reference at places of the other motion's intervals."""
    if np.array_equal(reference.grid.steps, trajectory.grid.steps):
        return reference.sample_intervals(k, s)
    t = trajectory.t[k] + s * trajectory.grid.steps[k]
    return reference.sample(np.clip(t, 0.0, reference.duration))


def _by_interval(trajectory: Trajectory, errors: Array) -> Array:
    """The largest of each interval from values at its places."""
    N = trajectory.grid.intervals
    return np.asarray(errors.reshape(N, -1, *errors.shape[1:]).max(axis=1))


def _at_nodes(trajectory: Trajectory, errors: Array) -> Array:
    """The values at the nodes from values at the places."""
    by_place = errors.reshape(trajectory.grid.intervals, -1, *errors.shape[1:])
    return np.concatenate([by_place[:, 0], by_place[-1:, -1]])


def _robot_of(trajectory: Trajectory, reference: Trajectory) -> Robot:
    robot = trajectory.robot
    if robot is None or reference.robot is None:
        raise InputError("motions are compared with their scenes; this one was saved without it.")
    if abs(trajectory.duration - reference.duration) > 1e-9 * reference.duration:
        raise InputError(
            f"motions of the same duration are compared, not {trajectory.duration:g} s with "
            f"{reference.duration:g} s."
        )
    return robot
