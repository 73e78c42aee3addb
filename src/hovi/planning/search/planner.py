"""plan: for people who want the motion and not the machinery."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.discrete.state import State, as_state
from hovi.discrete.trajectory import Trajectory
from hovi.errors import ChartError, InputError, SceneError
from hovi.planning.clearance.clearance import MARGIN, Clearance
from hovi.planning.clearance.obstacles import Obstacle
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Round, Tolerance
from hovi.planning.refinement.adaptive import first_grid, refine_to_tolerance
from hovi.planning.refinement.inactive_limits import (
    far_from_limits,
    with_limits_again,
    without_limits,
)
from hovi.planning.search.continuation import climb, may_help
from hovi.planning.search.free_duration import (
    FreeDuration,
    SolveFor,
    free_to_tolerance,
    solve_duration,
)
from hovi.planning.search.job import Job, Progress
from hovi.planning.search.multistart import Pool, default_processes, distinct, explore
from hovi.planning.solver.solver import Solution, guess_path, solve
from hovi.planning.solver.status import Status
from hovi.scene.scene import Scene
from hovi.schemes import Scheme, by_name, galerkin
from hovi.system.blas_threads import one_blas_thread
from hovi.system.deadline import Deadline
from hovi.system.interruption import (
    interrupted,
    interruptible,
    raise_if_interrupted,
    record_interrupt,
)

COARSE_INTERVALS = 60
"""Grids with more than twice as many intervals are first solved on a grid of this many."""
MOST_INTERVALS = 2000
"""To which intervals are halved so that their charts hold the orientations of the first guess."""
CHART_ROUNDS = 4
"""How often intervals are halved in which an orientation turns too far."""
REFINED = 6
"""Coarse minima that are refined and ranked on the grid that was asked for."""
EXPLORING = 0.7
"""Share of a time limit that the search may take when its minima are refined afterwards."""


@one_blas_thread
@interruptible
def plan(
    scene: Scene,
    start: State | npt.ArrayLike | str,
    goal: State | FrameGoal | npt.ArrayLike | str,
    duration: float | tuple[float, float],
    *,
    time_weight: float = 0.0,
    via: Sequence[Via] = (),
    scheme: str | Scheme = "galerkin-2",
    intervals: int = 16,
    tolerance: float | str | Tolerance | None = None,
    limits: str | Limits | Mapping[str, Any] = "urdf",
    obstacles: Sequence[Obstacle] = (),
    margin: float = MARGIN,
    self_collision: bool = False,
    starts: int = 1,
    seed: int = 0,
    guess: str | Trajectory = "cubic",
    turns: Mapping[str, int | Sequence[int]] | None = None,
    weight: npt.ArrayLike | None = None,
    max_iterations: int = 500,
    time_limit: float | None = None,
    processes: int | None = None,
    progress: Progress | None = None,
    continuation: bool = True,
) -> Solution:
    """The motion of least 1/2 integral |tau|^2 from a state to a goal.

    scene: what is simulated.
    start, goal: a State, a configuration of shape (nq,) at rest, or the name of a pose; the goal
        may be a FrameGoal.
    duration: T in [s], or a pair (lower, upper) between which the best one is looked for.
    time_weight: cost per [s] of a duration that is free.
    via: what the motion passes through at given times.
    scheme, intervals: how the action is discretised.
    tolerance: the largest error over the whole motion, in place of a scheme: a number is relative
        in the cost, "0.1 mm" at the robot's tip_frame, "0.1 mm at tool0" at another frame,
        "0.01 deg" or "1e-4 rad" in the joints. The grid to begin with has the
        `intervals`, up to 60, or two thirds of them where nothing makes kinks; the solution's
        `accuracy` says what was reached.
    limits: on q, v, a and tau, holding everywhere along the motion: "urdf" (those of the URDF),
        "none", a Limits, or a mapping as as_limits takes it.
    obstacles: what the robot's collision shapes keep a distance of `margin` from, in [m], all along
        the motion: hovi.Sphere, hovi.Capsule and hovi.Box.
    self_collision: whether its links keep that distance from each other, too: see Clearance.
    starts: number of solves from seeded random perturbations; all minima found are refined on
        the grid that was asked for and ranked after that. seed: of the perturbations.
    guess: "cubic", "minimum-jerk" or a Trajectory.
    turns: full turns that the guess makes on top of the shortest way, by joint: see State.
    weight: weight of each joint's torque in the cost, shape (nv,).
    max_iterations: of one solve; with limits of every round of it, of which a small number only
        makes more. time_limit: of everything, in [s]; returns the best so far.
    processes: for the starts; all processors by default.
    progress: called with a line of text and the fraction done.
    continuation: where no start ends in a minimum, solve easier problems that lead to this one,
        in inertia, gravity, duration, intervals and limits; the message says which led there.
    Raises InputError, ModelError, SceneError or SchemeError for input that makes no problem.
    """
    began = time.perf_counter()
    _check_kinds(scene, via)
    starts, seed = _count("starts", starts, 1), _count("seed", seed, 0)
    max_iterations = _count("max_iterations", max_iterations, 1)
    if processes is not None:
        processes = _count("processes", processes, 1)
    if time_limit is not None and not time_limit > 0:
        raise InputError(f"time_limit must be positive, in seconds, got {time_limit}.")
    wanted = None if tolerance is None else Tolerance.of(tolerance, scene.robot)
    table = by_name(scheme) if isinstance(scheme, str) else scheme
    free = _free(duration, time_weight, via)
    if free is not None:
        _require_timeless(scene)
    T = duration if free is None else free.first
    passed = tuple(sorted(via, key=lambda each: each.time))
    bounds, clearance = as_limits(scene.robot, limits), Clearance(obstacles, margin, self_collision)
    if wanted is None:
        grid = Grid.uniform(cast(float, T), intervals, table)
    else:
        smooth = not (bounds.bounded.any() or clearance.wanted or passed)
        grid = first_grid(cast(float, T), _count("intervals", intervals, 1), smooth)
    fine = Job(
        scene,
        tuple(scene.effort_lagrangian(weight).weight),
        grid.with_nodes([each.time for each in passed]) if passed else grid,
        as_state(start, scene.robot),
        goal if isinstance(goal, FrameGoal) else as_state(goal, scene.robot),
        max_iterations,
        bounds,
        passed,
        clearance,
    )
    if turns is not None:
        if not isinstance(fine.goal, State):
            raise InputError("turns are for a goal of the joints: give a State instead of a frame.")
        fine = dataclasses.replace(fine, goal=dataclasses.replace(fine.goal, turns=turns))
    fine = _with_room(fine, guess)
    chatter = progress or _silent
    count = processes or default_processes()
    search = _Search(fine, count, Deadline(time_limit), chatter, free, wanted, continuation)
    problem = fine.problem()  # bad input speaks before any work is done
    started = time.perf_counter()
    best, minima = search.run(guess, starts, seed)
    return dataclasses.replace(
        best,
        problem=best.problem or _on_grid_of(problem, best),
        minima=minima,
        setup_seconds=started - began,
        solve_seconds=time.perf_counter() - started,
    )


def _with_room(job: Job, guess: str | Trajectory) -> Job:
    """The job on a grid whose charts hold the orientations of the guess: intervals are halved.

    Raises ChartError where that would take more than MOST_INTERVALS.
    """
    if job.scene.robot.space.flat:
        return job
    while True:
        try:
            guess_path(job.problem(), guess)
            return job
        except ChartError:
            if 2 * job.grid.intervals > MOST_INTERVALS:
                raise
        every = np.ones(job.grid.intervals, dtype=bool)
        job = dataclasses.replace(job, grid=job.grid.halved(every))


@dataclass(frozen=True, eq=False)
class _Search:
    """Explore coarsely, refine the best, rank after refining."""

    fine: Job
    processes: int
    deadline: Deadline
    progress: Progress
    free: FreeDuration | None = None
    tolerance: Tolerance | None = None
    continuation: bool = True

    def run(
        self, guess: str | Trajectory, starts: int, seed: int
    ) -> tuple[Solution, tuple[float, ...]]:
        """The best solution, and the costs of all minima on the grid that was asked for."""
        job = self._coarse(guess)
        pool = Pool(job, self.processes, self._explore_until(job))
        first = guess_path(job.problem(), guess)
        search = explore(pool, first, starts, seed, self.progress)
        found = search.minima
        try:
            found = self._climbed(job, found, guess)
            if self.tolerance is not None and self.free is None:
                raise_if_interrupted()
                found = self._refine_to(self.tolerance, found)
            elif job is not self.fine:
                raise_if_interrupted()
                found = self._climbed(self.fine, self._refine(found), guess)
            found = [self._in_charts(found[0]), *found[1:]]
            if self.free is not None:
                raise_if_interrupted()
                found = self._freed(self.free, found[:REFINED])
        except KeyboardInterrupt:
            record_interrupt()
            found = _interrupted(found[:1])
        best = found[0]
        if search.done < starts:
            ended = f"{best.message} The search ended after {search.done} of {starts} starts."
            best = dataclasses.replace(best, message=ended)
        elif interrupted() and best.success:
            best = dataclasses.replace(best, message=f"{best.message} The search was interrupted.")
        return best, tuple(s.cost for s in found if s.success)

    def _climbed(self, job: Job, found: list[Solution], guess: str | Trajectory) -> list[Solution]:
        """What continuation leads to where there is no minimum among what was found."""
        if interrupted() or not self.continuation or not may_help(found[0]):
            return found
        return [climb(job, found[0], guess, self.deadline, self.progress)]

    def _in_charts(self, best: Solution) -> Solution:
        """The best solution where no orientation turns by half a turn within an interval.

        Intervals in which one does are halved, at most CHART_ROUNDS times.
        """
        if self.fine.scene.robot.space.flat:
            return best
        for _ in range(CHART_ROUNDS):
            if interrupted():
                break
            grid = best.trajectory.grid
            problem = dataclasses.replace(self.fine, grid=grid).problem()
            wide = problem.ld.turns(best.trajectory.path) > np.pi
            if not wide.any():
                break
            if self.deadline.passed:
                break
            finer = dataclasses.replace(self.fine, grid=grid.halved(wide))
            halved = _with_room(finer, best.trajectory)
            most = self.fine.max_iterations
            left = self.deadline.seconds_left
            best = solve(halved.problem(), best.trajectory, max_iterations=most, time_limit=left)
        return best

    def _explore_until(self, job: Job) -> Deadline:
        """The search's deadline, which leaves time for refining."""
        whole = job is self.fine and self.tolerance is None
        return self.deadline if whole else self.deadline.part(EXPLORING)

    def _coarse(self, guess: str | Trajectory) -> Job:
        grid = self.fine.grid
        if grid.intervals <= 2 * COARSE_INTERVALS:
            return self.fine
        coarse = Grid.uniform(grid.duration, COARSE_INTERVALS, galerkin(2))
        if self.fine.via:
            try:
                coarse = coarse.with_nodes([each.time for each in self.fine.via])
            except InputError:  # too few nodes for the via points
                return self.fine
        job = _with_room(dataclasses.replace(self.fine, grid=coarse), guess)
        return job if job.grid.intervals < grid.intervals else self.fine

    def _refine(self, found: list[Solution]) -> list[Solution]:
        problem = self.fine.problem()
        guesses = [guess_path(problem, s.trajectory) for s in found[:REFINED]]
        self.progress(f"refining {len(guesses)} of {len(found)} minima", 0.9)
        pool = Pool(self.fine, self.processes if len(guesses) > 1 else 1, self.deadline)
        return distinct(pool.solve_all(guesses))

    def _refine_to(self, tolerance: Tolerance, found: list[Solution]) -> list[Solution]:
        """Minima to a tolerance, each on a grid of its own."""
        problem, refined = self.fine.problem(), []
        for i, solution in enumerate(found[:REFINED]):
            late = self.deadline.passed
            if i > 0 and (late or interrupted()):
                break
            which = f"minimum {i + 1} of {min(len(found), REFINED)}: " if len(found) > 1 else ""
            known = dataclasses.replace(solution, problem=_on_grid_of(problem, solution))
            refined.append(self._refined(tolerance, which, known))
        return distinct(refined)

    def _refined(self, tolerance: Tolerance, which: str, known: Solution) -> Solution:
        """A minimum that knows its problem to a tolerance; limits that are far do not limit it."""
        refine = partial(
            refine_to_tolerance,
            tolerance=tolerance,
            max_iterations=self.fine.max_iterations,
            told=partial(self._tell, which),
        )
        better = None
        if far_from_limits(known):
            free = refine(without_limits(known), time_limit=self.deadline.seconds_left)
            better = with_limits_again(free, known)
        return refine(known, time_limit=self.deadline.seconds_left) if better is None else better

    def _tell(self, which: str, done: Round) -> None:
        text = f"{which}{done.intervals} intervals, estimated error {done.error:.1e}"
        self.progress(text, 0.9)

    def _freed(self, free: FreeDuration, found: list[Solution]) -> list[Solution]:
        """Every motion with the duration that is best for it, the cheapest first."""

        freed: list[Solution] = []
        for i, solution in enumerate(found):
            late = self.deadline.passed
            if freed and (late or interrupted()):
                break
            which = f"{i + 1} of {len(found)} motions"
            self.progress(f"best duration of {which}", 0.9)
            solve_for = self._on_grid(self.fine.grid)
            first = solve_for(free.first, solution.trajectory)
            if self.tolerance is None:
                freed.append(solve_duration(free, solve_for, first))
                continue
            refine = partial(self._refined, self.tolerance, f"{which}: ")
            freed.append(free_to_tolerance(free, self._on_grid, refine, first))
        return distinct(freed)

    def _on_grid(self, grid: Grid) -> SolveFor:
        """What solves on a grid that is stretched to a duration."""

        def solve_for(T: float, guess: Trajectory) -> Solution:
            stretched = Grid(grid.steps * (T / grid.duration), grid.schemes)
            problem = dataclasses.replace(self.fine, grid=stretched).problem()
            left = self.deadline.seconds_left
            return solve(problem, guess, max_iterations=self.fine.max_iterations, time_limit=left)

        return solve_for


