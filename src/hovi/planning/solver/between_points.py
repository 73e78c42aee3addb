"""Bounds at the quadrature points, tightened for what a motion exceeds between the points.

A bound is tightened by as much as the motion comes nearer to it between the points of an interval
than at them, so that it just reaches the bound there. This changes with the motion: while the
barrier falls margins follow it both ways, and at each barrier parameter one that was relaxed and is
exceeded again stays. So a solve ends within its bounds everywhere, where otherwise solves would
have to be repeated with other margins. Exchange methods [HettichKortanek1993] add the instant at
which a bound is exceeded instead.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.planning.problem.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]

LARGEST_MARGIN = 0.05
"""Largest margin, as a fraction of the range; where more is exceeded, intervals are halved."""
UNUSED = 5.0
"""Unused margin, in tolerances, from which it is relaxed."""
STEEPEST = 10.0
"""Largest decrease of a wanted margin per increase of a margin that is extrapolated."""
NEXT_LEVEL = 0.3
"""Barrier parameter, relative to the one before, at which every margin may be relaxed again."""


class MarginsBetweenPoints:
    """Margins of bounds at the points of a grid.

    excess: over the lower and upper bounds of each interval, at all times, (2, N, K), from a motion
        of a problem; as fractions of the ranges.
    tolerance: largest excess that is none.
    values: by which bounds are tightened, (2, N, K). fixed: whether they stay.
    """

    def __init__(
        self,
        excess: Callable[[TrajectoryProblem, DiscretePath], Array],
        tolerance: float,
        shape: tuple[int, int, int],
    ) -> None:
        self.excess, self.tolerance, self.fixed = excess, tolerance, False
        self.values = np.zeros(shape)
        self.begin()

    def begin(self) -> None:
        """Begin another solve."""
        self._last: tuple[Array, Array] | None = None
        self._at_level(np.inf)

    def _at_level(self, level: float) -> None:
        """Let margins be relaxed at a barrier parameter."""
        self._level = level
        self._relaxed = self._firm = np.zeros(self.values.shape, dtype=bool)

    def follow(
        self, problem: TrajectoryProblem, path: DiscretePath, at_points: Array, level: float
    ) -> bool:
        """Take the margins that a motion calls for; whether any of them changed.

        at_points: the excess there, (2, N, K); -inf for what is not bounded at points.
        level: barrier parameter at the motion, relative to the mean density of the cost.
        """
        near = at_points > -LARGEST_MARGIN
        if self.fixed or not near.any():
            return False
        between = self.excess(problem, path)
        beyond = np.where(near, between - np.where(near, at_points, 0.0), 0.0)
        held = near & ((between > self.tolerance) | (self.values > 0.0))
        more = np.clip(beyond + 0.5 * self.tolerance, 0.0, LARGEST_MARGIN)
        wanted = np.where(held, more, 0.0)
        if level <= NEXT_LEVEL * self._level:
            self._at_level(level)
        exceeded = (between > self.tolerance) & (wanted > self.values)
        self._firm = self._firm | (self._relaxed & exceeded)
        relaxed = (wanted < self.values - UNUSED * self.tolerance) & ~self._firm
        if not (exceeded | relaxed).any():
            return False
        self._relaxed = self._relaxed | relaxed
        slope, last = np.zeros(wanted.shape), self._last
        if last is not None:
            change = self.values - last[0]
            np.divide(wanted - last[1], change, out=slope, where=np.abs(change) > self.tolerance)
        slope = np.clip(slope, -STEEPEST, 0.0)
        self._last = self.values, wanted
        found = (wanted - slope * self.values) / (1.0 - slope)
        self.values = np.where(relaxed, found, np.maximum(self.values, found))
        return True
