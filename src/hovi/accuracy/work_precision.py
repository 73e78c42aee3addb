"""`work_precision`: measure the work-precision diagram of a scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from math import inf

from hovi.accuracy.budget import Budget
from hovi.accuracy.diagram import Diagram
from hovi.accuracy.guess_motion import NEARER_RESOLVED_FRACTION, guess_curve
from hovi.accuracy.measures import MEASURES, Thresholds, size
from hovi.accuracy.measuring import (
    MAX_SOLVE_FRACTION,
    REPEATS,
    SUFFICIENT_ERRORS,
    Measured,
    measure,
)
from hovi.accuracy.method import CLOCKS, Method
from hovi.accuracy.reference_search import find_reference
from hovi.accuracy.resolved_motion import ResolvedMotion
from hovi.accuracy.run import Run
from hovi.accuracy.tolerance_method import (
    Choice,
    ChoiceTimer,
    choices_to_tolerances,
    default_choice,
)
from hovi.accuracy.variational_method import LIMITED_SCHEMES, SCHEMES, VariationalMethod
from hovi.discrete.guess import Curve
from hovi.errors import InputError, UnmeasurableError, nearest
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.task_file.task import Task
from hovi.system.dataclass import dataclass
from hovi.system.interruption import interruptible
from hovi.system.progress import Progress, shows_progress, silent

MEASURING_FRACTION = 0.9
"""Fraction of the budget after which methods are no longer measured; the rest is for
`plan(tolerance=)`."""

LIMITED_SOLVE_FRACTION = 0.5
"""Time limit of a solve within limits, relative to that of others: it may succeed on a finer grid,
where fewer intervals have to be halved."""


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
    clock: str = "processor"


Peer = Callable[[Setting], Method]
"""Creates the method of a reference tool. Raises UnmeasurableError for unsupported settings."""


@interruptible
@shows_progress
def work_precision(
    task: Task,
    *,
    guess: str = "near",
    schemes: Sequence[str] | None = None,
    peers: Sequence[Peer] = (),
    budget: float = 60.0,
    repeats: int = REPEATS,
    clock: str = "processor",
    enough: Thresholds = SUFFICIENT_ERRORS,
    progress: Progress | None = None,
) -> Diagram:
    """Errors of cost, joints and tip against time, of several schemes on several grids.

    The motion of the task is planned, within its limits, and refined until it no longer changes;
    every method then solves the same problem from the same guess. Limits that the motion stays away
    from are left out.

    guess: "near" (nine tenths of the resolved motion, one tenth of the cubic: all methods converge
        to the same minimum) or "cubic" (runs that end in another minimum are not valid).
    schemes: names for `by_name`; SCHEMES, or LIMITED_SCHEMES within limits, if None.
    peers: reference tools for comparison.
    budget: wall time, in [s]. repeats: timed solves of every run after the first.
    clock: "processor", of this process, its workers and its peers each by its own clock, or "wall",
        which other load makes longer.
    enough: errors below which no finer grid is tried; within limits, and for a motion that is not
        resolved so far, larger ones are enough.
    progress: called with a line of text and the fraction of the budget spent.
    Raises InputError and the errors of `plan` for invalid input, UnmeasurableError when no motion
    can be resolved or the budget ends before a scheme is measured.
    """
    task.require_one_motion("a work-precision diagram")
    if task.options.via:
        raise InputError(
            f"{task.name} has via points, but a diagram needs a motion between two states; remove "
            "the via points."
        )
    if clock not in CLOCKS:
        raise InputError(f"there is no clock {clock!r}: {nearest(clock, CLOCKS)}")
    time, report = Budget(budget), progress or silent
    reference = find_reference(task, time, report)
    problem, resolved = reference.problem, reference.resolved
    curve = guess_curve(guess, problem, resolved.trajectory)
    nearer = guess_curve(guess, problem, resolved.trajectory, NEARER_RESOLVED_FRACTION)
    setting = Setting(problem, curve, nearer, MAX_SOLVE_FRACTION * budget, clock)
    report("measuring plan's default", time.fraction)
    timer = ChoiceTimer(resolved.reference, time, repeats, clock)
    by_default = default_choice(task.options, problem, curve, timer)
    usual = LIMITED_SCHEMES if problem.limited else SCHEMES
    methods, left_out = _methods(setting, usual if schemes is None else schemes, peers)
    try:
        measured = measure(
            methods,
            resolved.reference,
            time,
            report,
            MEASURING_FRACTION,
            repeats,
            _attainable(enough, resolved),
        )
        _require_runs(measured, time)
        report("measuring plan(tolerance=)", time.fraction)
        intervals, least = task.options.interval_count, resolved.limit_effect
        chosen = choices_to_tolerances(problem, curve, intervals, timer, least)
        default, *choices = timer.repeated([by_default, *chosen])
        found: list[Run | Choice] = [*measured.runs, default, *choices]
        costs = (each.cost for each in found if each.counts)
        resolved = resolved.doubted(min(costs, default=resolved.cost))
    finally:
        for method in methods:
            method.close()
    return Diagram(
        scene=task.name,
        guess=guess,
        clock=clock,
        resolved=resolved,
        runs=measured.runs,
        choices=tuple(choices),
        default=default,
        limited=problem.limited,
        notes=(
            *reference.notes,
            *_uncertain_note(resolved),
            *left_out,
            *_default_note(default),
            *measured.notes,
        ),
        complete=measured.complete,
        seconds=time.spent,
    )


def _methods(
    setting: Setting, schemes: Sequence[str], peers: Sequence[Peer]
) -> tuple[list[Method], list[str]]:
    """hovi's schemes and the reference tools that support the setting; why others do not."""
    longest = (
        LIMITED_SOLVE_FRACTION * setting.longest if setting.problem.limited else setting.longest
    )
    own = [partial(_own_method, name=name, longest=longest) for name in schemes]
    makers: list[Callable[[Setting], Method]] = [*own, *peers]
    methods: list[Method] = []
    left_out = []
    for make in makers:
        try:
            methods.append(make(setting))
        except UnmeasurableError as error:
            left_out.append(str(error))
    return methods, list(dict.fromkeys(left_out))


