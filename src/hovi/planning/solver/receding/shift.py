"""A motion shifted along its time: the problem, the paths and the central path of what is left.

Where the rest has another duration than what is left, it is sampled again, on as many intervals as
the whole motion has: a horizon that moves keeps its grid.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from hovi.conditions.asked import times_of
from hovi.conditions.condition import Condition
from hovi.conditions.places import AtTimes
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.path_on_grid import path_on_grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.clock import SAME_LENGTH
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.central_path import CentralPath
from hovi.planning.solver.receding.ends import first_state, turned
from hovi.planning.solver.receding.remainder import Array, Index, Remainder
from hovi.scene.segmented_lagrangian import NODE_TOLERANCE, SegmentedLagrangian
from hovi.system.dataclass import dataclass

Segmented = TypeVar("Segmented", SegmentedLagrangian, Limits)


@dataclass(frozen=True, eq=False)
class Shift:
    """The rest of a motion from a time on, run through in a given duration.

    problem: of the whole motion. elapsed: the time, in [s]. duration: of what follows, in [s].
    """

    problem: TrajectoryProblem
    elapsed: float
    duration: float

    @classmethod
    def of(cls, problem: TrajectoryProblem, elapsed: float, duration: float | None) -> Shift:
        """The shift by a time; duration: what is left if None.

        Raises InputError for a time after the end, and for periodic motions.
        """
        T = problem.grid.duration
        if not 0.0 <= elapsed < T:
            raise InputError(
                f"the motion lasts {T:g} s, and it cannot go on after {elapsed:g} s: give a time "
                "from 0 to before its end."
            )
        if duration is not None and not (np.isfinite(duration) and duration > 0):
            raise InputError(f"the duration must be positive and finite, got {duration} s.")
        if problem.periodic:
            raise InputError("a periodic motion has no rest: replan it with its whole period.")
        left = T - elapsed
        if duration is None or abs(duration - left) <= SAME_LENGTH * T:
            duration = left
        shift = cls(problem, elapsed, duration)
        _ = shift.grid  # raises for steps that are too short or too long
        return shift

    def between(self, start: State, goal: State | FrameGoal) -> TrajectoryProblem:
        """The problem of what is left, between other states, by a clock that starts anew.

        Via points and segments that have passed are left out. Times of the others are stretched
        like the motion; effects, obstacles and conditions go on as they would have.
        """
        via = tuple(
            dataclasses.replace(each, time=(each.time - self.elapsed) * self._ratio)
            for each in self._via
        )
        limits, clearance = self._limits, self.problem.clearance
        return dataclasses.replace(
            self.problem,
            ld=self._ld,
            start=start,
            goal=goal,
            via=via,
            limits=None if limits is None else self._stretched(limits),
            clearance=None if clearance is None else self._clearance(clearance),
            conditions=tuple(filter(None, map(self._later, self.problem.conditions))),
        )

    def _clearance(self, of: Clearance) -> Clearance:
        """The clearance of what is left: what is carried is carried in the same segments."""
        later = of.from_time(self.elapsed)
        parts = [
            (name, begin * self._ratio, end * self._ratio) for name, begin, end in later.during
        ]
        return dataclasses.replace(later, during=parts) if parts else later

    @cached_property
    def _ld(self) -> DiscreteLagrangian:
        """That of what is left."""
        of = self.problem.ld.lagrangian.within(self.elapsed, self.problem.grid.duration)
        if isinstance(of, SegmentedLagrangian):
            of = self._stretched(of)
        return DiscreteLagrangian(of, self.grid)

    @cached_property
    def _limits(self) -> Limits | None:
        """The limits of what is left, before it is stretched."""
        limits = self.problem.limits
        return limits and limits.within(self.elapsed, self.problem.grid.duration)

    def _stretched(self, of: Segmented) -> Segmented:
        """The same of segments that are stretched like the motion."""
        if self._ratio == 1.0 or not of.ends:
            return of
        return dataclasses.replace(of, ends=tuple(each * self._ratio for each in of.ends))

    def _later(self, given: Condition[Any, Any]) -> Condition[Any, Any] | None:
        """A condition with its times by the new clock; None where all of them have passed."""
        later = given.from_time(self.elapsed)
        if later.during is not None:
            begin, end = (t * self._ratio for t in later.during)
            return dataclasses.replace(later, during=(begin, end)) if end > 0 else None
        if not isinstance(given.where, AtTimes):
            return later
        left = [(time - self.elapsed) * self._ratio for time in self._left(times_of([given]))]
        return dataclasses.replace(later, where=AtTimes(left)) if left else None

    @cached_property
    def grid(self) -> Grid:
        """The grid of what is left."""
        if self._ratio == 1.0:
            return self._remainder.grid
        times = [(time - self.elapsed) * self._ratio for time in sorted(self._stops.values())]
        return self.problem.grid.stretched(self.duration).with_nodes(times)

    def path(self, path: DiscretePath) -> DiscretePath:
        """The rest of a path of the whole motion."""
        if self._ratio == 1.0:
            return self._remainder.path(path, self.problem)
        motion, ratio = self.problem.trajectory(path), self._ratio
        on, k = self.problem.coordinates, path.order

        def curve(t: Array) -> tuple[Array, ...]:
            jet = motion.jet(np.minimum(self.elapsed + t / ratio, motion.duration), max(k, 2))
            return tuple(x / ratio**j for j, x in enumerate(jet))

        ends = curve(np.array([0.0, self.duration]))
        return path_on_grid(curve, self.grid, ends[:k], on)

    def first_state(self, path: DiscretePath, motion: Trajectory) -> State:
        """The state in which the rest of a path starts, with the full turns of a whole motion."""
        passed = motion.positions(self.elapsed)[0]
        return turned(first_state(path), self.problem.coordinates, passed)

    def central(self, central: CentralPath) -> CentralPath | None:
        """The central path of the rest: paths, rows and multipliers follow.

        None for another duration, and without rows where limits that have passed were the widest,
        whose ranges are the scales of all.
        """
        if self._ratio != 1.0:
            return None
        points = tuple((level, self.path(x)) for level, x in central.points)
        if central.rows is None or not self._scaled_alike:
            return CentralPath(points, None)
        rows, kept = self._remainder.rows(central.rows)
        shifted = CentralPath(points, rows)
        if central.barrier is None:
            return shifted
        index = self._outputs(len(central.barrier.s) - central.rows.size, kept)
        return dataclasses.replace(shifted, barrier=central.barrier.of(index))

    def _outputs(self, at_points: int, rows: Index) -> Index:
        """The outputs whose slacks and multipliers those of the rest begin with.

        at_points: their number at the quadrature points. rows: those that theirs were, -1 for none.
        """
        points = self._remainder.points(self.problem.ld, self._ld)
        width = at_points // sum(len(each) for each in self.problem.ld.point_times)
        first = (points[:, None] * width + np.arange(width)).ravel()
        return np.concatenate([first, np.where(rows < 0, -1, at_points + rows)])

    @cached_property
    def _remainder(self) -> Remainder:
        grid = self.problem.grid
        return Remainder.after(grid, self.elapsed, tuple(self._stops))

    @property
    def _scaled_alike(self) -> bool:
        """Whether what is left of the limits has the ranges and coordinates of all of them."""
        limits, left = self.problem.limits, self._limits
        if limits is None or left is None:
            return True
        pairs = (limits.ranges, left.ranges), (limits.bounded, left.bounded)
        return all(np.array_equal(*pair) for pair in pairs)

    @property
    def _stops(self) -> dict[int, float]:
        """The times that have nodes and have not passed, in [s], by the number of the node."""
        of = self.problem.ld.lagrangian
        seams = of.ends if isinstance(of, SegmentedLagrangian) else ()
        asked, via = times_of(self.problem.conditions), [each.time for each in self.problem.via]
        grid, left = self.problem.grid, self._left([*seams, *asked, *via])
        return {
            grid.node_at(time): time
            for time in left
            if time < grid.duration * (1.0 - NODE_TOLERANCE)
        }

    @property
    def _via(self) -> list[Via]:
        """The via points that have not passed."""
        return [each for each in self.problem.via if self._left([each.time])]

    def _left(self, times: Sequence[float]) -> list[float]:
        """Those of some times that have not passed."""
        late = self.elapsed + NODE_TOLERANCE * self.problem.grid.duration
        return [time for time in times if time > late]

    @property
    def _ratio(self) -> float:
        """The new duration relative to the time that is left."""
        left = self.problem.grid.duration - self.elapsed
        return 1.0 if self.duration == left else self.duration / left
