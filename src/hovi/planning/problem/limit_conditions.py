"""Limits as conditions: each quantity of joints between its bounds, at all times."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import TOLERANCE, Condition
from hovi.conditions.excess import excess_along
from hovi.conditions.joint_quantity import DERIVATIVES, JointQuantity
from hovi.conditions.places import AtPoints, ControlPoints
from hovi.conditions.sets import TwoSided
from hovi.discrete.trajectory import Sample, Trajectory
from hovi.planning.problem.limits import Limits
from hovi.robot.robot import Robot
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


AT_LIMIT = 1e-3
"""Distance to a bound, as a fraction of its range, within which an output is at the bound."""


@dataclass(frozen=True, eq=False)
class LimitRange(TwoSided):
    """The bounds of some joints in a row of limits: of each segment, wider for what is excused."""

    limits: Limits
    row: int
    joints: npt.NDArray[np.intp]

    def at(self, t: Array, size: int | None, within: Array | None = None) -> tuple[Array, Array]:
        """See TwoSided."""
        low, high = self.limits.at(t if within is None else within)
        if self.limits.excused:
            low, high = low - self.limits.wider(-1, t), high + self.limits.wider(1, t)
        return low[:, self.row, self.joints], high[:, self.row, self.joints]


def limit_conditions(
    limits: Limits, order: int, space: ConfigurationSpace | None, on: Coordinates | None = None
) -> list[Condition[TwoSided, ControlPoints | AtPoints]]:
    """The conditions that limits are: on polynomials by control points, then on others.

    order: of the Lagrangian. space: of the configurations; None for a vector space. on: has names
    and units, in messages.
    """
    polynomial = polynomials(limits, order, space)
    masks = (ControlPoints(), polynomial), (AtPoints(), limits.bounded & ~polynomial)
    return [
        _condition(limits, int(row), np.flatnonzero(mask[row]), where, space, on)
        for where, mask in masks
        for row in np.flatnonzero(mask.any(axis=1))
    ]


def _condition(
    limits: Limits,
    row: int,
    joints: npt.NDArray[np.intp],
    where: ControlPoints | AtPoints,
    space: ConfigurationSpace | None,
    on: Coordinates | None,
) -> Condition[TwoSided, Any]:
    """That of some joints in a row of limits."""
    y = JointQuantity(limits.kinds[row], joints, space, on)
    scale, tolerance = limits.ranges[row, joints], max(limits.tolerance, TOLERANCE)
    on_joints = LimitRange(limits, row, joints)
    return Condition(y, on_joints, where, limits.kinds[row], scale=scale, tolerance=tolerance)


def polynomials(limits: Limits, order: int, space: ConfigurationSpace | None) -> Mask:
    """Which limits are on polynomials in every interval, (kinds, nv): none of orientations."""
    derivatives = [DERIVATIVES.get(kind, order + 1) <= order for kind in limits.kinds]
    limited = limits.bounded & np.array(derivatives)[:, None]
    for factor in () if space is None else space.curved:
        limited[:, factor.v] = False
    return np.asarray(limited)


def closeness(motion: Trajectory, limits: Limits) -> Array:
    """Smallest distance of each output from its bounds, as a fraction of its range, (kinds, nv).

    Negative where a limit is exceeded, infinite where there is none. Rows as in limits.kinds.
    """
    return np.asarray(closeness_by_interval(motion, limits).min(axis=0))


def closeness_by_interval(motion: Trajectory, limits: Limits) -> Array:
    """`closeness` in each interval, (N, kinds, nv)."""
    found = np.full((motion.grid.intervals, *limits.lower.shape), np.inf)
    for each in limit_conditions(limits, motion.grid.order, motion.space):
        assert isinstance(each.on, LimitRange)
        found[:, each.on.row, each.on.joints] = -excess_along(motion, each).max(axis=0)
    return found


def at_limit(limits: Limits, motion: Sample, robot: Robot | None) -> Mask:
    """Which of q, v, a and tau are at a bound, shape (M, 4, nv)."""
    space = None if robot is None else robot.curved_space
    q = motion.q if space is None else space.coordinates(motion.q)
    tau = motion.tau if motion.tau.shape[1] > 0 else np.zeros_like(motion.v)
    outputs = np.stack([q, motion.v, motion.a, tau], axis=1)
    return np.asarray(limits.first_kinds.excess(outputs) >= -AT_LIMIT)
