"""hovi's own schemes as methods of a diagram."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np

from hovi.accuracy.method import Answer, Method, Prepared, Stopwatch
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import Curve
from hovi.errors import ChartError, UnmeasurableError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.solver import solve_on_grid
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.jerk_lagrangian import JerkLagrangian
from hovi.schemes import by_name, of_order

SCHEMES = (
    "taylor-midpoint",
    "hermite-simpson",
    "galerkin-0",
    "galerkin-1",
    "galerkin-2",
    "galerkin-3",
    "galerkin-4",
    "galerkin-5",
    "galerkin-2x8",
    "galerkin-4x10",
)
"""Schemes of a diagram without limits by default."""
LIMITED_SCHEMES = (
    "galerkin-4x10",
    "galerkin-2x8",
    "galerkin-4",
    "galerkin-2",
    "galerkin-1",
    "galerkin-0",
    "hermite-simpson",
)
"""Schemes of a diagram within limits by default: fewer, as each solve takes longer."""
COARSEST_WITHIN_LIMITS = 8
"""Smallest number of intervals within limits; on fewer the solver halves most intervals anyway."""
MAX_HALVINGS = 8
"""Maximum number of halvings for the orientations of the guess."""


class VariationalMethod(Method):
    """A scheme of hovi, solved as `plan` solves a named scheme on a number of intervals.

    problem: on any grid. guess: of every solve. scheme: its name.
    clock: in CLOCKS. longest: time limit of one solve, in [s]; none if None.
    """

    def __init__(
        self,
        problem: TrajectoryProblem,
        guess: Curve,
        scheme: str,
        clock: str = "processor",
        longest: float | None = None,
    ) -> None:
        self._problem, self._guess, self._clock = problem, guess, clock
        self._longest = longest
        self._scheme = of_order(by_name(scheme), problem.ld.k)
        if self._scheme.derivatives != problem.ld.k:
            raise UnmeasurableError(f"{scheme} is no scheme for the jerk.")
        self.coarsest = COARSEST_WITHIN_LIMITS if problem.limited else Method.coarsest
        self.name, self.family, self.order = scheme, "hovi", self._scheme.order

    def prepare(self, intervals: int) -> Prepared:
        """Set up everything after loading the robot, with no cached function."""
        grid, path = self._sampled(intervals)
        watch = Stopwatch(self._clock)
        problem = on_grid(self._problem, grid, rebuild=True)
        problem.structure  # noqa: B018 - computed here rather than in the first solve
        seconds = watch.seconds

        def run() -> Answer:
            watch = Stopwatch(self._clock)
            found = solve_on_grid(problem, path, time_limit=self._longest)
            seconds = watch.seconds
            cost = found.cost if np.isfinite(found.cost) else float("inf")
            ended, motion = found.trajectory.grid.intervals, found.trajectory.configurations
            return Answer(found.success, found.message, cost, motion, found.nit, seconds, ended)

        return Prepared(run, seconds)

    def _sampled(self, intervals: int) -> tuple[Grid, DiscretePath]:
        """The guess on N intervals, halved until the charts contain its orientations."""
        grid = Grid.uniform(self._problem.grid.duration, intervals, self._scheme)
        for _ in range(MAX_HALVINGS):
            try:
                return grid, on_grid(self._problem, grid).path(self._guess)
            except ChartError:
                grid = grid.halved()
        raise UnmeasurableError("an orientation of the guess turns too far within an interval.")


def on_grid(problem: TrajectoryProblem, grid: Grid, rebuild: bool = False) -> TrajectoryProblem:
    """The problem on another grid.

    rebuild: build all of its functions again.
    """
    lagrangian = problem.ld.lagrangian
    if rebuild:
        assert isinstance(lagrangian, EffortLagrangian | JerkLagrangian)
        scene = copy.copy(problem.scene)  # without the cached functions
        lagrangian = scene.effort_lagrangian(lagrangian.weight)
    return dataclasses.replace(problem, ld=DiscreteLagrangian(lagrangian, grid))
