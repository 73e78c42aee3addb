"""The search for the reference motion of a diagram: as the task asks, then with more effort."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from hovi.accuracy.budget import Budget
from hovi.accuracy.lighter_rotors import lighter_rotors
from hovi.accuracy.resolved_motion import ResolvedMotion, resolve
from hovi.discrete.grid import Grid
from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError, UnmeasurableError
from hovi.planning.problem.limit_conditions import closeness
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.adaptive import MAX_FIRST_INTERVALS
from hovi.planning.refinement.hp_refinement import galerkin_with_more_points
from hovi.planning.refinement.inactive_limits import far_from_limits
from hovi.planning.search.job import Job, split_for_charts
from hovi.planning.search.options import DEFAULT_TOLERANCE, PlanOptions
from hovi.planning.search.planner import plan
from hovi.planning.solver.solver import Solution, solve_on_grid
from hovi.planning.solver.status import Status
from hovi.planning.task_file.task import Task
from hovi.system.dataclass import dataclass
from hovi.system.interruption import raise_if_interrupted
from hovi.system.progress import Progress

LIMITED_TOLERANCE = 1e-2
"""Relative tolerance of the cost of a motion within limits before it is resolved; without limits
that of `plan`, as finer grids may find other motions."""
SEARCH_FRACTION = 0.5
"""Fraction of the budget for finding a motion; most scenes need a small part of it."""
RESOLVE_FRACTION = 0.2
"""Fraction of the budget for refining the motion that was found."""
STARTS = 4
"""Number of starts if the first guess leads to no motion that can be resolved."""
ROTOR_INTERVALS = 80
"""Number of intervals of `galerkin-4x10` on which rotors are made lighter."""

Attempt = Callable[[Task, Budget], Solution]
"""Plans a task. Raises the errors of `plan`."""


@dataclass(frozen=True, eq=False)
class Reference:
    """The motion that a diagram measures, and its problem.

    problem: on the grid of the resolved motion, without limits that the motion does not reach.
    notes: sentences on how it was found, and on its limits.
    """

    problem: TrajectoryProblem
    resolved: ResolvedMotion
    notes: tuple[str, ...] = ()


def find_reference(task: Task, budget: Budget, progress: Progress) -> Reference:
    """The motion of a task, resolved: as `plan` finds it, from more starts, or from heavy rotors.

    Raises UnmeasurableError, with the reason of the first of these, if none can be resolved, and
    the errors of `plan` for invalid input.
    """
    reasons: list[str] = []
    for words, attempt in ATTEMPTS.items():
        if reasons and not budget.allows(0.0, SEARCH_FRACTION):
            break
        progress(f"planning {task.name}{', ' if reasons else ''}{words}", budget.fraction)
        try:
            found = attempt(task, budget)
            _require_usable(found, unresolved=bool(reasons))
            reference = _resolved(found, budget, progress)
        except HoviError as error:
            if not (reasons or isinstance(error, UnmeasurableError)):
                raise
            reasons.append(str(error))
            continue
        if not reasons:
            return reference
        how = f"The motion was found {words}; from its own guess: {reasons[0]}"
        return dataclasses.replace(reference, notes=(how, *reference.notes))
    tried = list(ATTEMPTS)[1 : len(reasons)]
    nor = f" Nor was one found {' or '.join(tried)}." if tried else ""
    late = "" if budget.allows(0.0, SEARCH_FRACTION) else " A larger budget allows a longer search."
    raise UnmeasurableError(
        f"no reference motion of {task.name} was found: {reasons[0]}{nor}{late}"
    )


def _require_usable(found: Solution, unresolved: bool) -> None:
    """Raise UnmeasurableError unless the motion is a minimum, or unresolved if that is allowed.

    A motion that no finer grid confirms to `plan`, as where a joint spins, may be resolved here.
    """
    raise_if_interrupted()
    usable = (Status.MINIMUM, Status.UNRESOLVED) if unresolved else (Status.MINIMUM,)
    if found.status not in usable or found.problem is None:
        raise UnmeasurableError(found.message)


def _resolved(found: Solution, budget: Budget, progress: Progress) -> Reference:
    """A motion that was found, refined. Raises UnmeasurableError."""
    assert found.problem is not None
    progress("resolving the motion", budget.fraction)
    problem, notes = found.problem, []
    if far_from_limits(found):
        notes.append(_inactive_note(found))
        problem = dataclasses.replace(problem, limits=None)
    resolved = resolve(problem, found, budget, budget.fraction + RESOLVE_FRACTION)
    if problem.limited:
        notes.append(_limited_note(resolved))
    return Reference(problem.on(resolved.trajectory.grid), resolved, tuple(notes))


def _planned(task: Task, budget: Budget) -> Solution:
    """The motion as the task asks for it."""
    return _plan(task, 0.5 * budget.left_of(SEARCH_FRACTION))


def _from_more_starts(task: Task, budget: Budget) -> Solution:
    """The best of more starts, on a finer first grid: coarse ones do not resolve fast motions."""
    starts = max(STARTS, 2 * task.options.starts)
    intervals = max(MAX_FIRST_INTERVALS, task.options.interval_count)
    left = 0.5 * budget.left_of(SEARCH_FRACTION)
    # few starts take less time than starting processes
    return _plan(task, left, starts=starts, intervals=intervals, processes=1)


def _from_rotors(task: Task, budget: Budget) -> Solution:
    """The motion that follows from that with heavy rotors, as they become lighter."""
    if isinstance(task.duration, tuple):
        raise UnmeasurableError("rotors need a fixed duration.")
    grid = Grid.uniform(
        task.duration, ROTOR_INTERVALS, galerkin_with_more_points(4, task.planned_scene.order)
    )
    options = task.options.on(task.scene)
    job = split_for_charts(
        Job(task.planned_scene, grid, task.start_state, task.goal, options), options.guess
    )
    guess: str | Trajectory = options.guess
    for easier in lighter_rotors(job):
        left = budget.left_of(SEARCH_FRACTION)
        solution = solve_on_grid(easier.problem(), guess, time_limit=left)
        if solution.status not in (Status.DIVERGED, Status.INFEASIBLE):
            guess = solution.trajectory
        raise_if_interrupted()
    return _plan(task, budget.left_of(SEARCH_FRACTION), guess=guess, intervals=None, starts=1)


ATTEMPTS: dict[str, Attempt] = {
    "": _planned,
    "from more starts": _from_more_starts,
    "from heavy rotors made lighter": _from_rotors,
}
"""How a motion is looked for, in this order."""


def _plan(task: Task, seconds: float, **changes: object) -> Solution:
    """A plan to the tolerance of the search within a time, in [s]."""
    limits = as_limits(task.scene.robot, task.options.limits, task.scene.order)
    limited = bool(limits.bounded.any()) or task.options.clearance.wanted
    tolerance = LIMITED_TOLERANCE if limited else DEFAULT_TOLERANCE
    named = {"scheme": None, "tolerance": tolerance, "time_limit": max(seconds, 1e-3)}
    options: PlanOptions = task.options.with_changes(**(named | changes))
    return plan(task.scene, task.start, task.goal, task.duration, options=options)


def _inactive_note(found: Solution) -> str:
    assert found.problem is not None
    assert found.problem.limits is not None
    fraction = float(closeness(found.trajectory, found.problem.limits).min())
    return (
        f"The motion stays {100 * fraction:.2g} % of the ranges or more away from its limits; the "
        "runs leave them out."
    )


def _limited_note(resolved: ResolvedMotion) -> str:
    """What to expect of errors within limits."""
    return (
        "All runs hold the limits. Where a limit becomes active the torque has a kink, whose time "
        "no grid matches, so that the error of the cost falls with about the third power of the "
        "step, unevenly, whatever the order of the scheme, and down to the "
        f"{resolved.limit_effect:.0e} by which the tolerance of the limits may change it. "
        "Intervals are halved where the limits do not hold between the points."
    )
