"""What to plan: everything that the search hands to its worker processes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.scene import Scene

Progress = Callable[[str, float], None]
"""What is told how far a search is: a line of text and the fraction done."""


@dataclass(frozen=True, eq=False)
class Job:
    """What a worker process needs to solve a problem: it builds its own functions.

    weight: R of the effort, one number per joint. max_iterations: of one solve.
    """

    scene: Scene
    weight: tuple[float, ...]
    grid: Grid
    start: State
    goal: State | FrameGoal
    max_iterations: int
    limits: Limits
    via: tuple[Via, ...] = ()
    clearance: Clearance | None = None

    def problem(self) -> TrajectoryProblem:
        """The trajectory problem, built once."""
        return self._problem

    @cached_property
    def _problem(self) -> TrajectoryProblem:
        lagrangian = self.scene.effort_lagrangian(self.weight)
        ld = DiscreteLagrangian(lagrangian, self.grid)
        return TrajectoryProblem(ld, self.start, self.goal, self.limits, self.via, self.clearance)

    def __getstate__(self) -> dict[str, Any]:
        """Without the problem, so that worker processes build their own."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
