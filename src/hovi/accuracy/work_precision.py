"""work_precision: what each further digit costs on a scene, on this machine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hovi.accuracy.budget import Budget
from hovi.accuracy.diagram import Diagram
from hovi.accuracy.guess_motion import NEARER, guess_curve
from hovi.accuracy.measures import Thresholds
from hovi.accuracy.measuring import ENOUGH, REPEATS, SLOWEST, Progress, measure
from hovi.accuracy.method import CLOCKS, Method
from hovi.accuracy.resolved_motion import resolve
from hovi.accuracy.tolerance_method import choices
from hovi.accuracy.variational_method import SCHEMES, VariationalMethod
from hovi.discrete.guess import Curve
from hovi.errors import InputError, UnmeasurableError, nearest
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.search.planner import plan
from hovi.planning.task_file.task import Task
from hovi.system.interruption import interruptible, raise_if_interrupted

SEARCHING = 0.3
"""Share of the budget in which the motion may be found and resolved."""
MEASURING = 0.9
"""Share of the budget in which methods are measured; tolerances may choose in what is left."""


@dataclass(frozen=True, eq=False)
class Setting:
    """What all methods have in common.

    problem: on the grid of the resolved motion. guess: where every solve starts. nearer: a guess
    that is ten times nearer, for a method that would end in other minima otherwise.
    longest: what one solve may take, in [s]. clock: in CLOCKS.
    """

    problem: TrajectoryProblem
    guess: Curve
    nearer: Curve
    longest: float = 60.0
    clock: str = "wall"


Peer = Callable[[Setting], Method]
"""What makes a reference tool's method for a setting. Raises UnmeasurableError if it cannot."""


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
    enough: Thresholds = ENOUGH,
    progress: Progress | None = None,
) -> Diagram:
    """Errors in cost, joints and tip against time, of many schemes on many grids.

    The motion is planned as the task says, without its limits, and resolved until it stops
    changing; every method then solves the same problem from the same guess.

    guess: "near" (nine tenths of the resolved motion, one tenth of the cubic: all methods work on
        the same minimum) or "cubic" (they may end in others, and then do not count).
    schemes: names as by_name takes them. peers: reference tools for comparison.
    budget: of wall time, in [s]. repeats: of every solve, by which its time is judged.
    clock: "wall", or "processor" on a machine that is busy with other work.
    enough: errors at which a method need not become finer.
    progress: called with a line of text and the fraction done.
    Raises InputError and what `plan` raises for bad input, UnmeasurableError when no motion can be
    resolved.
    """
    if task.options.via:
        raise InputError(
            f"{task.name} has via points, and a diagram is of a motion between two ends: leave "
            "them out."
        )
    if clock not in CLOCKS:
        raise InputError(f"there is no clock {clock!r}: {nearest(clock, CLOCKS)}")
    time, report = Budget(budget), progress or _silent
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
        time_limit=SEARCHING * budget,
    )
    raise_if_interrupted()
    if not found.success or found.problem is None:
        raise UnmeasurableError(f"no motion of {task.name} to measure against: {found.message}")
    report("resolving the motion", time.fraction)
    resolved = resolve(found.problem, found, lambda: time.fraction > SEARCHING)
    problem = found.problem.on(resolved.trajectory.grid)
    curve = guess_curve(guess, problem, resolved.trajectory)
    nearer = guess_curve(guess, problem, resolved.trajectory, NEARER)
    setting = Setting(problem, curve, nearer, SLOWEST * budget, clock)
    methods: list[Method] = [VariationalMethod(problem, curve, name, clock) for name in schemes]
    notes = list(_left_out(task))
    for peer in peers:
        try:
            methods.append(peer(setting))
        except UnmeasurableError as refused:
            notes.append(str(refused))
    try:
        measured = measure(methods, resolved.reference, time, report, MEASURING, repeats, enough)
        report("what a tolerance chooses", time.fraction)
        intervals = task.options.intervals
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


def _left_out(task: Task) -> Sequence[str]:
    """What the diagram does not show of the task."""
    if not as_limits(task.scene.robot, task.options.limits).bounded.any():
        return ()
    return (
        "The scene has limits; the diagram is of its motion without them: under limits the error "
        "is that of the places where they begin and end to hold, whatever the scheme.",
    )


def _silent(text: str, fraction: float) -> None:
    """No progress."""
