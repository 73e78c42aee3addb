"""What of a prescribed state is outside its limits, or leaves them whatever is done; how far.

How far a coordinate is over a bound is x(t), and the state gives x, x', ... up to an order. Their
excess is led back by the polynomial x + x' t + ... + c t^n with c such that it vanishes at a time:
the braking parabola where a position and its velocity are given. The time is long enough for a
fraction of the acceleration and the jerk that are available.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from math import factorial
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.planning.problem.limits import KINDS, Limits
from hovi.planning.problem.way_back.available_acceleration import available_accelerations
from hovi.planning.problem.way_back.braking_profile import BrakingProfile, is_below
from hovi.robot.space.coordinates import Coordinates
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

SHORTEST = 1e-4
"""First time that is tried, relative to the window."""
STRIDE = 1.05
"""Ratio of two successive times that are tried."""


@dataclass(frozen=True, eq=False)
class Over:
    """A coordinate that is over a bound, or will be.

    kind: its row in limits. coordinate: its index. side: 1 for the upper bound, -1 for the lower.
    now: x, negative inside. rates: x', x'', ... as far as they are given, none of them inwards.
    """

    kind: int
    coordinate: int
    side: int
    now: float
    rates: tuple[float, ...]

    def powers(self, time: float) -> tuple[float, ...]:
        """Coefficients of max(x, 0) + x' t + ... + c t^n, which vanishes at a time."""
        given = [x / factorial(j) for j, x in enumerate((max(self.now, 0.0), *self.rates))]
        rest = sum(x * time**j for j, x in enumerate(given))
        return (*given, -rest / time ** len(given))


@dataclass(frozen=True, eq=False)
class EndState:
    """The state at an end of a motion, or on its way.

    limits: there. jet: q, v, ... in coordinates, (k, nv). held: which of them are prescribed.
    duration: of the neighboring motion, in [s]. window: the least time in which it is led back.
    torque: where the state prescribes it, (nv,); else None. accelerations: see `available`.
    """

    coordinates: Coordinates
    limits: Limits
    jet: Array
    held: npt.NDArray[np.bool_]
    duration: float
    window: float
    torque: Array | None
    accelerations: Callable[[], Array]

    @classmethod
    def of(
        cls,
        coordinates: Coordinates,
        limits: Limits,
        jet: Sequence[Array],
        held: npt.NDArray[np.bool_],
        duration: float,
        window: float,
        scene: Scene | None,
        time: float,
    ) -> Self:
        """That of q, v, ... of shapes (nq,), (nv,), ... at a time in the scene, in [s]."""
        k, (q, v) = len(held), jet[:2]
        torque, jet = None, [coordinates.space.coordinates(q), *jet[1:k]]
        if k > 2 and scene is not None and held.all() and limits.bounded[3].any():
            torque = scene.inverse_dynamics(q[None], v[None], jet[2][None], np.array([time]))[0]

        def accelerations() -> Array:
            return available_accelerations(scene, q, v, time, limits)

        known = coordinates, limits, np.stack(jet), held, duration, window, torque
        return cls(*known, accelerations)

    def over(self, direction: int = 1) -> Iterator[Over]:
        """What is outside, or leads outside within the motion if nothing is done.

        direction: -1 for what came from outside.
        """
        for kind in range(len(self.jet)):
            signs = direction ** np.arange(len(self.jet) - kind)[:, None]
            rates = np.where(np.cumprod(self.held[kind:], axis=0), self.jet[kind:] * signs, 0.0)
            yield from self._over_bounds(kind, self.jet[kind], rates[1:], self.held[kind])
        if self.torque is not None:
            every = np.ones(len(self.torque), dtype=bool)
            yield from self._over_bounds(KINDS.index("tau"), self.torque, self.jet[:0], every)

    def _over_bounds(
        self, kind: int, values: Array, rates: Array, held: npt.NDArray[np.bool_]
    ) -> Iterator[Over]:
        limits = self.limits
        slack = limits.tolerance * limits.ranges[kind]
        for side, bound in ((1, limits.upper[kind]), (-1, limits.lower[kind])):
            now, outwards = side * (values - bound), np.maximum(side * rates, 0.0)
            far = now + sum(x * self.duration ** (j + 1) for j, x in enumerate(outwards))
            for i in np.flatnonzero(held & (far > slack) & np.isfinite(bound)):
                given = self._given(kind, int(i))
                yield Over(kind, int(i), side, float(now[i]), tuple(outwards[:given, i]))

    def _given(self, kind: int, i: int) -> int:
        """How many derivatives of a kind are prescribed."""
        return 0 if kind >= len(self.jet) else int(np.cumprod(self.held[kind:, i]).sum()) - 1

    def slack(self, over: Over) -> float:
        """The tolerance of its limit, in its unit."""
        return float(self.limits.tolerance * self.limits.ranges[over.kind, over.coordinate])

    def bound(self, over: Over) -> float:
        """The bound that it is over."""
        side = self.limits.upper if over.side > 0 else self.limits.lower
        return float(side[over.kind, over.coordinate])

    def peak(self, over: Over, time: float) -> float:
        """The largest excess while it is led back by a time."""
        e = np.polynomial.Polynomial(over.powers(time))
        turns = np.real(e.deriv().roots())  # of one that is not real the value is less
        return float(max(e(0.0), *e(np.clip(turns, 0.0, time)), 0.0))

    def is_forced(self, over: Over, fraction: float, direction: int = 1) -> bool:
        """Whether it exceeds its limit by more than the tolerance if so much is used.

        At the bound itself it is led back within the window, as if no more were available.
        fraction: of what is available.
        """
        if over.now >= -self.slack(over):
            time = self.least_time(over, fraction, direction, self.window)
            return time is None or self.peak(over, time) > self.slack(over)
        profile = self._profile(over, fraction, direction)
        if profile.at_once:  # nothing bounds accelerations
            return over.now + self.peak(over, self.window) > self.slack(over)
        return profile.peak > self.slack(over)

    def least_time(self, over: Over, fraction: float, direction: int, first: float) -> float | None:
        """The least time from a first one on by which it is led back; None within the motion."""
        profile, time = self._profile(over, fraction, direction), first
        profile = dataclasses.replace(profile, now=max(profile.now, 0.0))
        while time <= self.duration:
            if is_below(profile, over.powers(time), time):
                return time
            time *= STRIDE
        return None

    def _profile(self, over: Over, fraction: float, direction: int) -> BrakingProfile:
        """How it goes on with a fraction of the acceleration and the jerk that lead it inside."""
        inwards = -over.side * (direction if over.kind % 2 else 1)
        acceleration = fraction * float(self._available[int(inwards > 0), over.coordinate])
        torque = over.kind == KINDS.index("tau")
        rate, jerk = "torque_rate" if torque else "jerk", np.inf
        if rate in self.limits.kinds:
            side = self.limits.upper if inwards > 0 else -self.limits.lower
            jerk = fraction * float(side[KINDS.index(rate), over.coordinate])
        rank = 0 if torque else 2 - over.kind
        return BrakingProfile(rank, over.now, over.rates, acceleration, jerk)

    @cached_property
    def _available(self) -> Array:
        """The largest accelerations down and up, (2, nv)."""
        return self.accelerations()
