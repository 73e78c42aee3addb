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


def fastest(
    distance: float,
    velocities: tuple[float, float],
    speeds: tuple[float, float],
    acceleration: float,
) -> tuple[float, float]:
    """The least time of a travel between two velocities, in [s], and its peak velocity.

    The joint speeds up to the peak p and slows down, at its speed limit between if it reaches it:

        p^2 = (2 a d + u_0^2 + u_1^2) / 2  for d > 0.

    distance: d. velocities: u_0 and u_1; NaN where free, which are p. speeds: the largest, down and
        up. acceleration: a, the largest; infinite without a limit, as the time may be.
    """
    found = [
        _fastest(side * distance, [side * u for u in velocities], speed, acceleration)
        for side, speed in zip((-1, 1), speeds, strict=True)
    ]
    (down, low), (up, high) = found
    return (up, high) if up <= down else (down, -low)


def _fastest(
    distance: float, velocities: list[float], speed: float, acceleration: float
) -> tuple[float, float]:
    """As `fastest`, of a travel that first goes up; infinite where it has to go down first."""
    given = np.array([u for u in velocities if not np.isnan(u)])
    peak = speed
    if len(given) > 0 and np.isfinite(acceleration):
        squares = float(2 * acceleration * distance + given @ given) / len(given)
        peak = min(speed, float(np.sqrt(squares))) if squares >= 0 else -np.inf
    elif distance < 0:
        return np.inf, peak
    if peak < given.max(initial=0.0):
        return np.inf, peak
    if np.isinf(peak):
        return 0.0, peak
    ramps = float((peak - given).sum()) / acceleration
    cruising = distance - float((peak**2 - given**2).sum()) / (2 * acceleration)
    return ramps + max(cruising, 0.0) / max(peak, NONE), peak
