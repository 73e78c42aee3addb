"""A motion shifted along its time: the problem, the paths and the central path of what is left.

Where the rest has another duration than what is left, it is sampled again, on as many intervals as
the whole motion has: a horizon that moves keeps its grid.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.path_on_grid import path_on_grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.conditions.asked import times_of
from hovi.planning.conditions.condition import Condition
from hovi.planning.conditions.places import AtTimes
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.central_path import CentralPath
from hovi.planning.solver.receding.ends import first_state, turned
from hovi.planning.solver.receding.remainder import Array, Index, Remainder
from hovi.system.dataclass import dataclass

SPACING = 8.0
"""Least ratio of barrier parameters of the points that are kept of a central path."""


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

        Raises InputError for a time after the end, and for problems that cannot be shifted.
        """
        T = problem.grid.duration
        if not 0.0 <= elapsed < T:
            raise InputError(
                f"the motion lasts {T:g} s, and it cannot go on after {elapsed:g} s: give a time "
                "from 0 to before its end."
            )
        if duration is not None and not (np.isfinite(duration) and duration > 0):
            raise InputError(f"the duration must be positive and finite, got {duration} s.")
        _require_shiftable(problem)
        left = T - elapsed
        if duration is None or abs(duration - left) <= 1e-12 * T:
            duration = left
        shift = cls(problem, elapsed, duration)
        _ = shift.grid  # raises for steps that are too short or too long
        return shift

    def between(self, start: State, goal: State | FrameGoal) -> TrajectoryProblem:
        """The problem of what is left, between other states; via points that have passed are not.

        Times of via points are stretched like the motion.
        """
        via = tuple(
            dataclasses.replace(each, time=(each.time - self.elapsed) * self._ratio)
            for each in self._via
        )
        ld = DiscreteLagrangian(self.problem.ld.lagrangian, self.grid)
        later = tuple(filter(None, map(self._later, self.problem.conditions)))
        return dataclasses.replace(
            self.problem, ld=ld, start=start, goal=goal, via=via, conditions=later
        )

    def _later(self, given: Condition[Any, Any]) -> Condition[Any, Any] | None:
        """A condition with its times by the new clock; None where all of them have passed."""
        if not isinstance(given.where, AtTimes):
            return given
        left = [(time - self.elapsed) * self._ratio for time in self._left(times_of([given]))]
        return dataclasses.replace(given, where=AtTimes(left)) if left else None

    @cached_property
    def grid(self) -> Grid:
        """The grid of what is left."""
        if self._ratio == 1.0:
            return self._remainder.grid
        T = self.problem.grid.duration
        stops = {each.time for each in self._via} | set(self._left(times_of(self._asked)))
        times = [(time - self.elapsed) * self._ratio for time in sorted(stops - {T})]
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

        None for another duration.
        """
        if self._ratio != 1.0:
            return None
        chosen: list[tuple[float, DiscretePath]] = []
        for level, path in central.points[:-1]:
            if not chosen or level * SPACING <= chosen[-1][0]:
                chosen.append((level, path))
        points = tuple((level, self.path(x)) for level, x in [*chosen, central.points[-1]])
        if central.rows is None:
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
        points = self._remainder.points(self.problem)
        width = at_points // sum(len(each) for each in self.problem.ld.point_times)
        first = (points[:, None] * width + np.arange(width)).ravel()
        return np.concatenate([first, np.where(rows < 0, -1, at_points + rows)])

    @cached_property
    def _remainder(self) -> Remainder:
        grid = self.problem.grid
        stops = *(via.time for via in self.problem.via), *times_of(self._asked)
        nodes = tuple(grid.node_at(time) for time in stops)
        return Remainder.after(grid, self.elapsed, nodes)

    @property
    def _via(self) -> list[Via]:
        """The via points that have not passed."""
        return [each for each in self.problem.via if self._left([each.time])]

    @property
    def _asked(self) -> Sequence[Condition[Any, Any]]:
        return self.problem.conditions

    def _left(self, times: Sequence[float]) -> list[float]:
        """Those of some times that have not passed."""
        late = self.elapsed + 1e-9 * self.problem.grid.duration
        return [time for time in times if time > late]

    @property
    def _ratio(self) -> float:
        """The new duration relative to the time that is left."""
        left = self.problem.grid.duration - self.elapsed
        return 1.0 if self.duration == left else self.duration / left


def _require_shiftable(problem: TrajectoryProblem) -> None:
    """Raise InputError for problems whose time cannot begin anew in their middle."""
    if problem.periodic:
        raise InputError("a periodic motion has no rest: replan it with its whole period.")
    if problem.ld.segments is not None:
        raise InputError("a motion in segments cannot be shifted: replan it as a whole.")
    clearance = problem.clearance
    if clearance is not None and any(each.motion is not None for each in clearance.obstacles):
        raise InputError(
            "obstacles move in a time that begins anew with every motion: replan it as a whole."
        )
    if asked := [each.name for each in problem.conditions if each.timed]:
        raise InputError(
            f"condition {asked[0]!r} depends on time, which begins anew with every motion: replan "
            "it as a whole."
        )
    if problem.ld.lagrangian.timed:
        raise InputError(
            "the scene depends on time, which begins anew with every motion: replan it as a whole."
        )
