"""Augmented Lagrangian iteration: minimise, update multipliers and penalties, repeat."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.optimize.ended import Ended, Reason
from hovi.planning.conditions.condition import Equation, describe, is_spurious, whose
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
INITIAL_NODE_PENALTY = 1e3
"""Initial penalty of conditions at nodes, relative to the cost, per [rad^2] or [m^2]."""
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
NODE_TOLERANCE = 1e-11
"""Largest residual of a condition at convergence, in [rad] or [m]."""
FEASIBLE_RESIDUAL = 1e-6
"""Residual above which a problem counts as infeasible: relative for torques, else [rad] or [m]."""
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
        sizes = residuals.torque_fraction, residuals.node_error
        if result.why is not Reason.STATIONARY or are_met(residuals):
            break
        slow = [
            size > max(SLOW_DECREASE * before, 0.1 * enough)
            for size, before, enough in zip(
                sizes, last, (TORQUE_TOLERANCE, NODE_TOLERANCE), strict=True
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
    reason = ""
    if result.why is Reason.STATIONARY and not within(
        residuals, FEASIBLE_RESIDUAL, FEASIBLE_RESIDUAL
    ):
        reason = unmet_sentence(problem, path, residuals)
    elif result.why is Reason.STATIONARY:
        reason = spurious_sentence(problem, path)
    return result, multipliers, reason


def first_multipliers(problem: TrajectoryProblem, path: DiscretePath) -> Multipliers:
    """Zero multipliers, with penalties scaled by the torque weights and the cost of a path."""
    weight = problem.mean_output_weight
    cost = max(abs(problem.ld.action(path)), 1e-6)
    zero = Multipliers.zero(problem, INITIAL_TORQUE_PENALTY * weight, INITIAL_NODE_PENALTY * cost)
    fraction = ActionObjective(problem, multipliers=zero).residuals(path).torque_fraction
    warm = fraction <= WARM_TORQUE_FRACTION
    return zero.with_scaled_penalties(WARM_PENALTY_FACTOR, 1.0) if warm else zero


def are_met(residuals: Residuals) -> bool:
    """Whether the constraints hold to their tolerances."""
    return within(residuals, TORQUE_TOLERANCE, NODE_TOLERANCE)


def within(residuals: Residuals, torque_fraction: float, node_error: float) -> bool:
    """Whether passive torques and conditions at nodes are within these tolerances."""
    return residuals.torque_fraction <= torque_fraction and residuals.node_error <= node_error


def _at_maximum_penalty(now: Multipliers, first: Multipliers, slow: list[bool]) -> bool:
    """Whether a penalty that should grow has reached its maximum."""
    grown = now.torque_penalty / first.torque_penalty, now.node_penalty / first.node_penalty
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
    """Passive torques if they are too large, else the goal that is missed most, and what to do.

    A sentence without its end.
    """
    if residuals.torque_fraction > FEASIBLE_RESIDUAL or not problem.equations:
        return (
            f"no motion was found with zero torque at passive joint {passive_joints(problem)}: the "
            f"remaining torque is {residuals.torque_fraction:.3g} of the largest; allow more time "
            "or change the goal"
        )
    worst = _worst(problem, residuals)
    return (
        f"{whose(worst)} at t = {worst.where.time:.4g} s cannot be met: {describe(worst, path)}; "
        "change the goal, increase the duration or try another initial guess"
    )


def missed_sentence(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """What the motion of an unfinished solve misses, a sentence after a space; "" for nothing."""
    residuals = ActionObjective(problem).residuals(path)
    if within(residuals, FEASIBLE_RESIDUAL, FEASIBLE_RESIDUAL):
        return ""
    if residuals.torque_fraction > FEASIBLE_RESIDUAL or not problem.equations:
        fraction, joint = residuals.torque_fraction, passive_joints(problem)
        return f" So far, the torque at passive joint {joint} is {fraction:.3g} of the largest."
    worst = _worst(problem, residuals)
    where = f"{whose(worst)} at t = {worst.where.time:.4g} s"
    return f" So far, {where} is missed: {describe(worst, path)}."


def _worst(problem: TrajectoryProblem, residuals: Residuals) -> Equation:
    """The condition at a node that is missed most."""
    sizes = [float(np.max(np.abs(c), initial=0.0)) for c in residuals.nodes]
    return problem.equations[int(np.argmax(sizes))]
