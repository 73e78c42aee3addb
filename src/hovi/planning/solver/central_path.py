"""Points of the central path of a solve within limits, from which nearby problems are solved."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import stretched
from hovi.optimize.barrier import Barrier
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.planning.solver.near.clearance_rows import ClearanceRows
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

FARTHEST = 0.1
"""Largest change of q from a point of a central path to its solution, in [rad] or [m], with which a
solve for other ends begins at the point among obstacles: it may be on the way to another minimum.
"""


@dataclass(frozen=True, eq=False)
class CentralPath:
    """Minima of the action with a logarithmic barrier, for falling barrier parameters.

    A motion at its limits is a bad start for another motion, as every step ends at a bound; one
    with a barrier as large as the difference of the two has room to move.

    points: barrier parameters, relative to the mean density of the cost, descending, and paths.
    rows: bounded control points; None to build them anew.
    barrier: slacks and multipliers of the solution, at the points and in the rows; None for none.
    near: rows of distances; None to find them anew.
    conditions: multipliers of the conditions; None for none.
    margins: of bounds at the points for what the solution does between them; None for none.
    """

    points: tuple[tuple[float, DiscretePath], ...]
    rows: LimitRows | None
    barrier: Barrier | None = None
    near: ClearanceRows | None = None
    conditions: tuple[Array, ...] | None = None
    margins: Array | None = None

    def __getstate__(self) -> dict[str, Any]:
        """The state without rows of distances, which are found anew where it was sent to."""
        return vars(self) | {"near": None}

    @property
    def level(self) -> float:
        """The barrier parameter of the solution."""
        return self.points[-1][0]

    @property
    def last(self) -> DiscretePath:
        """The solution."""
        return self.points[-1][1]

    def fits(self, grid: Grid) -> bool:
        """Whether it is on as many intervals as a grid."""
        return len(self.last.z) == grid.intervals

    def at(self, level: float) -> tuple[float, DiscretePath]:
        """The last point whose parameter is at least a level; the first if there is none."""
        large = [point for point in self.points if point[0] >= level]
        return large[-1] if large else self.points[0]

    def close(self, level: float, on: Coordinates) -> tuple[float, DiscretePath]:
        """As `at`, or the next point that is no farther than FARTHEST from the solution.

        on: the coordinates of the paths.
        """
        first = self.at(level)
        for point in self.points:
            apart = np.abs(on.difference(point[1].q, self.last.q)).max()
            if point[0] <= first[0] and apart <= FARTHEST:
                return point
        return self.points[-1]

    def ending_at(self, path: DiscretePath) -> CentralPath:
        """The same with another last path, on the same grid."""
        return dataclasses.replace(self, points=(*self.points[:-1], (self.level, path)))

    def on(self, grid: Grid, paths: tuple[DiscretePath, ...]) -> CentralPath:
        """The same with other paths, on a grid of the same intervals, and with its rows fixed."""
        rows = None if self.rows is None else self.rows.fixed_on(grid)
        near = None if self.near is None else self.near.copied(fixed=True)
        levels = (level for level, _ in self.points)
        points = tuple(zip(levels, paths, strict=True))
        return CentralPath(points, rows, near=near, conditions=self.conditions)

    def resampled(self, own: TrajectoryProblem, other: TrajectoryProblem) -> CentralPath:
        """The same curves on the grid of another problem, whose rows are to be found anew.

        own: the problem that it belongs to.
        """
        T, k = other.grid.duration, other.ld.k
        points = tuple(
            (level, other.path(stretched(own.trajectory(path), T, k)))
            for level, path in self.points
        )
        return CentralPath(points, None, conditions=self.conditions)

    def from_ends_of(self, problem: TrajectoryProblem) -> CentralPath:
        """The same for the ends of a problem and what its start exceeds; new rows have no forces.

        Without rows and multipliers if ends are free that were not, or the reverse.
        """
        if self.rows is None:
            return self
        if not np.array_equal(self.rows.free_ends, problem.free_ends):
            return CentralPath(self.points, None)
        if problem.limits is None:
            return self
        rows, kept = self.rows.between(problem.limits)
        if rows is self.rows:
            return self
        barrier = self.barrier
        if barrier is not None:
            first = len(barrier.s) - self.rows.size
            index = np.concatenate([np.arange(first), np.where(kept < 0, -1, first + kept)])
            barrier = barrier.of(index)
            s = np.append(
                barrier.s[:first], np.where(kept < 0, rows.values(self.last), barrier.s[first:])
            )
            barrier = dataclasses.replace(barrier, s=s)
        return dataclasses.replace(self, rows=rows, barrier=barrier)

    def freed(self) -> CentralPath:
        """The same with rows that may be refined."""
        rows = None if self.rows is None else self.rows.freed()
        near = None if self.near is None else self.near.copied(fixed=False)
        return dataclasses.replace(self, rows=rows, near=near)
