"""Multi-start exploration: solves from many initial guesses, in parallel processes.

Least-torque problems have dozens of minima. The first round perturbs the initial guess, each later
one the best minima found so far (basin hopping). [WalesDoye1997]
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import field
from functools import partial

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import Curve, stretched, with_bump, with_turns
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import ChartError
from hovi.planning.paths.first_guesses import FirstGuesses
from hovi.planning.problem.notation.goal_turns import says_turns
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.search.continuation import UNUSABLE
from hovi.planning.search.free_duration import FreeDuration
from hovi.planning.search.job import Job
from hovi.planning.solver.solver import Solution, solved_on_grid
from hovi.planning.solver.status import Status
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline
from hovi.system.interruption import record_interrupt
from hovi.system.progress import Progress
from hovi.workers.lost import Lost

Array = npt.NDArray[np.float64]

STARTS_PER_ROUND = 16
"""Starts per round; constant, so that results do not depend on the number of processes."""
SEED_STRIDE = 100_003
"""Difference of the first seeds of two searches whose seeds differ by one; a prime."""
TURNS, TURN_PROBABILITIES = (-1.0, 0.0, 1.0), (0.15, 0.7, 0.15)
"""Full turns that a start adds to a continuous joint, and how probable each is."""
PERTURBED_MINIMA = 4
"""Number of minima that a round perturbs."""
COMPARED_TIMES = 17
"""Number of times at which motions are compared."""
SAME_COST = 1e-6
"""Relative difference in cost up to which two minima count as the same."""


_Begun = tuple[DiscretePath, float | None]
"""A guess, and the length of a free part with which it begins: see Pool.solve_all."""


@dataclass(frozen=True, eq=False)
class Solved:
    """The results of solves from several guesses.

    solutions: in the order of the guesses. numbers: of their guesses.
    lost: why others have none, as their process died. interrupted: whether Ctrl-C ended them.
    """

    solutions: list[Solution]
    numbers: list[int]
    lost: list[str] = field(default_factory=list)
    interrupted: bool = False


@dataclass(eq=False)
class Pool:
    """Solves a job from many guesses, in this process or in worker processes.

    deadline: of all solves together. free: a duration to be found along with each motion; None for
    the job's own.
    """

    job: Job
    processes: int
    deadline: Deadline = field(default_factory=Deadline)
    free: FreeDuration | None = None

    def solve_all(
        self, guesses: Sequence[DiscretePath], lengths: Sequence[float | None] | None = None
    ) -> Solved:
        """The solutions from the guesses, without those whose process died or had no time left.

        lengths: of a free part with which each begins, in [s]; that of the job for None.
        If worker processes cannot be started, the guesses are solved in this one. Raises
        KeyboardInterrupt after an interrupt if there is no solution yet.
        """
        results: dict[int, Solution | Lost] = {}
        begun = [None] * len(guesses) if lengths is None else lengths
        starts: list[_Begun] = list(zip(guesses, begun, strict=True))
        try:
            if min(self.processes, len(starts)) > 1:
                self._in_workers(starts, results)
            missing = [i for i in range(len(starts)) if i not in results]
            for i in missing:
                if results and self.deadline.passed:
                    break
                left = self.deadline.seconds_left
                results[i] = solution = _solve(self.job, self.free, starts[i], left)
                if solution.status is Status.INTERRUPTED:
                    break
        except KeyboardInterrupt:
            record_interrupt()
            if not results:
                raise
            return _solved(results, interrupted=True)
        return _solved(results)

    def _in_workers(self, starts: Sequence[_Begun], results: dict[int, Solution | Lost]) -> None:
        """Add the results of worker processes."""
        from hovi.workers.pool import results_in_workers  # not needed for one process

        work = partial(_solve, self.job, self.free)
        found = results_in_workers(work, starts, self.processes, self.deadline)
        with closing(found):
            results.update(found)


def _solved(results: dict[int, Solution | Lost], interrupted: bool = False) -> Solved:
    ordered = [results[i] for i in sorted(results)]
    lost = [each.reason for each in ordered if isinstance(each, Lost)]
    solutions = [each for each in ordered if not isinstance(each, Lost)]
    numbers = [i for i in sorted(results) if not isinstance(results[i], Lost)]
    ended = interrupted or any(each.status is Status.INTERRUPTED for each in solutions)
    return Solved(solutions, numbers, lost, ended)


def _solve(
    job: Job,
    free: FreeDuration | None,
    start: _Begun,
    time_limit: float | None,
) -> Solution:
    """The solution from one guess, without the problem, which is not sent."""
    guess, length = start
    problem, most = job.problem(), job.options.max_iterations
    solution = None
    if free is not None:
        # Here, since most plans have a given duration, and start without these modules.
        from hovi.planning.search.joint_duration import joint_minimum
        from hovi.planning.solver.free_duration.timed_path import stretched_path

        now = np.array([free.clock.length(problem.grid)])
        if length is not None:
            guess = stretched_path(guess, problem.grid, free.clock, now, np.array([length]))
            problem, now = job.lasting(free.clock, length).problem(), np.array([length])
            guess = problem.moved(guess)
        solution = joint_minimum(
            problem,
            guess,
            free.price,
            now,
            max_iterations=most,
            time_limit=time_limit,
            barrier=job.barrier,
        )
    if solution is None:
        solution = solved_on_grid(
            problem,
            guess,
            max_iterations=most,
            time_limit=time_limit,
            barrier=job.barrier,
        )
    return dataclasses.replace(solution, problem=None, model=None)


@dataclass(frozen=True, eq=False)
class Exploration:
    """The result of a multi-start exploration.

    minima: distinct minima by ascending cost; the best other solution if there are none.
    done: number of starts that were solved. interrupted: whether Ctrl-C ended the exploration.
    lost: why starts have no solution, as the process that solved them died, one reason for each.
    first: the guesses of the first starts. by_path: motions that began as one of their paths.
    goal: where the end of the best one was held; None if that of the job.
    """

    minima: list[Solution]
    done: int
    interrupted: bool
    lost: tuple[str, ...] = ()
    first: FirstGuesses | None = None
    by_path: tuple[Trajectory, ...] = ()
    goal: State | None = None

    def guess_of(self, motion: Trajectory) -> str:
        """What a message says of the guess of a refined motion: that of the nearest minimum."""
        if self.first is None:
            return ""
        fractions = np.linspace(0.0, 1.0, COMPARED_TIMES)
        q = motion.configurations(fractions * motion.duration)
        known = [each.trajectory for each in self.minima]
        far = [np.abs(k.configurations(fractions * k.duration) - q).max() for k in known]
        nearest = self.minima[int(np.argmin(far))]
        by_path = any(nearest.trajectory is each for each in self.by_path)
        return self.first.sentence(by_path, nearest.success)


def explore(
    pool: Pool, first: FirstGuesses, starts: int, seed: int, progress: Progress
) -> Exploration:
    """Solve from many starts, beginning with the first guesses.

    The direct one is left out for a single start that succeeds from a path.

    starts: number of solves. seed: of the random bumps.
    KeyboardInterrupt and the pool's deadline end the exploration with the solutions so far, and so
    does a round of which every process dies.
    """
    if starts == 1 and (first.paths or first.branches):
        return _from_path_or_direct(pool, first, progress)
    guesses, lengths = _first_starts(first, pool.free)
    one = pool.solve_all(guesses[:starts], lengths[:starts])
    solutions, lost = one.solutions, one.lost
    ended = stopped = one.interrupted
    numbered = zip(one.numbers, one.solutions, strict=True)
    by_path = tuple(x.trajectory for number, x in numbered if number < len(first.paths))
    try:
        if len(solutions) > 1:
            _report(solutions, lost, starts, progress)
        while not (ended or pool.deadline.passed):
            tried = len(solutions) + len(lost)
            if tried >= starts:
                break
            guesses = _round(pool.job, distinct(solutions), first.all[0], tried, starts, seed)
            found = pool.solve_all(guesses)
            solutions, lost = solutions + found.solutions, lost + found.lost
            stopped = found.interrupted
            ended = stopped or not found.solutions
            _report(solutions, lost, starts, progress)
    except KeyboardInterrupt:
        record_interrupt()
        stopped = True
    minima = distinct(solutions)
    return Exploration(minima, len(solutions), stopped, tuple(lost), first, by_path)


def _report(
    solutions: Sequence[Solution], lost: Sequence[str], starts: int, progress: Progress
) -> None:
    """Say how many starts are done."""
    best = min((solution.cost for solution in solutions), default=np.inf)
    text = f"{len(solutions)} of {starts} starts, least cost {best:.6g}"
    progress(text, (len(solutions) + len(lost)) / starts)


def _first_starts(
    first: FirstGuesses, free: FreeDuration | None
) -> tuple[list[DiscretePath], list[float | None]]:
    """The first guesses, and the length of a free part with which each begins, None for the job's.

    With a free length the best guess begins with others, too: each leads downhill to a minimum of
    its own. Guesses to other branches come after these.
    """
    many = len(first.all) - len(first.branches)
    others = [] if free is None else free.others
    guesses = [*first.all[:many], *[first.all[0]] * len(others), *first.branches]
    return guesses, [*[None] * many, *others, *[None] * len(first.branches)]


def _from_path_or_direct(pool: Pool, first: FirstGuesses, progress: Progress) -> Exploration:
    """A single start: the first path or branch, and other guesses while no solution is found."""
    tried, by_path, stopped = list[Solution](), list[Trajectory](), False
    goals = list[State | None]()  # where the ends of these motions are held
    for attempt in _attempts(first, pool.job):
        if tried:
            progress(attempt.text, 0.5)
        goal = attempt.goal
        solving = pool if goal is None else dataclasses.replace(pool, job=pool.job.to(goal))
        try:
            found = solving.solve_all([attempt.guess])  # a single one in this process
        except KeyboardInterrupt:
            if not tried:
                raise
            record_interrupt()
            stopped = True
            break
        solution, stopped = found.solutions[0], found.interrupted
        tried.append(solution)
        goals.append(goal)
        by_path += [solution.trajectory] * attempt.by_path
        if solution.success or stopped or pool.deadline.passed:
            break
    minima = distinct(tried)
    goal = next(at for each, at in zip(tried, goals, strict=True) if each is minima[0])
    return Exploration(minima, len(tried), stopped, (), first, tuple(by_path), goal)


@dataclass(frozen=True, eq=False)
class _Attempt:
    """A solve from a guess.

    by_path: whether it is a path by OMPL. text: for the progress. goal: where its end is held; None
    if that of the job.
    """

    guess: DiscretePath
    by_path: bool
    text: str
    goal: State | None = None


def _attempts(first: FirstGuesses, job: Job) -> Iterator[_Attempt]:
    """Solves from the guesses, with the end held in isolated configurations.

    A free end may slide along the goal's equations until the solve fails, so that the first branch
    is tried with its end held in any case.
    """
    for attempt in _free_attempts(first):
        to_branch = attempt.guess is first.direct and not first.paths
        goal = job.held_at(attempt.guess.q[-1]) if first.isolated or to_branch else None
        if goal is None or not first.isolated:
            yield attempt
        if goal is not None:
            text = attempt.text if first.isolated else "with the end held where the goal is met"
            yield dataclasses.replace(attempt, goal=goal, text=text)


def _free_attempts(first: FirstGuesses) -> Iterator[_Attempt]:
    """The first path, if there is one, and the direct guess."""
    if first.paths:
        yield _Attempt(first.paths[0], True, "from a path")
    yield _Attempt(first.direct, False, "from the direct guess")


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
        base = stretched(bases[i % len(bases)], T, problem.ld.k)
        curve = with_bump(base, robot, T, seed=seed * SEED_STRIDE + i)
        if robot.space.angles:
            turns = _random_turns(robot, seed * SEED_STRIDE + i)
            for goal in problem.goals:
                turns[says_turns(goal, robot)] = 0.0
            curve = with_turns(curve, robot, T, turns)
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
        turns[factor.v] = random.choice(TURNS, p=TURN_PROBABILITIES)
    return turns


def distinct(solutions: Sequence[Solution]) -> list[Solution]:
    """Minima with different costs, ascending; the best other solution if there are none.

    Costs of motions that violate limits say nothing: of these the last one, which was tried since
    the others had failed.
    """
    minima = sorted((s for s in solutions if s.success), key=lambda s: s.cost)
    if not minima:
        usable = [s for s in solutions if s.status not in UNUSABLE] or list(solutions[-1:])
        return [min(usable, key=lambda s: s.cost)]
    kept = [minima[0]]
    for solution in minima[1:]:
        if solution.cost - kept[-1].cost > SAME_COST * abs(kept[-1].cost):
            kept.append(solution)
    return kept


def default_processes() -> int:
    """Number of processors available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
