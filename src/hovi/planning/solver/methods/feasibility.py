"""A feasible motion at the quadrature points, or the reason for infeasibility."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import stretched, with_bump
from hovi.optimize.barrier import Barrier
from hovi.optimize.trust_region import Stop, minimize
from hovi.planning.clearance.clearance_violation import approach_along
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.augmented_lagrangian_rounds import first_multipliers
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.clearance_outputs import ClearanceOutputs
from hovi.planning.solver.methods.bounded_search import (
    STOPPED,
    Bounded,
    BoundedSearch,
    mean_density,
)
from hovi.planning.solver.penalized_action import PenalizedAction

PENALTIES = 1.0, 1e2, 1e4, 1e6
"""Penalties of violated limits, relative to the mean density, if the interior point fails."""
PENALTY_STEPS = 150
"""Maximum number of steps with each penalty."""
BUMPED_GUESSES = 3
"""Number of perturbed guesses that are tried before limits are reported as infeasible."""
STAGE_DEPTH = 0.04
"""Depth by which a motion is moved out of obstacles in one stage, in [m]."""
MAX_STAGES = 8
"""Maximum number of stages."""
STAGE_STEPS = 80
"""Maximum number of steps per stage, whose result is only a guess."""
NEARBY_MU = 1e-2
"""First barrier parameter from a motion that nearly is a solution, relative to the mean density of
the objective: a larger one moves it away from its bounds, and perhaps to another minimum."""
SMALL_VIOLATION = 1e-3
"""Violation, as a share of the range, below which the interior point is tried again."""


def feasible_motion(search: BoundedSearch) -> tuple[Bounded, str]:
    """A motion from the guess within bounds at the points, and the reason if there is none."""
    path = search.guess
    if search.clearance is not None:
        path = _moved_out_of_obstacles(search, path, search.clearance)
    outcome = _solved_nearby(search, path) or search.solve(path)
    if outcome.feasible or outcome.stop is not Stop.DIVERGED:
        return outcome, ""
    return _restored(search, outcome)


def _solved_nearby(search: BoundedSearch, path: DiscretePath) -> Bounded | None:
    """The solution near a guess that is taken to be near one; None if it is not, or that fails."""
    if not search.options.near or search.clearance is not None or search.problem.constrained:
        return None
    outcome = solved_from(search, path)
    found = outcome.feasible and outcome.stop is Stop.STATIONARY
    return outcome if found or outcome.stop in STOPPED else None


def solved_from(search: BoundedSearch, path: DiscretePath) -> Bounded:
    """Solve from a motion that nearly is a solution, with a small barrier from the beginning."""
    objective = search.objective(search.multipliers)
    outputs = objective.outputs(path)
    mu = NEARBY_MU * mean_density(outputs, objective)
    return search.solve(path, Barrier.central(objective.bounds, outputs.y, mu))


def _moved_out_of_obstacles(
    search: BoundedSearch, path: DiscretePath, wanted: ClearanceOutputs
) -> DiscretePath:
    """A guess: the motion of least action without obstacles, moved out of them in stages.

    In one stage a motion deep in an obstacle would leave it on different sides at different times.
    """
    options, search.clearance = search.options, None
    path = _without_obstacles(search, path)
    approach = approach_along(search.problem.trajectory(path), wanted.distances, wanted.least)
    depth = wanted.least - float(approach.distance.min())
    stages = int(np.clip(np.ceil(depth / STAGE_DEPTH), 1, MAX_STAGES))
    search.options = dataclasses.replace(options, max_iterations=STAGE_STEPS)
    for share in np.arange(1, stages) / stages:
        least = wanted.least - (1.0 - share) * depth
        search.clearance = ClearanceOutputs(wanted.distances, least)
        outcome = search.solve(path)
        path = outcome.x
        if outcome.stop in STOPPED:
            break
    search.options, search.clearance = options, wanted
    return path


def _without_obstacles(search: BoundedSearch, path: DiscretePath) -> DiscretePath:
    """The motion without obstacles, or the guess if none is found."""
    if search.limits.bounded.any():
        outcome = search.solve(path)
        return outcome.x if outcome.feasible else path
    if search.problem.constrained:
        return path
    objective, options = ActionObjective(search.problem), search.remaining_options()
    result = minimize(objective, path, options, search.report)
    search.iterations += result.iterations
    return result.x if np.isfinite(result.value) else path


def _restored(search: BoundedSearch, outcome: Bounded) -> tuple[Bounded, str]:
    """Further attempts from motions of small violation; or the reason for infeasibility."""
    constrained = search.problem.constrained
    known = first_multipliers(search.problem, outcome.x) if constrained else None
    objective = search.objective(known)
    density = mean_density(outcome.outputs, objective)
    least = np.inf
    for guess in _guesses(search):
        path, violation, stop = _penalized(search, objective, guess, density)
        if stop in STOPPED:
            outcome.stop = stop
            return outcome, ""
        if violation <= SMALL_VIOLATION:
            search.multipliers = None
            again = search.solve(path)
            if again.feasible or again.stop in STOPPED:
                return again, ""
        if violation < least:
            least, outcome.x = violation, path
    outcome.outputs = objective.outputs(outcome.x)
    return outcome, search.worst(outcome.x)


def _guesses(search: BoundedSearch) -> Iterator[DiscretePath]:
    """The guess, then perturbations of it."""
    yield search.guess
    problem = search.problem
    T = problem.grid.duration
    base = stretched(search.problem.trajectory(search.guess), T, problem.ld.k)
    for seed in range(BUMPED_GUESSES):
        yield problem.path(with_bump(base, problem.coordinates, T, seed))


def _penalized(
    search: BoundedSearch, objective: BoundedAction, path: DiscretePath, density: float
) -> tuple[DiscretePath, float, Stop]:
    """A motion of small violation, by growing penalties; its violation, and why it stopped."""
    for penalty in PENALTIES:
        penalized = PenalizedAction(objective, penalty * density)
        options = dataclasses.replace(search.remaining_options(), max_iterations=PENALTY_STEPS)
        result = minimize(penalized, path, options, None)
        path = result.x
        search.iterations += result.iterations
        if result.stop in STOPPED:
            break
    return path, penalized.violation(path), result.stop
