"""`work_precision`: measure the work-precision diagram of a scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hovi.accuracy.budget import Budget
from hovi.accuracy.diagram import Diagram
from hovi.accuracy.guess_motion import NEARER_RESOLVED_SHARE, guess_curve
from hovi.accuracy.measures import Thresholds
from hovi.accuracy.measuring import MAX_SOLVE_SHARE, REPEATS, SUFFICIENT_ERRORS, measure
from hovi.accuracy.method import CLOCKS, Method
from hovi.accuracy.resolved_motion import resolve
from hovi.accuracy.tolerance_method import choices
from hovi.accuracy.variational_method import SCHEMES, VariationalMethod
from hovi.discrete.guess import Curve
from hovi.errors import InputError, UnmeasurableError, nearest
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.search.job import Progress
from hovi.planning.search.planner import plan
from hovi.planning.task_file.task import Task
from hovi.system.interruption import interruptible, raise_if_interrupted

PLANNING_SHARE = 0.3
"""Fraction of the budget for planning and resolving the motion."""
MEASURING_SHARE = 0.9
"""Fraction of the budget after which methods are no longer measured; the rest is for
`plan(tolerance=)`."""


@dataclass(frozen=True, eq=False)
class Setting:
    """The problem, guess and time limits shared by all methods.

    problem: on the grid of the resolved motion. guess: of every solve. nearer: a guess ten times
    nearer, for methods that otherwise converge to other minima.
    longest: time limit of one solve, in [s]. clock: in CLOCKS.
    """

    problem: TrajectoryProblem
    guess: Curve
    nearer: Curve
    longest: float = 60.0
    clock: str = "wall"


Peer = Callable[[Setting], Method]
"""Creates the method of a reference tool. Raises UnmeasurableError for unsupported settings."""


@interruptible
def work_precision(
    task: Task,
    *,
    guess: str = "near",
    schemes: Sequence[str] = SCHEMES,
    peers: Sequence[Peer] = (),
    budget: float = 60.0,
    repeats: int = REPEATS,
    clock: str = "wall",
    enough: Thresholds = SUFFICIENT_ERRORS,
    progress: Progress | None = None,
) -> Diagram:
    """Errors of cost, joints and tip against time, of several schemes on several grids.

    The motion of the task is planned without its limits and refined until it no longer changes;
    every method then solves the same problem from the same guess.

    guess: "near" (nine tenths of the resolved motion, one tenth of the cubic: all methods converge
        to the same minimum) or "cubic" (runs that end in another minimum are not valid).
    schemes: names for `by_name`. peers: reference tools for comparison.
    budget: wall time, in [s]. repeats: timed solves of every run after the first.
    clock: "wall", or "processor" for a machine under other load.
    enough: errors below which no finer grid is tried.
    progress: called with a line of text and the fraction of the budget spent.
    Raises InputError and the errors of `plan` for invalid input, UnmeasurableError when no motion
    can be resolved.
    """
    if task.options.via:
        raise InputError(
            f"{task.name} has via points, but a diagram needs a motion between two states; remove "
            "the via points."
        )
    if clock not in CLOCKS:
        raise InputError(f"there is no clock {clock!r}: {nearest(clock, CLOCKS)}")
    time, report = Budget(budget), progress or _no_progress
    report(f"planning {task.name}", 0.0)
    found = plan(
        task.scene,
        task.start,
        task.goal,
        task.duration,
        options=task.options,
        limits="none",
        obstacles=(),
        self_collision=False,
        tolerance=None,
        time_limit=PLANNING_SHARE * budget,
    )
    raise_if_interrupted()
    if not found.success or found.problem is None:
        raise UnmeasurableError(f"no reference motion of {task.name} was found: {found.message}")
    report("resolving the motion", time.fraction)
    resolved = resolve(found.problem, found, lambda: time.fraction > PLANNING_SHARE)
    problem = found.problem.on(resolved.trajectory.grid)
    curve = guess_curve(guess, problem, resolved.trajectory)
    nearer = guess_curve(guess, problem, resolved.trajectory, NEARER_RESOLVED_SHARE)
    setting = Setting(problem, curve, nearer, MAX_SOLVE_SHARE * budget, clock)
    methods: list[Method] = [VariationalMethod(problem, curve, name, clock) for name in schemes]
    notes = list(_omissions(task))
    for peer in peers:
        try:
            methods.append(peer(setting))
        except UnmeasurableError as error:
            notes.append(str(error))
    try:
        measured = measure(
            methods, resolved.reference, time, report, MEASURING_SHARE, repeats, enough
        )
        report("measuring plan(tolerance=)", time.fraction)
        intervals = task.options.interval_count
        chosen = choices(problem, curve, resolved.reference, time, intervals, repeats, clock)
    finally:
        for method in methods:
            method.close()
    return Diagram(
        scene=task.name,
        guess=guess,
        clock=clock,
        resolved=resolved,
        runs=measured.runs,
        choices=chosen,
        notes=(*notes, *measured.notes),
        complete=measured.complete,
        seconds=time.spent,
    )


def _omissions(task: Task) -> Sequence[str]:
    """Notes on parts of the task that the diagram ignores."""
    if not as_limits(task.scene.robot, task.options.limits).bounded.any():
        return ()
    return (
        "The scene has limits; the diagram shows the motion without them, since with limits the "
        "error is dominated by the times at which they become active, for every scheme.",
    )


def _no_progress(text: str, fraction: float) -> None:
    """Discard progress reports."""
