"""How far joints travel in a time, and the least time of a travel, by limits on v and a.

A joint that rests at r of the two ends of a time T, with |v| <= v_max and |a| <= a_max, travels at
most

    v T - r v^2 / (2 a_max),  v = min(v_max, a_max T / r).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.planning.problem.limits import Limits
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Rests = npt.NDArray[np.intp]

NONE = 1e-300
"""Stands for a speed or an acceleration of zero in quotients."""


@dataclass(frozen=True, eq=False)
class Pace:
    """How fast the joints can be: `down` and `up` at most, and at most `acceleration`.

    All are positive and of shape (nv,), infinite without a limit.
    """

    down: Array
    up: Array
    acceleration: Array

    @classmethod
    def of(cls, limits: Limits) -> Pace:
        """The pace that limits allow, exceeded by their tolerance and by what is excused."""
        slack = limits.tolerance * limits.ranges[1:3]
        for each in limits.excused:
            if each.limit in ("v", "a"):
                slack[each.row - 1, each.coordinate] += each.excess
        low, high = limits.lower[1:3] - slack, limits.upper[1:3] + slack
        fastest = np.maximum(np.abs(low[1]), np.abs(high[1]))
        down, up = np.maximum(-low[0], 0.0), np.maximum(high[0], 0.0)
        return cls(np.maximum(down, NONE), np.maximum(up, NONE), np.maximum(fastest, NONE))

    def travel(self, time: float, rests: Rests) -> tuple[Array, Array]:
        """The farthest that joints come in a time in [s], down and up, both positive, (nv,).

        rests: number of ends at which each joint rests, (nv,).
        """
        return self._travel(self.down, time, rests), self._travel(self.up, time, rests)

    def _travel(self, speed: Array, time: float, rests: Rests) -> Array:
        with np.errstate(invalid="ignore", divide="ignore"):  # infinite where nothing is limited
            peak = np.where(rests > 0, np.minimum(speed, self.acceleration * time / rests), speed)
            ramp = np.where(rests > 0, rests * peak / (2 * self.acceleration), 0.0)
            return np.where(np.isfinite(peak), peak * (time - ramp), np.inf)

    def least_time(self, distance: Array, rests: Rests) -> Array:
        """Lower bounds of the times of travels (..., nv), in [s]. rests: as for `travel`."""
        speed = np.where(distance >= 0, self.up, self.down)
        far, ramps = np.abs(distance), rests / (2 * self.acceleration)
        with np.errstate(invalid="ignore"):  # infinite where nothing is limited
            cruising = far / speed + np.where(ramps > 0, ramps * speed, 0.0)
            is_cruising = (ramps == 0) | (far > ramps * speed**2)
        return np.where(is_cruising, cruising, 2 * np.sqrt(ramps * far))
