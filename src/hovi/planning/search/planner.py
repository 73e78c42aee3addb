"""plan: one call from a scene and two states to an optimal motion."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from typing import Any, ParamSpec, Protocol, cast

import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.grid import Grid
from hovi.discrete.state import State, as_state, warn_of_degrees
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, SceneError, expect
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.units import Duration, as_duration
from hovi.planning.refinement.adaptive import first_grid
from hovi.planning.search.final_stages import on_grid_of
from hovi.planning.search.free_duration import FreeDuration
from hovi.planning.search.job import Job, Progress, split_for_charts
from hovi.planning.search.option_fields import spell_out
from hovi.planning.search.options import PlanOptions
from hovi.planning.search.search import Search
from hovi.planning.search.smoothing import smoothed
from hovi.planning.solver.solver import Solution
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import is_galerkin, of_order
from hovi.system.blas_threads import one_blas_thread
from hovi.system.deadline import Deadline
from hovi.system.interruption import interruptible

MAX_GUESS_INTERVALS = 400
"""Largest number of intervals of a guess on whose grid a refinement begins."""
Start = State | npt.ArrayLike | str
Goal = State | FrameGoal | npt.ArrayLike | str
Keywords = ParamSpec("Keywords")


class _Plan(Protocol[Keywords]):
    """`plan` as type checkers see it: with the keywords of PlanOptions."""

    def __call__(
        self,
        scene: Scene,
        start: Start,
        goal: Goal,
        duration: Duration,
        progress: Progress | None = None,
        options: PlanOptions | None = None,
        *_: Keywords.args,
        **changes: Keywords.kwargs,
    ) -> Solution:
        """As `plan`."""
        ...


def _with_option_keywords(
    options: Callable[Keywords, PlanOptions],
) -> Callable[[Callable[..., Solution]], _Plan[Keywords]]:
    """A decorator that makes the options keywords of the function, for help and type checkers."""

    def taking(function: Callable[..., Solution]) -> _Plan[Keywords]:
        spell_out(function, PlanOptions)
        return cast(_Plan[Keywords], function)

    return taking


@_with_option_keywords(PlanOptions)
@check_arguments_except("scene", "start", "goal", "duration", "options")
@one_blas_thread
@interruptible
def plan(
    scene: Scene,
    start: Start,
    goal: Goal,
    duration: Duration,
    progress: Progress | None = None,
    options: PlanOptions | None = None,
    **changes: Any,
) -> Solution:
    """The motion of least 1/2 integral |tau|^2 from a state to a goal.

    scene: the robot with its effects.
    start, goal: a State, a configuration of shape (nq,) at rest, or the name of a pose; the goal
        may be a FrameGoal.
    duration: T in [s], or a text such as "1.5 s", "500 ms" or "2 min"; or a pair (lower, upper)
        of these for a free duration.
    progress: called with a line of text and the completed fraction, in [0, 1].
    options: a PlanOptions; the following keywords override it.
    {options}
    Raises InputError, ModelError, SceneError or SchemeError for invalid input.
    """
    began = time.perf_counter()
    if not isinstance(scene, Scene):
        raise InputError(
            f"plan takes a hovi.Scene, such as hovi.Scene(robot, [...]), got {scene!r}."
        )
    options = PlanOptions() if options is None else options
    expect(options, PlanOptions, "hovi.PlanOptions(...), or its fields by keyword")
    chosen = options.with_changes(**changes).on(scene)
    deadline = Deadline(chosen.time_limit_seconds)
    free, T = _time(scene, as_duration(duration), chosen)
    ends = as_state(start, scene.robot), _goal(goal, scene.robot, chosen)
    scene = smoothed(scene, *ends, T) if chosen.smooth else scene
    grid = _grid(T, chosen, scene, free is not None)
    with deadline.in_force():
        scene.effort_lagrangian(chosen.weight)  # its functions may have to be compiled
    job = split_for_charts(Job(scene, grid, *ends, chosen), chosen.guess)
    for bound in () if free is None else (free.lower, free.upper):
        grid.stretched(bound)  # raises for steps that are too short or too long
    search = Search(job, deadline, progress or _silent, free)
    problem = job.problem()  # raises for invalid input before the search
    _warn_of_degrees(scene.robot, *ends, chosen)
    started = time.perf_counter()
    with deadline.in_force():
        best, minima = search.run()
    return dataclasses.replace(
        best,
        problem=best.problem or on_grid_of(problem, best),
        minima=minima,
        setup_seconds=started - began,
        solve_seconds=time.perf_counter() - started,
    )


def _time(
    scene: Scene, T: float | tuple[float, float], options: PlanOptions
) -> tuple[FreeDuration | None, float]:
    """The bounds of a free duration or None, and the duration of the first solve, in [s].

    Raises SceneError for a free duration with effects that depend on time.
    """
    if not isinstance(T, tuple):
        if options.time_weight != 0:
            raise InputError("time_weight needs a free duration: give a pair (lower, upper).")
        return None, T
    if options.via:
        raise InputError("via points need a fixed duration: give it as one number.")
    free = FreeDuration(*T, options.time_weight)
    if scene.terms.timed:
        raise SceneError(
            f"effect {scene.terms.timed[0]!r} depends on time, which a free duration does not "
            "allow; give the duration as one number."
        )
    return free, free.first


def _grid(T: float, options: PlanOptions, scene: Scene, free: bool) -> Grid:
    """The requested grid, or the first grid of the refinement to a tolerance.

    The latter is the guess's own grid if that is a finer one, so that the guess is not coarsened.
    free: whether the duration is.
    """
    guess = options.guess
    if options.tolerance is None:
        grid = Grid.uniform(T, options.interval_count, of_order(options.table, scene.order))
    elif isinstance(guess, Trajectory) and _is_first_grid(guess.grid, options, scene.order):
        grid = guess.grid.stretched(T)
    else:
        limited = as_limits(scene.robot, options.limits).bounded.any()
        kinks = limited or options.clearance.wanted or options.via
        few = options.starts == 1 and not free and not isinstance(guess, Trajectory)
        number, order = options.interval_count, scene.order
        grid = first_grid(T, number, not kinks, more_points=not few, order=order)
    return grid.with_nodes(sorted(each.time for each in options.via)) if options.via else grid


def _is_first_grid(grid: Grid, options: PlanOptions, order: int) -> bool:
    """Whether a refinement begins on the grid of its guess.

    The grid has Galerkin tables only, and more intervals than the first grid would have, up to
    MAX_GUESS_INTERVALS; neither intervals nor via points ask for others. order: of the Lagrangian.
    """
    if options.intervals is not None or options.via or grid.order != order:
        return False
    refinable = all(is_galerkin(scheme) for scheme, _ in grid.groups)
    return refinable and options.interval_count < grid.intervals <= MAX_GUESS_INTERVALS


def _goal(goal: Goal, robot: Robot, options: PlanOptions) -> State | FrameGoal:
    """The goal, with the turns of the initial guess."""
    if isinstance(goal, FrameGoal):
        if options.turns is not None:
            raise InputError("turns need a joint goal: give a State instead of a FrameGoal.")
        return goal
    state = as_state(goal, robot)
    return state if options.turns is None else dataclasses.replace(state, turns=options.turns)


def _warn_of_degrees(
    robot: Robot, start: State, goal: State | FrameGoal, options: PlanOptions
) -> None:
    """Warn if the given configurations, in order of time, look like degrees."""
    stops = sorted(options.via, key=lambda via: via.time)
    given = [start, *(via.goal for via in stops), goal]
    states = [each for each in given if isinstance(each, State)]
    warn_of_degrees(robot, [state.on(robot, "state")[0] for state in states])


def _silent(text: str, fraction: float) -> None:
    """Ignore progress."""
