"""Motions without limits or equality constraints: a trust-region Newton method."""

from __future__ import annotations

import dataclasses

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Ended, Reason
from hovi.optimize.start import Start
from hovi.optimize.trust_region import minimize
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.methods.method import Guess, ProblemMethod, Report
from hovi.planning.solver.outcome.cost_with_time import price_of_time
from hovi.planning.solver.status import chart_sentence, status_of
from hovi.system.deadline import OutOfTimeError


class TrustRegion(ProblemMethod):
    """Newton's method with exact Hessians in a trust region, down to rounding errors."""

    def supports(self, problem: TrajectoryProblem) -> bool:
        """Problems without limits or equality constraints; ends may be free."""
        return not (problem.limited or problem.constrained)

    def minimize(
        self,
        problem: TrajectoryProblem,
        start: Guess,
        criteria: Criteria,
        report: Report | None = None,
    ) -> Answer:
        """See ProblemMethod.minimize."""
        objective = ActionObjective(problem)
        exact = dataclasses.replace(criteria, exact=True)
        ended = minimize(objective, Start(start.x), exact, report)
        n_neg = 0 if ended.convex else negative_eigenvalues(objective, ended)
        cost, nit = ended.value + price_of_time(problem), len(ended.steps)
        status, message = status_of(problem, ended, cost, nit, n_neg)
        return Answer(
            problem,
            ended.x,
            cost,
            status,
            message + chart_sentence(problem, ended.x),
            nit,
            n_neg,
            ended.steps,
            jets=objective.jets(ended.x),
            model=ended.model,
        )


def negative_eigenvalues(objective: ActionObjective, ended: Ended[DiscretePath, None]) -> int:
    """n_neg of the exact Hessian; -1 if the value is not finite, or if time runs out."""
    if ended.why is Reason.DIVERGED or not np.isfinite(ended.value):
        return -1
    try:
        definite = objective.model(ended.x, None, None).factor(0.0) is not None
        return 0 if definite else objective.negative_eigenvalues(ended.x)
    except OutOfTimeError:
        return -1
