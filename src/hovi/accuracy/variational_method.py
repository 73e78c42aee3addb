"""hovi's own schemes as methods of a diagram."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np

from hovi.accuracy.method import Answer, Method, Prepared, Stopwatch
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.guess import Curve
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.solver import solve
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.schemes import by_name

SCHEMES = (
    "taylor-midpoint",
    "hermite-simpson",
    "galerkin-0",
    "galerkin-1",
    "galerkin-2",
    "galerkin-3",
    "galerkin-4",
    "galerkin-5",
)
"""What a diagram shows unless it is told otherwise."""


class VariationalMethod(Method):
    """A scheme, solved by the trust region.

    problem: what is planned, on any grid. guess: where every solve starts. scheme: its name.
    clock: in CLOCKS.
    """

    def __init__(
        self, problem: TrajectoryProblem, guess: Curve, scheme: str, clock: str = "wall"
    ) -> None:
        self._problem, self._guess, self._clock = problem, guess, clock
        self._scheme = by_name(scheme)
        self.name, self.family, self.order = scheme, "hovi", self._scheme.order

    def prepare(self, intervals: int) -> Prepared:
        """Everything from the loaded robot on, as if nothing had been solved before."""
        grid = Grid.uniform(self._problem.grid.duration, intervals, self._scheme)
        path = on_grid(self._problem, grid).path(self._guess)
        watch = Stopwatch(self._clock)
        problem = on_grid(self._problem, grid, anew=True)
        problem.structure  # noqa: B018 - built here, and not in the first solve
        seconds = watch.seconds

        def run() -> Answer:
            watch = Stopwatch(self._clock)
            found = solve(problem, path)
            seconds = watch.seconds
            cost = found.cost if np.isfinite(found.cost) else float("inf")
            where = found.trajectory.configurations
            return Answer(found.success, found.message, cost, where, found.nit, seconds)

        return Prepared(run, seconds)


def on_grid(problem: TrajectoryProblem, grid: Grid, anew: bool = False) -> TrajectoryProblem:
    """The problem on another grid, without its limits.

    anew: with all of its functions built again.
    """
    lagrangian = problem.ld.lagrangian
    if anew:
        assert isinstance(lagrangian, EffortLagrangian)
        scene = copy.copy(problem.scene)  # which leaves behind what is cached
        lagrangian = scene.effort_lagrangian(lagrangian.weight)
    return dataclasses.replace(problem, ld=DiscreteLagrangian(lagrangian, grid), limits=None)
