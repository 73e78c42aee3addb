"""Configurations without contact, in coordinates in which a path is planned."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.planning.clearance.distances import Distances
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

RESOLUTION = 0.05
"""Largest change of a joint between configurations that are looked at, in [rad]; half a link of
1 m moves by 5 cm, and the margin is kept on both sides of an obstacle."""
SLIDING_RESOLUTION = 0.02
"""Largest change of a sliding joint between configurations that are looked at, in [m]."""
WIDE = np.pi
"""How far paths may leave the ends in joints whose ranges go further, in [rad] or [m]."""
ROUNDING = 1e-9
"""Shortfall of the margin that is rounding, in [m]."""


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """Coordinates x = (q (-) origin) / speed, so that lengths of paths are times at full speed.

    problem: whose robot moves, and whose limits on positions and margin hold. origin: (nq,).
    """

    problem: TrajectoryProblem
    origin: Array

    @classmethod
    def of(cls, problem: TrajectoryProblem, origin: Array) -> FreeSpace | None:
        """The space of a problem; None where paths say too little about its motions.

        So where distances depend on time, with passive joints, and for joints that form no vector
        space.
        """
        distances = problem.distances
        if distances is None or distances.timed or not problem.about_robot:
            return None
        if problem.scene.passive or not problem.coordinates.space.flat:
            return None
        return cls(problem, origin)

    @property
    def _distances(self) -> Distances:
        assert self.problem.distances is not None
        return self.problem.distances

    @property
    def margin(self) -> float:
        """The margin to keep, in [m]."""
        assert self.problem.clearance is not None
        return float(self.problem.clearance.margin)

    @cached_property
    def speed(self) -> Array:
        """The largest velocity of every joint, 1 where it is not limited, shape (nv,)."""
        limits = self.problem.limits
        if limits is None:
            return np.ones(self.problem.coordinates.nv)
        largest = np.minimum(limits.upper[1], -limits.lower[1])
        return np.where(np.isfinite(largest) & (largest > 0), largest, 1.0)

    @cached_property
    def _steps(self) -> Array:
        """The largest change of every joint between configurations that are looked at, (nv,)."""
        sliding = self.problem.robot.sliding
        return np.where(sliding, SLIDING_RESOLUTION, RESOLUTION)

    def x_between(self, q: Array, other: Array) -> Array:
        """The change of the coordinates from one configuration (nq,) to another one, (nv,)."""
        return np.asarray(self.problem.coordinates.difference(q, other) / self.speed)

    def q(self, x: Array) -> Array:
        """The configurations at coordinates (M, nv), shape (M, nq)."""
        origin = np.broadcast_to(self.origin, (len(x), len(self.origin)))
        return np.asarray(self.problem.coordinates.integrate(origin, x * self.speed))

    def around(self, start: Array, goal: Array) -> tuple[Array, Array]:
        """The lower and upper bounds of paths between two points, (nv,) each."""
        least, most = np.minimum(start, goal), np.maximum(start, goal)
        lower, upper = least - WIDE / self.speed, most + WIDE / self.speed
        limits = self.problem.limits
        if limits is not None:
            here = self.problem.coordinates.space.coordinates(self.origin)
            lower = np.maximum(lower, (limits.lower[0] - here) / self.speed)
            upper = np.minimum(upper, (limits.upper[0] - here) / self.speed)
        return np.minimum(lower, least), np.maximum(upper, most)

    def is_free_between(self, x: Array, y: Array) -> bool:
        """Whether the margin is kept on the straight way between two points."""
        parts = int(np.ceil(np.max(np.abs(y - x) * self.speed / self._steps)))
        fractions = np.linspace(0.0, 1.0, parts + 1)[:, None]
        return self.depth(self.q(x + fractions * (y - x))) <= ROUNDING

    def depth(self, q: Array) -> float:
        """By how much configurations (M, nq) miss the margin at most, in [m]."""
        distances = self._distances
        return float(self.margin - distances.values(q, self.margin + RESOLUTION).min())
