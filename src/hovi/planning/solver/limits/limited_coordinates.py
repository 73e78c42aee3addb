"""Derivatives of joint coordinates that are limited and polynomials in every interval."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.conditions.joint_quantity import DERIVATIVES
from hovi.discrete.grid import Grid
from hovi.planning.problem.limit_conditions import polynomials
from hovi.planning.problem.limits import Limits
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class LimitedCoordinates:
    """Derivatives of joint coordinates that are limited and polynomials in every interval.

    order: of the derivative. joint: its index. Both of shape (C,).
    lower, upper: bounds in each interval, shape (N or 1, C); infinite where there is none.
    ranges: of the limits, shape (C,). limited: which limits are theirs, shape (kinds, nv).
    """

    order: Index
    joint: Index
    lower: Array
    upper: Array
    ranges: Array
    limited: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, limits: Limits, grid: Grid, space: ConfigurationSpace | None) -> LimitedCoordinates:
        """Those of limits on a grid; joints of orientations have none."""
        lower, upper = limits.on(grid.t)
        limited = polynomials(limits, grid.order, space)
        kinds, joints = np.nonzero(limited)
        orders = [DERIVATIVES[limits.kinds[row]] for row in kinds]
        low, high = (side[:, kinds, joints] for side in (lower, upper))
        return cls(np.array(orders, np.intp), joints, low, high, limits.ranges[limited], limited)

    def differ(self, k: Index, coordinate: Index) -> npt.NDArray[np.bool_]:
        """Whether limits of coordinates are others in intervals k than in those before, (L,)."""
        if len(self.lower) == 1:
            return np.zeros(len(k), dtype=bool)
        pairs = (
            (each[k, coordinate], each[k - 1, coordinate]) for each in (self.lower, self.upper)
        )
        return np.asarray((k > 0) & np.any([here != there for here, there in pairs], axis=0))

    def others(self, limits: Limits) -> npt.NDArray[np.bool_]:
        """Limits of other coordinates, shape (kinds, nv)."""
        return limits.bounded & ~self.limited
