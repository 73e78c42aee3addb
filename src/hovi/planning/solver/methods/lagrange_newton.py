"""Motions with equality constraints: Newton's method with the multipliers as unknowns."""

from __future__ import annotations

import dataclasses
from dataclasses import field

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Ended, Iteration, Reason
from hovi.optimize.lagrange_newton import minimize_under_equations
from hovi.optimize.start import Start
from hovi.optimize.trust_region import minimize
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.augmented_lagrangian_rounds import (
    FEASIBLE_RESIDUAL,
    FIRST_DECREASE,
    WARM_TORQUE_FRACTION,
    first_multipliers,
    spurious_sentence,
    unmet_sentence,
    within,
)
from hovi.planning.solver.constrained_action import ConstrainedAction
from hovi.planning.solver.methods.augmented_lagrangian import (
    AugmentedLagrangian,
    constrained_status,
    with_offset,
)
from hovi.planning.solver.methods.method import Guess, Method, Report
from hovi.planning.solver.outcome.cost_with_time import price_of_time
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError

Array = npt.NDArray[np.float64]

PENALTY_FACTORS = 1.0, 1e2, 1e4
"""Factors of the penalty with which negative eigenvalues are counted; the least counts."""

NEAR_ACCURACY = 1e-2
"""Accuracy of the linearised equations in the step that shows whether a minimum is near."""


class LagrangeNewton(Method):
    """Newton's method on the KKT equations; rounds of an augmented Lagrangian where it fails.

    With equations at nodes alone, such as frame goals, one such round leads from the guess to its
    neighbourhood: the cost decides there, and a trust region suits it.
    """

    def supports(self, problem: TrajectoryProblem) -> bool:
        """Problems with equality constraints, and without limits."""
        return problem.constrained and not problem.limited

    def minimize(
        self,
        problem: TrajectoryProblem,
        start: Guess,
        criteria: Criteria,
        report: Report | None = None,
    ) -> Answer:
        """See Method.minimize."""
        rounds = AugmentedLagrangian()
        if problem.unreachable:
            return rounds.minimize(problem, start, criteria, report)
        search = _Search(problem, criteria, report)
        found = search.run(start.x, start.near)
        if found is not None:
            return found
        result = rounds.minimize(problem, start, search.left, search.report)
        history = [*search.history, *result.history]
        said, meant = (f"after {count} steps" for count in (result.nit, len(history)))
        message = result.message.replace(said, meant)
        return dataclasses.replace(result, nit=len(history), history=history, message=message)


@dataclass(eq=False)
class _Search:
    """A search from a guess, and the history of its steps."""

    problem: TrajectoryProblem
    criteria: Criteria
    on_step: Report | None
    history: list[Iteration] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.deadline = Deadline(self.criteria.time_limit)

    @property
    def left(self) -> Criteria:
        """The criteria with the time that is left."""
        return dataclasses.replace(self.criteria, time_limit=self.deadline.seconds_left)

    @property
    def report(self) -> Report | None:
        """The report, with step numbers that continue."""
        return with_offset(self.on_step, len(self.history))

    def run(self, path: DiscretePath, near: bool) -> Answer | None:
        """The result; None where the method fails. near: whether the path is near a solution."""
        problem = self.problem
        multipliers = None
        saddles: list[float] = []
        objective = ConstrainedAction(problem, path)
        if near or len(problem.passive) > 0:
            multipliers = self._known(path, objective)
        if multipliers is None and len(problem.passive) == 0:
            first, multipliers = self._first_round(path, objective)
            path, saddles = first.x, first.saddles
            if first.why is Reason.DIVERGED:
                return None
            if first.why is not Reason.STATIONARY:
                there = objective.evaluate(path)
                early = Ended(path, there, np.zeros_like(there.y), first.why, saddles=saddles)
                return self._result(objective, early, -1)
        start = Start(path, multipliers)
        found = minimize_under_equations(objective, start, self.left, self.report)
        self.history += found.steps
        found.saddles = saddles
        if found.why is Reason.DIVERGED:
            return None
        return self._result(objective, found, _negative_eigenvalues(objective, found))

    def _known(self, path: DiscretePath, objective: ConstrainedAction) -> Array | None:
        """Least-squares multipliers at a path near a minimum; None if it is not near one.

        They are those of the minimum up to the path's distance from it.
        """
        if objective.action.residuals(path).torque_fraction > WARM_TORQUE_FRACTION:
            return None
        there = objective.evaluate(path)
        model = objective.model(path, np.zeros_like(there.y))
        multipliers = model.least_squares_multipliers()
        if len(self.problem.passive) > 0:
            return multipliers
        model = objective.model(path, multipliers)
        factor = model.factor(objective.penalty, 0.0)
        if factor is None:
            return None
        step, _ = model.solve(factor, objective.penalty, there.y, NEAR_ACCURACY)
        decrease = 0.5 * abs(float(step @ model.hessian_product(step)))
        return multipliers if decrease <= FIRST_DECREASE * abs(there.value) else None

    def _first_round(
        self, path: DiscretePath, objective: ConstrainedAction
    ) -> tuple[Ended[DiscretePath, None], Array]:
        """A motion near a minimum, where equations at nodes hold nearly, and its multipliers."""
        known = dataclasses.replace(
            first_multipliers(self.problem, path), node_penalty=objective.node_penalty
        )
        penalized = ActionObjective(self.problem, multipliers=known)
        criteria = dataclasses.replace(self.left, decrease=FIRST_DECREASE)
        ended = minimize(penalized, Start(path), criteria, self.report)
        self.history += ended.steps
        updated = known.updated(penalized.residuals(ended.x), self.problem.passive)
        return ended, objective.of_nodes(updated)

    def _result(
        self, objective: ConstrainedAction, found: Ended[DiscretePath, Array], n_neg: int
    ) -> Answer:
        """The result of a solve, whether it ended in a minimum or not."""
        problem, x, nit = self.problem, found.x, len(self.history)
        known = objective.multipliers(found.z)
        residuals = objective.action.residuals(x)
        cost = found.value + price_of_time(problem)
        satisfied = within(residuals, FEASIBLE_RESIDUAL, FEASIBLE_RESIDUAL)
        done = found.why is Reason.STATIONARY or (found.why is Reason.ITERATION_LIMIT and satisfied)
        reason = spurious_sentence(problem, x) if done else ""
        if found.why is Reason.INFEASIBLE:
            reason = unmet_sentence(problem, x, residuals)
        status, message = constrained_status(problem, found, reason, cost, nit, n_neg)
        forces, jets = known.forces, objective.action.jets(x)
        return Answer(
            problem, x, cost, status, message, nit, n_neg, self.history, forces, jets=jets
        )


def _negative_eigenvalues(objective: ConstrainedAction, found: Ended[DiscretePath, Array]) -> int:
    """n_neg on the tangent space of the equations; -1 if time runs out."""
    if found.convex:
        return 0
    try:
        model = objective.model(found.x, found.z)
        if model.factor(objective.penalty, 0.0) is not None:
            return 0
        counts = [model.negative_eigenvalues(objective.penalty * f) for f in PENALTY_FACTORS]
        return min(counts)
    except OutOfTimeError:
        return -1
