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
from hovi.planning.solver.solver import solve_on_grid
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
"""Schemes of a diagram by default."""


class VariationalMethod(Method):
    """A scheme of hovi, solved by the trust-region method.

    problem: on any grid. guess: of every solve. scheme: its name.
    clock: in CLOCKS.
    """

    def __init__(
        self, problem: TrajectoryProblem, guess: Curve, scheme: str, clock: str = "wall"
    ) -> None:
        self._problem, self._guess, self._clock = problem, guess, clock
        self._scheme = by_name(scheme)
        self.name, self.family, self.order = scheme, "hovi", self._scheme.order

    def prepare(self, intervals: int) -> Prepared:
        """Set up everything after loading the robot, with no cached function."""
        grid = Grid.uniform(self._problem.grid.duration, intervals, self._scheme)
        path = on_grid(self._problem, grid).path(self._guess)
        watch = Stopwatch(self._clock)
        problem = on_grid(self._problem, grid, rebuild=True)
        problem.structure  # noqa: B018 - computed here rather than in the first solve
        seconds = watch.seconds

        def run() -> Answer:
            watch = Stopwatch(self._clock)
            found = solve_on_grid(problem, path)
            seconds = watch.seconds
            cost = found.cost if np.isfinite(found.cost) else float("inf")
            motion = found.trajectory.configurations
            return Answer(found.success, found.message, cost, motion, found.nit, seconds)

        return Prepared(run, seconds)


def on_grid(problem: TrajectoryProblem, grid: Grid, rebuild: bool = False) -> TrajectoryProblem:
    """The problem on another grid, without its limits.

    rebuild: build all of its functions again.
    """
    lagrangian = problem.ld.lagrangian
    if rebuild:
        assert isinstance(lagrangian, EffortLagrangian)
        scene = copy.copy(problem.scene)  # without the cached functions
        lagrangian = scene.effort_lagrangian(lagrangian.weight)
    return dataclasses.replace(problem, ld=DiscreteLagrangian(lagrangian, grid), limits=None)
