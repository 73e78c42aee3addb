"""Motions with equality constraints: trust-region solves in rounds of an augmented Lagrangian."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Ended, Iteration
from hovi.optimize.start import Start
from hovi.optimize.trust_region import minimize
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.augmented_lagrangian_rounds import (
    NODE_TOLERANCE,
    TORQUE_TOLERANCE,
    are_met,
    minimize_constrained,
    unmet_sentence,
    within,
)
from hovi.planning.solver.methods.method import Guess, Method, Report
from hovi.planning.solver.methods.trust_region import negative_eigenvalues
from hovi.planning.solver.multipliers import Multipliers
from hovi.planning.solver.outcome.cost_with_time import cost_of
from hovi.planning.solver.status import Status, status_of
from hovi.system.deadline import Deadline

POLISHING_STEPS = 8
"""Newton steps after the last round, down to rounding errors."""
MAX_PENALTY_REDUCTION = 4
"""Maximum number of powers of ten by which the torque penalty is reduced for these steps."""


class AugmentedLagrangian(Method):
    """Multipliers and penalties for the constraints; a trust-region method in every round."""

    def supports(self, problem: TrajectoryProblem) -> bool:
        """Problems without limits."""
        return not problem.limited

    def minimize(
        self,
        problem: TrajectoryProblem,
        start: Guess,
        criteria: Criteria,
        report: Report | None = None,
    ) -> Answer:
        """See Method.minimize."""
        if problem.unreachable:
            said = f"{problem.unreachable}."
            return Answer.at(problem, start.x, Status.INFEASIBLE, said)
        ended, known, reason, history = _rounds(problem, start.x, criteria, report)
        objective = ActionObjective(problem, multipliers=known)
        n_neg = negative_eigenvalues(objective, ended)
        nit, cost = len(history), cost_of(problem, ended.x)
        status, message = constrained_status(problem, ended, reason, cost, nit, n_neg)
        polish = POLISHING_STEPS if status is Status.MINIMUM else 0
        x, known = _polished(problem, ended.x, known, polish)
        value = cost_of(problem, x)
        return Answer(problem, x, value, status, message, nit, n_neg, history, known.forces)


def _rounds(
    problem: TrajectoryProblem, path: DiscretePath, criteria: Criteria, report: Report | None
) -> tuple[Ended[DiscretePath, None], Multipliers, str, list[Iteration]]:
    """Rounds until the constraints hold: see minimize_constrained; and all their iterations."""
    history: list[Iteration] = []
    deadline = Deadline(criteria.time_limit)

    def minimize_round(
        known: Multipliers, x: DiscretePath, decrease: float
    ) -> Ended[DiscretePath, None]:
        objective = ActionObjective(problem, multipliers=known)
        tolerance, left = max(decrease, criteria.decrease), deadline.seconds_left
        chosen = dataclasses.replace(criteria, decrease=tolerance, time_limit=left)
        ended = minimize(objective, Start(x), chosen, with_offset(report, len(history)))
        history.extend(ended.steps)
        return ended

    return *minimize_constrained(problem, path, minimize_round), history


def constrained_status(
    problem: TrajectoryProblem,
    ended: Ended[DiscretePath, Any],
    reason: str,
    cost: float,
    nit: int,
    n_neg: int,
) -> tuple[Status, str]:
    """Status and message; INFEASIBLE for a reason why the constraints cannot be satisfied.

    Other arguments as of `status_of`.
    """
    if reason and np.isfinite(cost):
        return Status.INFEASIBLE, f"{reason}."
    status, message = status_of(problem, ended, cost, nit, n_neg)
    if status is Status.MINIMUM:
        return status, message
    residuals = ActionObjective(problem).residuals(ended.x)
    if are_met(residuals):
        return status, message
    sentence = unmet_sentence(problem, ended.x, residuals)
    return status, f"{message} So far, {sentence.partition(';')[0]}."


def with_offset(report: Report | None, done: int) -> Report | None:
    """A report whose step numbers continue from earlier rounds."""
    if report is None:
        return None
    return lambda step, cost: report(done + step, cost)


def _polished(
    problem: TrajectoryProblem, path: DiscretePath, known: Multipliers, steps: int
) -> tuple[DiscretePath, Multipliers]:
    """Newton steps at a minimum, with multipliers updated before each step.

    They use the smallest penalty with a positive definite Hessian, since rounding in a passive
    torque enters its multiplier, and thereby the momenta, multiplied by the penalty. The returned
    multipliers include the penalty terms.
    """
    objective = ActionObjective(problem, multipliers=known)
    residuals = objective.residuals(path)
    first = path, known.updated(residuals, problem.passive)
    allowed = (
        max(TORQUE_TOLERANCE, residuals.torque_fraction),
        max(NODE_TOLERANCE, residuals.node_error),
    )
    known = _smallest_penalty(problem, path, known) if steps > 0 else known
    for _ in range(steps):
        known = known.updated(
            ActionObjective(problem, multipliers=known).residuals(path), problem.passive
        )
        objective = ActionObjective(problem, multipliers=known)
        model = objective.model(path, None, None)
        factor = model.factor(0.0)
        if factor is None:
            return first
        path = objective.retract(path, factor.solve(-model.gradient), model)
    residuals = objective.residuals(path)
    if not within(residuals, *allowed):
        return first
    return path, known.updated(residuals, problem.passive)


def _smallest_penalty(
    problem: TrajectoryProblem, path: DiscretePath, known: Multipliers
) -> Multipliers:
    """The smallest torque penalty, in steps of ten, with a positive definite Hessian."""
    smallest = known
    for _ in range(MAX_PENALTY_REDUCTION):
        smaller = smallest.with_scaled_penalties(0.1, 1.0)
        model = ActionObjective(problem, multipliers=smaller).model(path, None, None)
        if model.factor(0.0) is None:
            break
        smallest = smaller
    return smallest