def _own_method(setting: Setting, name: str, longest: float | None) -> Method:
    """A scheme of hovi. Raises UnmeasurableError for one of another order."""
    return VariationalMethod(setting.problem, setting.guess, name, setting.clock, longest)


def _attainable(enough: Thresholds, resolved: ResolvedMotion) -> Thresholds:
    """The thresholds, but none below the error of the resolved motion.

    Within limits the cost alone decides, as its tolerance does not let it converge any further.
    """
    least = {measure: size(resolved.uncertainty, measure) for measure in MEASURES}
    if resolved.limit_effect > 0:
        return Thresholds(max(least["cost"], resolved.limit_effect), inf, inf)
    return Thresholds(**{each: max(least[each], getattr(enough, each)) for each in MEASURES})


def _require_runs(measured: Measured, budget: Budget) -> None:
    """Raise UnmeasurableError if the budget ended before any run."""
    if not measured.runs:
        raise UnmeasurableError(
            f"the budget of {budget.seconds:g} s ended before a scheme was measured; use a larger "
            "one."
        )


def _uncertain_note(resolved: ResolvedMotion) -> Sequence[str]:
    """How well the reference motion is known, if it did not converge."""
    if resolved.converged:
        return ()
    return (
        f"The reference motion is known to {resolved.uncertainty.cost:.0e} of its cost only, and "
        "smaller errors say nothing; a larger budget refines it further.",
    )


def _default_note(default: Choice) -> Sequence[str]:
    """Why the default of `plan` has no star."""
    if default.counts:
        return ()
    return (f"plan's default found {default.found} from this guess: {default.message}",)
