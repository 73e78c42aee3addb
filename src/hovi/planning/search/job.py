"""A planning job: the input of a search and of its worker processes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import ChartError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Tolerance
from hovi.planning.search.options import PlanOptions
from hovi.planning.solver.solver import guess_path
from hovi.scene.scene import Scene

Progress = Callable[[str, float], None]
"""Called with a line of text and the completed fraction, in [0, 1]."""
MAX_CHART_INTERVALS = 2000
"""Maximum number of intervals after halving for the orientations of the initial guess."""


@dataclass(frozen=True, eq=False)
class Job:
    """A problem to be solved, which worker processes build for themselves.

    grid: replaces the scheme and the intervals of the options.
    options: of the plan, with limits and tolerance resolved for the scene's robot.
    """

    scene: Scene
    grid: Grid
    start: State
    goal: State | FrameGoal
    options: PlanOptions = field(default_factory=PlanOptions)

    @property
    def limits(self) -> Limits:
        """Bounds along the motion."""
        return as_limits(self.scene.robot, self.options.limits)

    @property
    def via(self) -> tuple[Via, ...]:
        """The via points, by ascending time."""
        return tuple(sorted(self.options.via, key=lambda each: each.time))

    @property
    def tolerance(self) -> Tolerance | None:
        """The largest allowed error; None for a given grid."""
        given = self.options.tolerance
        return None if given is None else Tolerance.of(given, self.scene.robot)

    def with_options(self, **changes: Any) -> Self:
        """The job with some of its options changed."""
        return dataclasses.replace(self, options=self.options.with_changes(**changes))

    def on(self, grid: Grid) -> Self:
        """The job on another grid."""
        return dataclasses.replace(self, grid=grid)

    def problem(self) -> TrajectoryProblem:
        """The trajectory problem, built on first use."""
        return self._problem

    @cached_property
    def _problem(self) -> TrajectoryProblem:
        lagrangian = self.scene.effort_lagrangian(self.options.weight)
        ld = DiscreteLagrangian(lagrangian, self.grid)
        clearance = self.options.clearance
        return TrajectoryProblem(ld, self.start, self.goal, self.limits, self.via, clearance)

    def __getstate__(self) -> dict[str, Any]:
        """The state without the problem, which worker processes build, and without the guess."""
        kept = {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}
        return kept | {"options": self.options.with_changes(guess="cubic")}


def split_for_charts(job: Job, guess: str | Trajectory) -> Job:
    """The job with intervals halved until the charts contain the orientations of the guess.

    Raises ChartError if that takes more than MAX_CHART_INTERVALS.
    """
    if job.scene.robot.space.flat:
        return job
    while True:
        try:
            guess_path(job.problem(), guess)
            return job
        except ChartError:
            if 2 * job.grid.intervals > MAX_CHART_INTERVALS:
                raise
        job = job.on(job.grid.halved())
