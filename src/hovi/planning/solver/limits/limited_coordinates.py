"""Derivatives of joint coordinates that are limited and polynomials in every interval."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.planning.problem.limits import Limits
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

DERIVATIVES = {"q": 0, "v": 1, "a": 2, "jerk": 3}
"""Order of the derivative that a kind of limit bounds."""


@dataclass(frozen=True, eq=False)
class LimitedCoordinates:
    """Derivatives of joint coordinates that are limited and polynomials in every interval.

    order: of the derivative. joint: its index. Both of shape (C,).
    lower, upper: bounds in each interval, shape (N or 1, C); infinite where there is none.
    ranges: of the limits, shape (C,).
    """

    order: Index
    joint: Index
    lower: Array
    upper: Array
    ranges: Array

    @classmethod
    def of(cls, limits: Limits, grid: Grid, space: ConfigurationSpace | None) -> LimitedCoordinates:
        """Those of limits on a grid; joints of orientations have none."""
        lower, upper = limits.on(grid.t)
        limited = limits.bounded.copy()
        for factor in () if space is None else space.curved:
            limited[:, factor.v] = False
        for row, kind in enumerate(limits.kinds):
            limited[row] &= DERIVATIVES.get(kind, grid.order + 1) <= grid.order
        kinds, joints = np.nonzero(limited)
        orders = [DERIVATIVES[limits.kinds[row]] for row in kinds]
        chosen = (kinds, joints)
        low, high = (side[:, kinds, joints] for side in (lower, upper))
        return cls(np.array(orders, np.intp), joints, low, high, limits.ranges[chosen])

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
        others = limits.bounded.copy()
        kinds = np.array([DERIVATIVES.get(kind, -1) for kind in limits.kinds])
        for order, joint in zip(self.order, self.joint, strict=True):
            others[kinds == order, joint] = False
        return others
