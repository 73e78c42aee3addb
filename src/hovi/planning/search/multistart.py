"""Multi-start exploration: solves from many initial guesses, in parallel processes.

Least-torque problems have dozens of minima. The first round perturbs the initial guess, each later
one the best minima found so far (basin hopping). [WalesDoye1997]
"""

from __future__ import annotations

import dataclasses
import os
import signal
from collections.abc import Sequence
from dataclasses import dataclass, field
from multiprocessing.resource_tracker import ensure_running

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import Curve, stretched, with_bump, with_turns
from hovi.discrete.trajectory import Trajectory
from hovi.errors import ChartError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.search.job import Job, Progress
from hovi.planning.solver.solver import Solution, solve_on_grid
from hovi.planning.solver.status import Status
from hovi.robot.robot import Robot
from hovi.system.deadline import Deadline
from hovi.system.interruption import record_interrupt

Array = npt.NDArray[np.float64]

STARTS_PER_ROUND = 16
"""Starts per round; constant, so that results do not depend on the number of processes."""
PERTURBED_MINIMA = 4
"""Number of minima that a round perturbs."""
SAME_COST = 1e-6
"""Relative difference in cost up to which two minima count as the same."""


@dataclass(eq=False)
class Pool:
    """Solves a job from many guesses, in this process or in worker processes.

    deadline: of all solves together.
    """

    job: Job
    processes: int
    deadline: Deadline = field(default_factory=Deadline)

    def solve_all(self, guesses: Sequence[DiscretePath]) -> list[Solution]:
        """The solutions, in the order of the guesses."""
        left = self.deadline.seconds_left
        count = min(self.processes, len(guesses))
        if count <= 1:
            return _solve_chunk(self.job, guesses, left)
        import joblib  # takes 60 ms to import, and is not needed for one process

        solve_chunk = joblib.delayed(_solve_chunk)
        chunks = [guesses[i::count] for i in range(count)]
        with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
            _start_workers(count)
            parts = joblib.Parallel(n_jobs=count)(solve_chunk(self.job, c, left) for c in chunks)
        solutions: list[Solution | None] = [None] * len(guesses)
        for i, part in enumerate(parts):
            solutions[i : i + count * len(part) : count] = part
        return [solution for solution in solutions if solution is not None]


def _start_workers(count: int) -> None:
    """Start worker processes that ignore Ctrl-C; the main process handles it and ends them.

    A terminal sends SIGINT to all processes; a worker that is still importing would print an error.
    """
    import joblib

    ensure_running()  # otherwise Python does so later and unblocks SIGINT
    previous = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        joblib.Parallel(n_jobs=count)(joblib.delayed(abs)(i) for i in range(count))
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous)


def _solve_chunk(
    job: Job, guesses: Sequence[DiscretePath], time_limit: float | None
) -> list[Solution]:
    problem, most = job.problem(), job.options.max_iterations
    deadline = Deadline(time_limit)
    solutions = []
    for guess in guesses:
        left = deadline.seconds_left
        solution = solve_on_grid(problem, guess, max_iterations=most, time_limit=left)
        solutions.append(dataclasses.replace(solution, problem=None))
        if solution.status is Status.INTERRUPTED:
            break
    return solutions


@dataclass(frozen=True, eq=False)
class Exploration:
    """The result of a multi-start exploration.

    minima: distinct minima by ascending cost; the best other solution if there are none.
    done: number of starts that were solved. interrupted: whether Ctrl-C ended the exploration.
    """

    minima: list[Solution]
    done: int
    interrupted: bool


def explore(
    pool: Pool, first: DiscretePath, starts: int, seed: int, progress: Progress
) -> Exploration:
    """Solve from many starts, beginning with the first guess.

    starts: number of solves. seed: of the random bumps.
    KeyboardInterrupt and the pool's deadline end the exploration with the solutions so far.
    """
    interrupted = False
    solutions: list[Solution] = []
    try:
        solutions += pool.solve_all([first])
        while len(solutions) < starts and not _ended(pool, solutions):
            guesses = _round(pool.job, distinct(solutions), first, len(solutions), starts, seed)
            solutions += pool.solve_all(guesses)
            best = min(solution.cost for solution in solutions)
            progress(
                f"{len(solutions)} of {starts} starts, least cost {best:.6g}",
                len(solutions) / starts,
            )
    except KeyboardInterrupt:
        if not solutions:
            raise
        record_interrupt()
        interrupted = True
    interrupted = interrupted or any(s.status is Status.INTERRUPTED for s in solutions)
    return Exploration(distinct(solutions), len(solutions), interrupted)


def _ended(pool: Pool, solutions: Sequence[Solution]) -> bool:
    """Whether the deadline has passed or a solve was interrupted."""
    if any(solution.status is Status.INTERRUPTED for solution in solutions):
        return True
    return pool.deadline.passed


def _round(
    job: Job,
    found: Sequence[Solution],
    first: DiscretePath,
    done: int,
    starts: int,
    seed: int,
) -> list[DiscretePath]:
    """Guesses of the next round: the best minima with bumps, or the first guess in round one."""
    problem = job.problem()
    T, robot = job.grid.duration, problem.robot
    origin = Trajectory(job.grid, first, problem.ld.momenta(first), job.scene)
    bases = [origin]
    if done > STARTS_PER_ROUND:
        bases = [solution.trajectory for solution in found[:PERTURBED_MINIMA]] + [origin]
    guesses = []
    for i in range(done, min(done + STARTS_PER_ROUND, starts)):
        base = stretched(bases[i % len(bases)], T)
        curve = with_bump(base, robot, T, seed=seed * 100_003 + i)
        if robot.space.angles:
            curve = with_turns(curve, robot, T, _random_turns(robot, seed * 100_003 + i))
        guesses.append(_on_charts(problem, curve, base))
    return guesses


def _on_charts(problem: TrajectoryProblem, curve: Curve, base: Curve) -> DiscretePath:
    """A curve on the grid, or its unperturbed base if it turns too far for a chart."""
    try:
        return problem.path(curve)
    except ChartError:
        return problem.path(base)


def _random_turns(robot: Robot, seed: int) -> Array:
    """A random turn of -1, 0 (mostly) or 1 for each continuous joint, shape (nv,)."""
    random = np.random.default_rng([seed, 1])
    turns = np.zeros(robot.nv)
    for factor in robot.space.angles:
        turns[factor.v] = random.choice([-1.0, 0.0, 1.0], p=[0.15, 0.7, 0.15])
    return turns


def distinct(solutions: Sequence[Solution]) -> list[Solution]:
    """Minima with different costs, ascending; the best other solution if there are none."""
    minima = sorted((s for s in solutions if s.success), key=lambda s: s.cost)
    if not minima:
        usable = [s for s in solutions if s.status is not Status.DIVERGED] or list(solutions)
        return [min(usable, key=lambda s: s.cost)]
    kept = [minima[0]]
    for solution in minima[1:]:
        if solution.cost - kept[-1].cost > SAME_COST * abs(kept[-1].cost):
            kept.append(solution)
    return kept


def default_processes() -> int:
    """Number of processors available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
