"""Motions that meet equations: trust regions in rounds of an augmented Lagrangian."""

from __future__ import annotations

import dataclasses

from hovi.discrete.grid import DiscretePath
from hovi.optimize.trust_region import Iteration, Options, Outcome, minimize
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.methods.method import Answer, Method, Report
from hovi.planning.solver.methods.trust_region import negative_eigenvalues
from hovi.planning.solver.multiplier_iteration import (
    NODE_MISS,
    TORQUE_SHARE,
    Satisfied,
    satisfy,
    unmet_sentence,
    within,
)
from hovi.planning.solver.multipliers import Multipliers
from hovi.planning.solver.status import Status, status_of
from hovi.system.deadline import Deadline

POLISHING_STEPS = 8
"""Newton steps after the last round, until only rounding is left."""
MOST_SOFTENING = 4
"""Powers of ten by which a penalty may be lowered for these steps."""


class AugmentedLagrangian(Method):
    """Equations by multipliers and penalties, minimised by a trust region in every round."""

    def suits(self, problem: TrajectoryProblem) -> bool:
        """Problems without limits."""
        return not problem.limited

    def minimize(
        self,
        problem: TrajectoryProblem,
        path: DiscretePath,
        options: Options,
        report: Report | None = None,
    ) -> Answer:
        """See Method.minimize."""
        if problem.unreachable:
            value, message = problem.ld.action(path), f"{problem.unreachable}."
            return Answer(problem, path, value, Status.INFEASIBLE, message)
        rounds, history = _rounds(problem, path, options, report)
        outcome = rounds.result
        objective = ActionObjective(problem, multipliers=rounds.multipliers)
        n_neg = negative_eigenvalues(objective, outcome)
        outcome.value, outcome.iterations = problem.ld.action(outcome.x), len(history)
        status, message = _status(problem, rounds, n_neg)
        polish = POLISHING_STEPS if status is Status.MINIMUM else 0
        x, known = _polished(problem, outcome.x, rounds.multipliers, polish)
        value = problem.ld.action(x)
        nit = len(history)
        return Answer(problem, x, value, status, message, nit, n_neg, history, known.forces)


def _rounds(
    problem: TrajectoryProblem, path: DiscretePath, options: Options, report: Report | None
) -> tuple[Satisfied[Outcome[DiscretePath]], list[Iteration]]:
    """Rounds until the equations hold, and what all their steps did."""
    history: list[Iteration] = []
    deadline = Deadline(options.time_limit)

    def minimize_round(
        known: Multipliers, x: DiscretePath, decrease: float
    ) -> Outcome[DiscretePath]:
        objective = ActionObjective(problem, multipliers=known)
        tolerance, left = max(decrease, options.decrease), deadline.seconds_left
        chosen = dataclasses.replace(options, decrease=tolerance, time_limit=left)
        outcome = minimize(objective, x, chosen, _counting_on(report, len(history)))
        history.extend(outcome.history)
        return outcome

    return satisfy(problem, path, minimize_round), history


def _status(
    problem: TrajectoryProblem, rounds: Satisfied[Outcome[DiscretePath]], n_neg: int
) -> tuple[Status, str]:
    """As for a motion without equations, unless these do not hold."""
    if rounds.reason:
        return Status.INFEASIBLE, f"{rounds.reason}."
    status, message = status_of(problem, rounds.result, n_neg)
    if status is not Status.MINIMUM and not rounds.met:
        sentence = unmet_sentence(problem, rounds.result.x, rounds.residuals)
        message = f"{message} Until then, {sentence.partition(';')[0]}."
    return status, message


def _counting_on(report: Report | None, done: int) -> Report | None:
    """A report that counts on from the steps of earlier rounds."""
    if report is None:
        return None
    return lambda step, cost: report(done + step, cost)


def _polished(
    problem: TrajectoryProblem, path: DiscretePath, known: Multipliers, steps: int
) -> tuple[DiscretePath, Multipliers]:
    """Newton steps from a minimum, each with the multipliers that the last one leads to.

    With the least penalty that leaves the Hessian positive definite: rounding in a passive joint's
    torque reaches its multiplier, and so the momenta, times the penalty. What the penalties exert
    besides belongs to the multipliers that are returned.
    """
    objective = ActionObjective(problem, multipliers=known)
    residuals = objective.residuals(path)
    first = path, known.updated(residuals, problem.passive)
    allowed = max(TORQUE_SHARE, residuals.torque_share), max(NODE_MISS, residuals.node_miss)
    known = _softest_penalty(problem, path, known) if steps > 0 else known
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


def _softest_penalty(
    problem: TrajectoryProblem, path: DiscretePath, known: Multipliers
) -> Multipliers:
    """The least penalty of torques, by tens, with which the Hessian is positive definite."""
    softest = known
    for _ in range(MOST_SOFTENING):
        softer = softest.stiffer(0.1, 1.0)
        model = ActionObjective(problem, multipliers=softer).model(path, None, None)
        if model.factor(0.0) is None:
            break
        softest = softer
    return softest
