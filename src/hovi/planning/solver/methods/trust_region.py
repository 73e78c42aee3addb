"""Motions without limits or equality constraints: a trust-region Newton method."""

from __future__ import annotations

import dataclasses

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Reason
from hovi.optimize.trust_region import Outcome, minimize
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.methods.method import Method, MethodResult, Report
from hovi.planning.solver.outcome.cost_with_time import price_of_time
from hovi.planning.solver.status import chart_sentence, status_of
from hovi.system.deadline import OutOfTimeError


class TrustRegion(Method):
    """Newton's method with exact Hessians in a trust region, down to rounding errors."""

    def supports(self, problem: TrajectoryProblem) -> bool:
        """Problems without limits or equality constraints; ends may be free."""
        return not (problem.limited or problem.constrained)

    def minimize(
        self,
        problem: TrajectoryProblem,
        path: DiscretePath,
        criteria: Criteria,
        report: Report | None = None,
    ) -> MethodResult:
        """See Method.minimize."""
        objective = ActionObjective(problem)
        outcome = minimize(objective, path, dataclasses.replace(criteria, exact=True), report)
        n_neg = 0 if outcome.convex else negative_eigenvalues(objective, outcome)
        outcome.value += price_of_time(problem)
        status, message = status_of(problem, outcome, n_neg)
        return MethodResult(
            problem,
            outcome.x,
            outcome.value,
            status,
            message + chart_sentence(problem, outcome.x),
            outcome.iterations,
            n_neg,
            outcome.history,
            jets=objective.jets(outcome.x),
            model=outcome.model,
        )


def negative_eigenvalues(objective: ActionObjective, outcome: Outcome[DiscretePath]) -> int:
    """n_neg of the exact Hessian; -1 if the value is not finite, or if time runs out."""
    if outcome.why is Reason.DIVERGED or not np.isfinite(outcome.value):
        return -1
    try:
        definite = objective.model(outcome.x, None, None).factor(0.0) is not None
        return 0 if definite else objective.negative_eigenvalues(outcome.x)
    except OutOfTimeError:
        return -1
