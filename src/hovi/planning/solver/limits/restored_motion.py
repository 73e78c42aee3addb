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
from hovi.optimize.bounded_objective import STOPPED, Outputs
from hovi.optimize.ended import Reason
from hovi.optimize.trust_region import minimize
from hovi.planning.solver.augmented_lagrangian_rounds import first_multipliers
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.methods.bounded_search import Bounded, BoundedSearch
from hovi.planning.solver.multipliers import Multipliers
from hovi.planning.solver.penalized_action import LeastViolation, PenalizedAction, least_violation

PENALTIES = 1.0, 1e2, 1e4, 1e6
"""Penalties of violated limits, relative to the mean density, if the interior point fails."""
PENALTY_STEPS = 40
"""Maximum number of steps with each penalty."""
PENALTY_DECREASE = 0.9
"""Ratio of violations above which a larger penalty would not help."""
BUMPED_GUESSES = 1
"""Number of perturbed guesses that are tried before limits are reported as infeasible."""
SAME_VIOLATION = 1.5
"""Ratio of the squares up to which two minima of the violation are taken as one."""
BUMP_SHARE = 0.3
"""Share of a perturbation of the guess that keeps it near enough for few steps."""
BUMP_HALVINGS = 8
"""Number of shares of a perturbation, each half of the one before, that charts are tried with."""
SMALL_VIOLATION = 1e-3
"""Violation, as a share of the range, below which the interior point is tried again."""


def locally_infeasible(search: BoundedSearch, outcome: Bounded) -> str:
    """Why no motion is within limits, if their violation has minima that are not zero; else "".

    These are looked for from the motion of a failed solve, from the guess and from a perturbed one.
    If all three find one, and two of them the lowest, that becomes the outcome's motion.
    """
    if search.problem.constrained or search.clearance is not None or search.timed:
        return ""
    rows, search.rows = search.rows, search.fine_rows()
    objective = search.objective(None)
    density = outcome.outputs.density(objective.bounds.measure)
    found: list[LeastViolation] = []
    for path in (outcome.x, search.guess, _bumped_guess(search, 0, BUMP_SHARE)):
        each = least_violation(objective, path, density, search.remaining_criteria())
        search.iterations += each.steps
        found.append(each)
        if each.why in STOPPED:
            outcome.why = each.why
        if not each.least or each.violation <= SMALL_VIOLATION:
            break
    else:
        most = SAME_VIOLATION * min(each.squares for each in found)
        same = [each for each in found if each.squares <= most]
        if len(same) > 1:
            outcome.x = min(same, key=lambda each: each.value).path
            outcome.outputs = objective.outputs(outcome.x)
            outcome.barrier = Barrier.inactive(objective.bounds, outcome.outputs.y)
            search.locally_infeasible = True
            return search.worst(outcome.x)
    search.rows = rows
    return ""


def restored_motion(search: BoundedSearch, outcome: Bounded) -> tuple[Bounded, str]:
    """Further attempts from motions of small violation; or the reason for infeasibility."""
    constrained = search.problem.constrained
    known = first_multipliers(search.problem, outcome.x) if constrained else None
    search.rows = search.coarse_rows()
    objective = search.objective(known)
    density = outcome.outputs.density(objective.bounds.measure)
    least = np.inf
    bumped = (_bumped_guess(search, seed) for seed in range(BUMPED_GUESSES))
    for guess in chain([search.guess], bumped):
        path, violation, why = _penalized(search, objective, guess, density)
        if why in STOPPED:
            outcome.why = why
            return outcome, ""
        if violation <= SMALL_VIOLATION:
            search.multipliers, search.rows = None, search.coarse_rows()
            again = search.solve(path)
            if again.feasible or again.why in STOPPED:
                return again, ""
            if violation == 0.0 and why is Reason.STATIONARY:
                return unlimited_minimum(search, path), ""
        if violation < least:
            least, outcome.x = violation, path
    _, outcome.outputs, outcome.barrier = _without_forces(search, known, outcome.x)
    return outcome, search.worst(outcome.x)


def unlimited_minimum(search: BoundedSearch, path: DiscretePath) -> Bounded:
    """A minimum that no limit touches, which is one without limits as well."""
    objective, outputs, barrier = _without_forces(search, None, path)
    found = Bounded(path, outputs, barrier, Reason.STATIONARY)
    none = np.zeros_like(outputs.y)
    found.model = objective.model(path, none, none, none)
    return found


def _without_forces(
    search: BoundedSearch, known: Multipliers | None, path: DiscretePath
) -> tuple[BoundedAction, Outputs, Barrier]:
    """The objective with its first rows, its outputs at a path, and a barrier without forces."""
    search.rows = search.coarse_rows()
    objective = search.objective(known)
    outputs = objective.outputs(path)
    return objective, outputs, Barrier.inactive(objective.bounds, outputs.y)


def _bumped_guess(search: BoundedSearch, seed: int, share: float = 1.0) -> DiscretePath:
    """The guess with a bump, of a smaller share where it turns too far for a chart."""
    problem = search.problem
    T = problem.grid.duration
    base = stretched(problem.trajectory(search.guess), T, problem.ld.k)
    for halvings in range(BUMP_HALVINGS):
        bump = with_bump(base, problem.coordinates, T, seed, share * 0.5**halvings)
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
        result = minimize(penalized, path, criteria, None)
        path = result.x
        search.iterations += result.iterations
        before, violation = violation, penalized.violation(path)
        if result.why in STOPPED or violation > PENALTY_DECREASE * before:
            break
    return path, violation, result.why
