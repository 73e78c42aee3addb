"""How the excess of a coordinate goes on if it is braked: by a jerk, then by an acceleration.

The acceleration goes from what is given to -A with the jerk -J, and stays there; where it is not
given it is -A at once.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

FOREVER = 1e30
"""Time that stands for a ramp without end, in [s]."""
ROUNDING = 1e-9
"""Excess over a polynomial that is rounding, relative to its largest term."""
SAMPLES = 65
"""Number of times at which profiles are compared."""


@dataclass(frozen=True)
class BrakingProfile:
    """The excess x(t) of a coordinate, given x, x', ... at t = 0 and what brakes it.

    rank: order of the acceleration as a derivative of x: 2 for a position, 1 for a velocity, 0 for
        an acceleration or a torque. now: x(0). rates: x', x'', ... as far as they are given.
    acceleration, jerk: A and J, 0 or more; infinite ones act at once.
    """

    rank: int
    now: float
    rates: tuple[float, ...]
    acceleration: float
    jerk: float

    def at(self, t: Array) -> Array:
        """x at times t > 0, in [s], shape (M,)."""
        if len(self.rates) < self.rank - 1 or self.at_once:
            return np.full(len(t), -np.inf)
        if self.rank == 0:
            return self.now - self.jerk * t
        begin = min(self._ramp, FOREVER)
        ramp, after = np.minimum(t, begin), np.maximum(t - begin, 0.0)
        a0, J, A = self._first, self._finite_jerk, self.acceleration
        A = 0.0 if np.isinf(A) else A  # which a ramp without end never reaches
        v = a0 * ramp - J * ramp**2 / 2
        if self.rank == 1:
            return np.asarray(self.now + v - A * after)
        x = a0 * ramp**2 / 2 - J * ramp**3 / 6 + v * after - A * after**2 / 2
        return np.asarray(self.now + self.rates[0] * t + x)

    @property
    def peak(self) -> float:
        """The largest x; infinite if it never ends."""
        a0, J = self._first, self._finite_jerk
        if len(self.rates) < max(self.rank, 1) - 1 or self.at_once or self.rank == 0:
            return self.now
        if self.rank == 1:
            rise = max(a0, 0.0)
            return self.now + (rise**2 / (2.0 * J) if J > 0.0 else np.inf if rise > 0.0 else 0.0)
        w, begin = self.rates[0], self._ramp
        if w == 0.0 and a0 <= 0.0:
            return self.now
        turn = (a0 + np.sqrt(a0**2 + 2.0 * J * w)) / J if J > 0.0 else np.inf
        if turn > begin:
            speed = max(w + a0 * begin - J * begin**2 / 2.0, 0.0)
            turn = begin + (speed / self.acceleration if self.acceleration > 0.0 else np.inf)
        if not np.isfinite(turn):
            return np.inf
        found = self.at(np.array([max(turn, 1e-300)]))
        return float(max(self.now, found[0]))

    @property
    def at_once(self) -> bool:
        """Whether x is inside as soon as the motion begins."""
        if self.rank == 0:
            return bool(np.isinf(self.jerk))
        free = len(self.rates) < self.rank or np.isinf(self.jerk)
        return bool(free and np.isinf(self.acceleration))

    @property
    def _first(self) -> float:
        """The acceleration at t = 0."""
        given = len(self.rates) >= self.rank and np.isfinite(self.jerk)
        return self.rates[self.rank - 1] if given else -self.acceleration

    @property
    def _finite_jerk(self) -> float:
        return self.jerk if np.isfinite(self.jerk) else 0.0

    @property
    def _ramp(self) -> float:
        """The time until the acceleration is -A, in [s]."""
        change = self._first + self.acceleration
        if change <= 0.0:
            return 0.0
        return change / self.jerk if self.jerk > 0.0 else np.inf


def is_below(profile: BrakingProfile, powers: Sequence[float], time: float) -> bool:
    """Whether a profile is at most a polynomial until a time, in [s]."""
    t = np.linspace(0.0, time, SAMPLES)[1:]
    e = np.polynomial.polynomial.polyval(t, powers)
    room = ROUNDING * max(abs(x) * time**j for j, x in enumerate(powers))
    return bool((profile.at(t) <= e + room).all())
