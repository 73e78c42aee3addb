"""Motions of least violation after a failed solve: to begin again, or as the reason."""

from __future__ import annotations

import dataclasses
from contextlib import suppress
from itertools import chain

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import stretched, with_bump
from hovi.errors import ChartError
from hovi.optimize.barrier import Barrier
from hovi.optimize.ended import LEAST_VALUE, STOPPED, Ended, Outputs, Reason
from hovi.optimize.start import Start
from hovi.optimize.trust_region import minimize
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.first_multipliers import first_multipliers
from hovi.planning.solver.methods.bounded_search import Bounded, BoundedSearch
from hovi.planning.solver.multipliers import Multipliers
from hovi.planning.solver.penalized_action import (
    LEAST_VIOLATION_PENALTY,
    PenalizedAction,
    least_violation,
)

PENALTIES = 1.0, 1e2, 1e4, 1e6
"""Penalties of violated limits, relative to the mean density, if the interior point fails."""
PENALTY_STEPS = 40
"""Maximum number of steps with each penalty."""
PENALTY_DECREASE = 0.9
"""Ratio of violations above which a larger penalty would not help."""
BUMPED_GUESSES = 1
"""Number of perturbed guesses that are tried before limits are reported as infeasible."""
SAME_VIOLATION = 1.5
"""Ratio of the squared violations of two motions of least violation up to which they are one."""
BUMP_FRACTION = 0.3
"""Fraction of a perturbation of the guess that keeps it near enough for few steps."""
BUMP_HALVINGS = 8
"""Number of fractions of a perturbation, each half of the last, that charts are tried with."""
SMALL_VIOLATION = 1e-3
"""Violation, as a fraction of the range, below which the interior point is tried again."""


def locally_infeasible(search: BoundedSearch, ended: Bounded) -> str:
    """Why no motion satisfies limits and equations, if their violation has minima; else "".

    These are looked for from the motion of a failed solve, from the guess and from a perturbed one.
    If all three find one, and two of them the lowest, that becomes the motion of the failed solve.
    """
    problem = search.problem
    if search.free_duration:
        return ""
    rows, search.rows = search.rows, search.fine_rows()
    cost = max(abs(problem.ld.action(ended.x)), LEAST_VALUE)
    penalty = LEAST_VIOLATION_PENALTY * cost / problem.grid.duration
    known = first_multipliers(problem, ended.x) if problem.constrained else None
    objective = search.objective(known)
    penalized = PenalizedAction(objective, penalty)
    found: list[Ended[DiscretePath, None]] = []
    for path in (ended.x, search.guess, _bumped_guess(search, 0, BUMP_FRACTION)):
        each = least_violation(penalized, path, search.remaining_criteria())
        search.iterations += len(each.steps)
        found.append(each)
        if each.why in STOPPED:
            ended.why = each.why
        within = penalized.violation(each.x) <= SMALL_VIOLATION
        if not penalized.is_least(each) or (within and not search.unsatisfied(each.x)):
            break
    else:
        most = SAME_VIOLATION * min(penalized.squares(each.x) for each in found)
        same = [each.x for each in found if penalized.squares(each.x) <= most]
        if len(same) > 1:
            ended.x = min(same, key=penalized.action)
            ended.outputs = search.objective(known).outputs(ended.x)
            ended.z = Barrier.inactive(objective.bounds, ended.outputs.y)
            return search.unsatisfied(ended.x) or search.worst(ended.x)
    search.rows = rows
    return ""


def restored_motion(search: BoundedSearch, ended: Bounded) -> tuple[Bounded, str]:
    """Further attempts from motions of small violation; or the reason for infeasibility."""
    constrained = search.problem.constrained
    known = first_multipliers(search.problem, ended.x) if constrained else None
    search.rows = search.coarse_rows()
    objective = search.objective(known)
    density = ended.outputs.density(objective.bounds.measure)
    least = np.inf
    bumped = (_bumped_guess(search, seed) for seed in range(BUMPED_GUESSES))
    for guess in chain([search.guess], bumped):
        path, violation, why = _penalized(search, objective, guess, density)
        if why in STOPPED:
            ended.why = why
            return ended, ""
        if violation <= SMALL_VIOLATION:
            search.multipliers, search.rows = None, search.coarse_rows()
            again = search.solve(Start(path))
            found = again.feasible and not search.unsatisfied(again.x)
            if found or again.why in STOPPED:
                return again, ""
        if violation < least:
            least, ended.x = violation, path
    ended.outputs, ended.z = _without_forces(search, known, ended.x)
    # within limits, equations alone may be out of reach of this solve only
    return ended, search.worst(ended.x) if least > SMALL_VIOLATION else ""


def _without_forces(
    search: BoundedSearch, known: Multipliers | None, path: DiscretePath
) -> tuple[Outputs, Barrier]:
    """The outputs at a path with the first rows, and a barrier without forces."""
    search.rows = search.coarse_rows()
    objective = search.objective(known)
    outputs = objective.outputs(path)
    return outputs, Barrier.inactive(objective.bounds, outputs.y)


def _bumped_guess(search: BoundedSearch, seed: int, fraction: float = 1.0) -> DiscretePath:
    """The guess with a bump, of a smaller fraction where it turns too far for a chart."""
    problem = search.problem
    T = problem.grid.duration
    base = stretched(problem.trajectory(search.guess), T, problem.ld.k)
    for halvings in range(BUMP_HALVINGS):
        bump = with_bump(base, problem.coordinates, T, seed, fraction * 0.5**halvings)
        with suppress(ChartError):
            return problem.path(bump)
    return search.guess


def _penalized(
    search: BoundedSearch, objective: BoundedAction, path: DiscretePath, density: float
) -> tuple[DiscretePath, float, Reason]:
    """A motion of small violation, by growing penalties; its violation, and why it stopped.

    A penalty that does not reduce the violation is the last.
    """
    violation = np.inf
    for penalty in PENALTIES:
        penalized = PenalizedAction(objective, penalty * density)
        criteria = dataclasses.replace(search.remaining_criteria(), max_iterations=PENALTY_STEPS)
        result = minimize(penalized, Start(path), criteria)
        path = result.x
        search.iterations += len(result.steps)
        before, violation = violation, penalized.violation(path)
        if result.why in STOPPED or violation > PENALTY_DECREASE * before:
            break
    return path, violation, result.why
