"""plan: one call from a scene and two states to the motion between them."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from typing import Any, ParamSpec, Protocol, cast

import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.discrete.state import State, as_state
from hovi.errors import InputError, SceneError, expect
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.values import Duration, as_duration
from hovi.planning.refinement.adaptive import first_grid
from hovi.planning.search.free_duration import FreeDuration
from hovi.planning.search.job import Job, Progress, with_room
from hovi.planning.search.option_fields import spell_out
from hovi.planning.search.options import PlanOptions
from hovi.planning.search.refining import on_grid_of
from hovi.planning.search.search import Search
from hovi.planning.solver.solver import Solution
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.system.blas_threads import one_blas_thread
from hovi.system.deadline import Deadline
from hovi.system.interruption import interruptible

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


def _taking(
    options: Callable[Keywords, PlanOptions],
) -> Callable[[Callable[..., Solution]], _Plan[Keywords]]:
    """A decorator: the options of a plan are keywords of the function, for help and for types."""

    def taking(function: Callable[..., Solution]) -> _Plan[Keywords]:
        spell_out(function, PlanOptions)
        return cast(_Plan[Keywords], function)

    return taking


@_taking(PlanOptions)
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

    scene: what is simulated.
    start, goal: a State, a configuration of shape (nq,) at rest, or the name of a pose; the goal
        may be a FrameGoal.
    duration: T in [s], or a text such as "1.5 s", "500 ms" or "2 min"; or a pair (lower, upper)
        of these, between which the best one is looked for.
    progress: called with a line of text and the fraction done.
    options: a PlanOptions; what follows takes the place of what it says.
    {options}
    Raises InputError, ModelError, SceneError or SchemeError for input that makes no problem.
    """
    began = time.perf_counter()
    if not isinstance(scene, Scene):
        raise InputError(f"plan takes a hovi.Scene, as in hovi.Scene(robot, [...]), not {scene!r}.")
    options = PlanOptions() if options is None else options
    expect(options, PlanOptions, "hovi.PlanOptions(...), or its fields by keyword")
    chosen = options.with_changes(**changes).on(scene.robot)
    free, T = _time(scene, as_duration(duration), chosen)
    grid = _grid(T, chosen, scene.robot)
    ends = as_state(start, scene.robot), _goal(goal, scene.robot, chosen)
    job = with_room(Job(scene, grid, *ends, chosen), chosen.guess)
    search = Search(job, Deadline(chosen.most_seconds), progress or _silent, free)
    problem = job.problem()  # bad input speaks before any work is done
    started = time.perf_counter()
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
    """The bounds of a free duration, None where it is given, and the first one that is solved for.

    Raises SceneError for effects that a clock drives: the best duration is not known of them.
    """
    if not isinstance(T, tuple):
        if options.time_weight != 0:
            raise InputError("a weight of time needs a free duration, a pair (lower, upper).")
        return None, T
    if options.via:
        raise InputError("via points at given times need a given duration, not a free one.")
    free = FreeDuration(*T, options.time_weight)
    if scene.terms.timed:
        raise SceneError(
            f"effect {scene.terms.timed[0]!r} depends on the time, and a free duration needs "
            "effects that do not; give the duration as one number."
        )
    return free, free.first


def _grid(T: float, options: PlanOptions, robot: Robot) -> Grid:
    """The grid that is asked for, or with which the way to a tolerance begins."""
    if options.tolerance is None:
        grid = Grid.uniform(T, options.intervals, options.table)
    else:
        limited = as_limits(robot, options.limits).bounded.any()
        kinks = limited or options.clearance.wanted or options.via
        grid = first_grid(T, options.intervals, smooth=not kinks)
    return grid.with_nodes(sorted(each.time for each in options.via)) if options.via else grid


def _goal(goal: Goal, robot: Robot, options: PlanOptions) -> State | FrameGoal:
    """The goal, with the turns that the guess makes on its way there."""
    if isinstance(goal, FrameGoal):
        if options.turns is not None:
            raise InputError("turns are for a goal of the joints: give a State instead of a frame.")
        return goal
    state = as_state(goal, robot)
    return state if options.turns is None else dataclasses.replace(state, turns=options.turns)


def _silent(text: str, fraction: float) -> None:
    """No progress."""
