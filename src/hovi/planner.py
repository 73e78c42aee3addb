"""plan: for people who want the motion and not the machinery."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError
from hovi.grid import Grid
from hovi.limits import Limits, as_limits
from hovi.multistart import Job, Pool, Progress, default_processes, distinct, explore
from hovi.problem import TrajectoryProblem
from hovi.scene import Scene
from hovi.schemes import Scheme, by_name, galerkin
from hovi.solver import Solution, Status, guess_path
from hovi.state import State, as_state
from hovi.trajectory import Trajectory

COARSE_INTERVALS = 60
"""Grids with more than twice as many intervals are first solved on a grid of this many."""
REFINED = 6
"""Coarse minima that are refined and ranked on the grid that was asked for."""
EXPLORING = 0.7
"""Share of a time limit that the search may take when its minima are refined afterwards."""


def plan(
    scene: Scene,
    start: State | npt.ArrayLike | str,
    goal: State | npt.ArrayLike | str,
    duration: float,
    *,
    scheme: str | Scheme = "galerkin-2",
    intervals: int = 16,
    limits: str | Limits | Mapping[str, Any] = "urdf",
    starts: int = 1,
    seed: int = 0,
    guess: str | Trajectory = "cubic",
    weight: npt.ArrayLike | None = None,
    max_iterations: int = 500,
    time_limit: float | None = None,
    processes: int | None = None,
    progress: Progress | None = None,
) -> Solution:
    """The motion of least 1/2 integral |tau|^2 between two states in a given time.

    scene: what is simulated.
    start, goal: a State, a configuration of shape (nq,) at rest, or the name of a pose.
    duration: T in [s]. scheme, intervals: how the action is discretised.
    limits: on q, v, a and tau, holding everywhere along the motion: "urdf" (those of the URDF),
        "none", a Limits, or a mapping as as_limits takes it.
    starts: number of solves from seeded random perturbations; all minima found are refined on
        the grid that was asked for and ranked after that. seed: of the perturbations.
    guess: "cubic", "minimum-jerk" or a Trajectory.
    weight: weight of each joint's torque in the cost, shape (nv,).
    max_iterations: of one solve. time_limit: of everything, in [s]; returns the best so far.
    processes: for the starts; all processors by default.
    progress: called with a line of text and the fraction done.
    Raises InputError, ModelError, SceneError or SchemeError for input that makes no problem.
    """
    began = time.perf_counter()
    starts, seed = _count("starts", starts, 1), _count("seed", seed, 0)
    max_iterations = _count("max_iterations", max_iterations, 1)
    if processes is not None:
        processes = _count("processes", processes, 1)
    if time_limit is not None and not time_limit > 0:
        raise InputError(f"time_limit must be positive, in seconds, got {time_limit}.")
    table = by_name(scheme) if isinstance(scheme, str) else scheme
    fine = Job(
        scene,
        tuple(scene.effort_lagrangian(weight).weight),
        Grid.uniform(duration, intervals, table),
        as_state(start, scene.robot),
        as_state(goal, scene.robot),
        max_iterations,
        as_limits(scene.robot, limits),
    )
    ends = None if time_limit is None else time.monotonic() + time_limit
    search = _Search(fine, processes or default_processes(), ends, progress or _silent)
    problem = fine.problem()  # bad input speaks before any work is done
    started = time.perf_counter()
    best, minima = search.run(guess, starts, seed)
    return dataclasses.replace(
        best,
        problem=_on_grid_of(problem, best),
        minima=minima,
        setup_seconds=started - began,
        solve_seconds=time.perf_counter() - started,
    )


@dataclass(frozen=True, eq=False)
class _Search:
    """Explore coarsely, refine the best, rank after refining."""

    fine: Job
    processes: int
    deadline: float | None
    progress: Progress

    def run(
        self, guess: str | Trajectory, starts: int, seed: int
    ) -> tuple[Solution, tuple[float, ...]]:
        """The best solution, and the costs of all minima on the grid that was asked for."""
        job = self._coarse()
        pool = Pool(job, self.processes, self._explore_until(job))
        first = guess_path(job.problem(), guess)
        search = explore(pool, first, starts, seed, self.progress)
        found = search.minima
        if job is not self.fine:
            found = _on_coarse_grid(found[:1]) if search.interrupted else self._refine(found)
        best = found[0]
        if search.done < starts:
            ended = f"{best.message} The search ended after {search.done} of {starts} starts."
            best = dataclasses.replace(best, message=ended)
        return best, tuple(s.cost for s in found if s.success)

    def _explore_until(self, job: Job) -> float | None:
        """The search's deadline, which leaves time for refining."""
        if self.deadline is None or job is self.fine:
            return self.deadline
        now = time.monotonic()
        return now + EXPLORING * (self.deadline - now)

    def _coarse(self) -> Job:
        grid = self.fine.grid
        if grid.intervals <= 2 * COARSE_INTERVALS:
            return self.fine
        coarse = Grid.uniform(grid.duration, COARSE_INTERVALS, galerkin(2))
        return dataclasses.replace(self.fine, grid=coarse)

    def _refine(self, found: list[Solution]) -> list[Solution]:
        problem = self.fine.problem()
        guesses = [guess_path(problem, s.trajectory) for s in found[:REFINED]]
        self.progress(f"refining {len(guesses)} of {len(found)} minima", 0.9)
        pool = Pool(self.fine, self.processes if len(guesses) > 1 else 1, self.deadline)
        return distinct(pool.solve_all(guesses))


def _on_grid_of(problem: TrajectoryProblem, solution: Solution) -> TrajectoryProblem:
    """The problem on the grid that the solution needed, where limits split its intervals."""
    grid = solution.trajectory.grid
    same = grid.intervals == problem.grid.intervals
    return problem if same else problem.on(grid)


def _on_coarse_grid(found: list[Solution]) -> list[Solution]:
    """The best so far when a person ends the search before the grid that was asked for."""
    (best,) = found
    message = (
        "interrupted before the grid that was asked for was reached; the motion is the best so "
        f"far, on {best.trajectory.grid.intervals} intervals: {best.message}"
    )
    status = Status.INTERRUPTED
    return [dataclasses.replace(best, success=False, status=status, message=message)]


def _silent(text: str, fraction: float) -> None:
    """No progress."""


def _count(name: str, number: float, least: int) -> int:
    """A whole number of at least `least`."""
    if not (np.isfinite(number) and number == int(number) and number >= least):
        raise InputError(f"{name} must be a whole number of {least} or more, got {number}.")
    return int(number)
