"""What a motion misses of equations along it between the nodes, where grids do not impose them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hovi.conditions.missed_along import missed_along
from hovi.discrete.measures.motion_error import sample_points
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]

NEGLIGIBLE_FRACTION = 0.01
"""Largest torque of a passive joint along a motion, relative to that of the other joints."""

LEAST_TORQUE = 1e-9
"""Smallest torque that others are relative to, as a fraction of `torque_scale`: at rest all torques
are rounding errors."""


class PassiveTorque(NamedTuple):
    """The torques of passive joints along a motion, which should vanish.

    by_interval: the largest of each interval, relative to the largest torque of the other joints,
        shape (N,).
    joint: the passive joint with the largest torque. torque: that torque. largest: the largest
        torque of the other joints; both in [N m] or [N].
    """

    by_interval: Array
    joint: str
    torque: float
    largest: float

    @property
    def fraction(self) -> float:
        """The largest of by_interval."""
        return float(self.by_interval.max())


def passive_torque(problem: TrajectoryProblem, trajectory: Trajectory) -> PassiveTorque | None:
    """The torques of passive joints along a motion; None if no joint is passive, or all are."""
    passive, nv = problem.passive, trajectory.v.shape[1]
    active = np.delete(np.arange(nv), passive)
    if len(passive) == 0 or len(active) == 0:
        return None
    tau = np.abs(trajectory.sample_intervals(*sample_points(trajectory)).tau)
    largest = max(float(tau[:, active].max()), LEAST_TORQUE * problem.torque_scale)
    by_interval = tau[:, passive].max(axis=1).reshape(trajectory.grid.intervals, -1).max(axis=1)
    worst = int(passive[np.argmax(tau[:, passive].max(axis=0))])
    name = trajectory.coordinate_names[worst]
    return PassiveTorque(by_interval / largest, name, float(tau[:, worst].max()), largest)


class MissedBetweenNodes(NamedTuple):
    """What equations along a motion are missed by between its nodes, relative to what is accepted.

    by_interval: the largest of each interval, shape (N,). worst: the one that is missed most.
    """

    by_interval: Array
    worst: str


def missed_between_nodes(
    problem: TrajectoryProblem, trajectory: Trajectory
) -> MissedBetweenNodes | None:
    """What is missed of equations along a motion, and of passive torques; None without any."""
    found = [
        MissedBetweenNodes(each.by_interval, f"condition {each.given.name!r}")
        for each in missed_along(problem.along, trajectory)
    ]
    passive = passive_torque(problem, trajectory)
    if passive is not None:
        relative = passive.by_interval / NEGLIGIBLE_FRACTION
        found.append(MissedBetweenNodes(relative, f"the torque of {passive.joint!r}"))
    if not found:
        return None
    worst = max(found, key=lambda each: float(each.by_interval.max()))
    return MissedBetweenNodes(np.max([each.by_interval for each in found], axis=0), worst.worst)
