"""The motion that others are measured against, and how far they are from it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.discrete.motion_error import MotionError, relative_difference
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]
Configurations = Callable[[Array], Array]
"""Times (M,) in [s] -> configurations (M, nq)."""

SAMPLES = 1009
"""Times at which motions are compared: a prime, so that they fall on all places of intervals."""
_SHIFT = 0.382


@dataclass(frozen=True, eq=False)
class ReferenceMotion:
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
        """The error of a motion of the same duration, of which only q(t) is known.

        The whole motion is one interval: q has shape (1, nv), tip (1,), and the nodes are its two
        ends. v and tau are NaN. cost: J as the method computes it; where it is not finite, the
        errors are infinite.
        """
        if not math.isfinite(cost):
            return self._record(math.inf, np.full((3, self.robot.nv), np.inf), np.full(3, np.inf))
        q, tip = self._distances(self._sampled, configurations(self.times))
        q_at_ends, tip_at_ends = self._distances(self._sampled_ends, configurations(self._ends))
        return self._record(
            relative_difference(cost, self.cost),
            np.vstack([q.max(axis=0), q_at_ends]),
            np.append(tip.max(), tip_at_ends),
        )

    def _record(self, cost: float, q: Array, tip: Array) -> MotionError:
        """From what is largest along the motion and what is at its ends, (3, nv) and (3,)."""
        unknown = np.full((1, self.robot.nv), np.nan)
        return MotionError(
            cost=cost,
            q=q[:1],
            v=unknown,
            tau=unknown,
            tip=tip[:1],
            q_at_nodes=q[1:],
            tip_at_nodes=tip[1:],
            frame=self.robot.tip_frame,
            sliding=self.robot.sliding,
        )

    def _distances(self, own: tuple[Array, Array], q: Array) -> tuple[Array, Array]:
        """|q - q*| of every joint coordinate and the distance of the tips, (M, nv) and (M,)."""
        tip = np.linalg.norm(self._tip_of(q) - own[1], axis=1)
        return np.abs(self.robot.difference(own[0], q)), tip

    @property
    def _ends(self) -> Array:
        return np.array([0.0, self.duration])

    @cached_property
    def _sampled(self) -> tuple[Array, Array]:
        return self._at(self.times)

    @cached_property
    def _sampled_ends(self) -> tuple[Array, Array]:
        return self._at(self._ends)

    def _at(self, t: Array) -> tuple[Array, Array]:
        q = self.configurations(t)
        return q, self._tip_of(q)

    def _tip_of(self, q: Array) -> Array:
        return self.robot.frame_position(self.robot.tip_frame, q)
