"""How far a motion is from another one, in units that a person has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]
Configurations = Callable[[Array], Array]
"""Times (M,) in [s] -> configurations (M, nq)."""

SAMPLES = 1009
"""Times at which motions are compared: a prime, so that they fall on all places of intervals."""
_SHIFT = 0.382
_MILLIMETRES = 1e3


@dataclass(frozen=True)
class MotionError:
    """What separates a motion from the one that it stands for.

    cost: |J/J* - 1|. joints: the largest |q - q*| over joints and the whole motion, in [rad] (or
    [m] where a joint slides). tip: the largest distance of the tip frame, in [mm].
    """

    cost: float
    joints: float
    tip: float


@dataclass(frozen=True, eq=False)
class Yardstick:
    """A motion that others are measured against, sampled once.

    robot: what moves; its `tip_frame` is the tip.
    duration: T, in [s].
    configurations: the motion.
    cost: its cost J*, positive.
    """

    robot: Robot
    duration: float
    configurations: Configurations
    cost: float

    @cached_property
    def times(self) -> Array:
        """Where motions are compared, shape (SAMPLES,), in [s]."""
        return np.asarray(self.duration * (np.arange(SAMPLES) + _SHIFT) / SAMPLES)

    def error(self, cost: float, configurations: Configurations) -> MotionError:
        """The error of a motion of the same duration."""
        q = configurations(self.times)
        apart = np.abs(self.robot.difference(self._q, q))
        tip = np.linalg.norm(self._tip_of(q) - self._tip, axis=1)
        relative = abs(cost - self.cost) / max(abs(self.cost), np.finfo(float).tiny)
        return MotionError(relative, float(apart.max()), _MILLIMETRES * float(tip.max()))

    @cached_property
    def _q(self) -> Array:
        return self.configurations(self.times)

    @cached_property
    def _tip(self) -> Array:
        return self._tip_of(self._q)

    def _tip_of(self, q: Array) -> Array:
        return self.robot.frame_position(self.robot.tip_frame, q)
