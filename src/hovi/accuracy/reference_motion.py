"""The reference motion of a diagram, and the errors of other motions."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.discrete.measures.motion_error import MotionError, relative_difference
from hovi.robot.frame_distance import FrameDistance
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Configurations = Callable[[Array], Array]
"""Times (M,) in [s] -> configurations (M, nq)."""

SAMPLES = 1009
"""Number of times at which motions are compared: prime, so that they do not align with any grid."""
_SHIFT = 0.382


@dataclass(frozen=True, eq=False)
class ReferenceMotion:
    """A motion whose samples are the reference for errors.

    robot: the robot; the error of the tip is the largest of its `tip_frames`.
    duration: T, in [s].
    configurations: times -> configurations of the motion.
    cost: its cost J*, positive.
    """

    robot: Robot
    duration: float
    configurations: Configurations
    cost: float

    @cached_property
    def times(self) -> Array:
        """Times at which motions are compared, shape (SAMPLES,), in [s]."""
        return np.asarray(self.duration * (np.arange(SAMPLES) + _SHIFT) / SAMPLES)

    def error(self, cost: float, configurations: Configurations) -> MotionError:
        """The error of a motion of the same duration, given q(t) only.

        The whole motion counts as one interval: q has shape (1, nv), tip (1,), and the nodes are
        its two ends. v and tau are NaN. cost: J as computed by the method; if it is not finite,
        the errors are infinite.
        """
        if not math.isfinite(cost):
            infinite = np.full((3, self.robot.nv), np.inf)
            return self._record(math.inf, infinite, np.full(3, np.inf), self.robot.tip_frame)
        q, tip = self._distances(self._sampled, configurations(self.times))
        q_at_ends, tip_at_ends = self._distances(self._sampled_ends, configurations(self._ends))
        return self._record(
            relative_difference(cost, self.cost),
            np.vstack([q.max(axis=0), q_at_ends]),
            np.append(tip.largest.max(), tip_at_ends.largest),
            tip.frame,
        )

    def _record(self, cost: float, q: Array, tip: Array, frame: str) -> MotionError:
        """The record of q (3, nv) and tip (3,): largest along the motion, then at its two ends."""
        unknown = np.full((1, self.robot.nv), np.nan)
        return MotionError(
            cost=cost,
            q=q[:1],
            v=unknown,
            tau=unknown,
            tip=tip[:1],
            q_at_nodes=q[1:],
            tip_at_nodes=tip[1:],
            frame=frame,
            sliding=self.robot.sliding,
        )

    def _distances(self, reference: tuple[Array, Array], q: Array) -> tuple[Array, FrameDistance]:
        """|q - q*| per joint coordinate (M, nv), and the distance of the tips."""
        tip = FrameDistance.of(self.robot.tip_frames, self._tips_of(q), reference[1])
        return np.abs(self.robot.difference(reference[0], q)), tip

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
        return q, self._tips_of(q)

    def _tips_of(self, q: Array) -> Array:
        return self.robot.frame_positions(self.robot.tip_frames, q)