def _check_kinds(scene: Any, via: Any) -> None:
    """Raise InputError for what is no scene, or no list of via points."""
    if not isinstance(scene, Scene):
        raise InputError(f"plan takes a hovi.Scene, as in hovi.Scene(robot, [...]), not {scene!r}.")
    if not isinstance(via, Sequence) or not all(isinstance(each, Via) for each in via):
        raise InputError(f"via is a list of hovi.Via(time, goal), not {via!r}.")


def _free(
    duration: float | tuple[float, float], weight: float, via: Sequence[Via]
) -> FreeDuration | None:
    """Bounds of a free duration, or None where it is given."""
    if isinstance(duration, float | int | np.number):
        if weight != 0:
            raise InputError("a weight of time needs a free duration, a pair (lower, upper).")
        return None
    pair = tuple(np.asarray(duration, dtype=float).ravel())
    if len(pair) != 2:
        raise InputError(f"the duration is a number or a pair (lower, upper), got {duration!r}.")
    if via:
        raise InputError("via points at given times need a given duration, not a free one.")
    return FreeDuration(pair[0], pair[1], weight)


def _require_timeless(scene: Scene) -> None:
    """Raise SceneError for effects that a clock drives: the best duration is not known of them."""
    if scene.terms.timed:
        raise SceneError(
            f"effect {scene.terms.timed[0]!r} depends on the time, and a free duration needs "
            "effects that do not; give the duration as one number."
        )


def _on_grid_of(problem: TrajectoryProblem, solution: Solution) -> TrajectoryProblem:
    """The problem on the grid that the solution needed, where limits split its intervals."""
    grid = solution.trajectory.grid
    same = np.array_equal(grid.steps, problem.grid.steps)
    return problem if same else problem.on(grid)


def _interrupted(found: list[Solution]) -> list[Solution]:
    """The best so far when a person ends the search before what was asked for was reached."""
    (best,) = found
    message = (
        "interrupted before the grid or the duration that was asked for was reached; the motion is "
        f"the best so far, on {best.trajectory.grid.intervals} intervals: {best.message}"
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
