"""Augmented Lagrangian iteration: minimise, update multipliers and penalties, repeat."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.optimize.ended import Ended, Reason
from hovi.planning.conditions.condition import describe, is_spurious, residual, whose
from hovi.planning.conditions.missed_along import worst_along
from hovi.planning.problem.conditions_of import passive_joints
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.multipliers import Multipliers, Residuals

INITIAL_TORQUE_PENALTY = 10.0
"""Initial penalty of passive torques, relative to the mean weight of the other joints."""
WARM_TORQUE_FRACTION = 0.1
"""Passive torque of a guess, relative to the largest torque, up to which it counts as warm."""
WARM_PENALTY_FACTOR = 1e3
"""Factor of the initial torque penalty for a warm guess."""
INITIAL_PENALTY = 1e3
"""Initial penalty of conditions, relative to the cost, per [rad^2] or [m^2]."""
PENALTY_GROWTH = 10.0
"""Factor by which a penalty grows if its residual decreases too slowly."""
SLOW_DECREASE = 0.1
"""Ratio of successive residuals above which their decrease is too slow."""
STUCK, MAX_STUCK = 0.95, 2
"""Ratio of successive residuals above which a larger penalty had no effect, and the number of such
penalties in a row after which the constraints are taken as infeasible."""
MAX_PENALTY_RATIO = 1e9
"""Maximum penalty, relative to the initial one."""
MAX_ROUNDS = 60
"""Maximum number of rounds."""
TORQUE_TOLERANCE = 1e-10
"""Largest passive torque at convergence, relative to the largest torque."""
CONDITION_TOLERANCE = 1e-11
"""Largest residual of a condition at convergence."""
FEASIBLE_RESIDUAL = 1e-6
"""Residual above which a problem counts as infeasible: relative for torques."""
FIRST_DECREASE = 1e-3
"""Relative decrease at which a first round stops; later rounds stop by their residual."""


Result = TypeVar("Result", bound=Ended[DiscretePath, Any])


def minimize_constrained(
    problem: TrajectoryProblem,
    path: DiscretePath,
    minimize: Callable[[Multipliers, DiscretePath, float], Result],
    known: Multipliers | None = None,
    most: int = MAX_ROUNDS,
) -> tuple[Result, Multipliers, str]:
    """Minimise subject to the problem's equality constraints.

    Returns how the last round ended, its multipliers, or updated ones after MAX_ROUNDS, and why the
    constraints cannot be satisfied, as a sentence without its end, or "".

    minimize: minimises the augmented Lagrangian with given multipliers, from a path, to a
        relative decrease.
    known: multipliers of a nearby problem, for a warm start. most: number of rounds.
    """
    multipliers = known or first_multipliers(problem, path)
    first = multipliers
    decrease = FIRST_DECREASE
    last, stuck, grown = (np.inf, np.inf), [0, 0], [False, False]
    for _ in range(most):
        result = minimize(multipliers, path, decrease)
        path = result.x
        residuals = ActionObjective(problem, multipliers=multipliers).residuals(path)
        sizes = residuals.torque_fraction, residuals.condition_error
        if result.why is not Reason.STATIONARY or are_met(residuals):
            break
        slow = [
            size > max(SLOW_DECREASE * before, 0.1 * enough)
            for size, before, enough in zip(
                sizes, last, (TORQUE_TOLERANCE, CONDITION_TOLERANCE), strict=True
            )
        ]
        stuck = [
            count + 1 if larger and size > max(STUCK * before, FEASIBLE_RESIDUAL) else 0
            for count, larger, size, before in zip(stuck, grown, sizes, last, strict=True)
        ]
        if max(stuck) >= MAX_STUCK or _at_maximum_penalty(multipliers, first, slow):
            break
        grown = slow
        multipliers = multipliers.updated(residuals, problem.passive)
        multipliers = multipliers.with_scaled_penalties(
            *(PENALTY_GROWTH if each else 1.0 for each in slow)
        )
        decrease = float(np.clip(max(sizes) ** 2, 1e-12, FIRST_DECREASE))
        last = sizes
    stationary = result.why is Reason.STATIONARY
    return result, multipliers, unmet_sentence(problem, path, residuals) if stationary else ""


def first_multipliers(problem: TrajectoryProblem, path: DiscretePath) -> Multipliers:
    """Zero multipliers, with penalties scaled by the torque weights and the cost of a path."""
    weight = problem.mean_output_weight
    cost = max(abs(problem.ld.action(path)), 1e-6)
    action = ActionObjective(problem)
    penalties = INITIAL_TORQUE_PENALTY * weight, INITIAL_PENALTY * cost
    zero = Multipliers.zero(action.equations, *penalties)
    fraction = action.residuals(path).torque_fraction
    warm = fraction <= WARM_TORQUE_FRACTION
    return zero.with_scaled_penalties(WARM_PENALTY_FACTOR, 1.0) if warm else zero


def are_met(residuals: Residuals) -> bool:
    """Whether the constraints hold to their tolerances."""
    return within(residuals, TORQUE_TOLERANCE, CONDITION_TOLERANCE)


def within(residuals: Residuals, torque_fraction: float, error: float) -> bool:
    """Whether passive torques and conditions are within these tolerances."""
    return residuals.torque_fraction <= torque_fraction and residuals.condition_error <= error


def _at_maximum_penalty(now: Multipliers, first: Multipliers, slow: list[bool]) -> bool:
    """Whether a penalty that should grow has reached its maximum."""
    grown = now.torque_penalty / first.torque_penalty, now.penalty / first.penalty
    return any(each and size >= MAX_PENALTY_RATIO for each, size in zip(slow, grown, strict=True))


def spurious_sentence(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """Which condition holds at a spurious root, as a sentence without its end; "" if none does."""
    for each in problem.equations:
        if is_spurious(each, path):
            return (
                f"the frame is half a turn away from its goal at t = {each.where.time:.4g} s: "
                f"{describe(each, path)}; try another initial guess"
            )
    return ""


def unmet_sentence(problem: TrajectoryProblem, path: DiscretePath, residuals: Residuals) -> str:
    """Passive torques if they are too large, else what is missed most, or holds at a spurious root.

    A sentence without its end, with what to do; "" if the equations hold.
    """
    if within(residuals, FEASIBLE_RESIDUAL, FEASIBLE_RESIDUAL):
        return spurious_sentence(problem, path)
    if residuals.torque_fraction > FEASIBLE_RESIDUAL or not (problem.equations or problem.along):
        return (
            f"no motion was found with zero torque at passive joint {passive_joints(problem)}: the "
            f"remaining torque is {residuals.torque_fraction:.3g} of the largest; allow more time "
            "or change the goal"
        )
    name, missed = _worst(problem, path)
    return (
        f"{name} cannot be met: {missed}; change the goal, increase the duration or try another "
        "initial guess"
    )


def missed_sentence(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """What the motion of an unfinished solve misses, a sentence after a space; "" for nothing."""
    residuals = ActionObjective(problem).residuals(path)
    if within(residuals, FEASIBLE_RESIDUAL, FEASIBLE_RESIDUAL):
        return ""
    if residuals.torque_fraction > FEASIBLE_RESIDUAL or not (problem.equations or problem.along):
        fraction, joint = residuals.torque_fraction, passive_joints(problem)
        return f" So far, the torque at passive joint {joint} is {fraction:.3g} of the largest."
    name, missed = _worst(problem, path)
    return f" So far, {name} is missed: {missed}."


def _worst(problem: TrajectoryProblem, path: DiscretePath) -> tuple[str, str]:
    """The condition that is missed most, a subject, and by how much, a clause."""
    sizes = [float(np.max(np.abs(residual(each, path)))) for each in problem.equations]
    if max(sizes, default=0.0) > FEASIBLE_RESIDUAL:
        worst = problem.equations[int(np.argmax(sizes))]
        return f"{whose(worst)} at t = {worst.where.time:.4g} s", describe(worst, path)
    along = worst_along(problem.along, problem.trajectory(path))
    return along.subject, along.missed
