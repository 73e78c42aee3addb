"""Stationary points of any index: Newton's method on the discrete Euler-Lagrange equations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.banded_model import BandModel
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import STOPS, Reason, why_stopped
from hovi.optimize.observed import between_steps
from hovi.optimize.quadratic_program import sparse_sum
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.methods.method import Guess, ProblemMethod, Report
from hovi.planning.solver.outcome.cost_with_time import cost_of
from hovi.planning.solver.status import Status, chart_sentence, unfinished
from hovi.system.deadline import Deadline

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import SuperLU

Array = npt.NDArray[np.float64]

CONVERGED_LENGTH = 1e-9
"""Relative length of a step below which one that no longer makes progress is one of rounding."""
ROUNDING_LENGTH = 1e-14
"""Relative length of a step below which no further step is taken."""
DECREASE = 1e-4
"""Decrease of the gradient's norm, relative to that of a full Newton step, that a step needs."""
LEAST_FRACTION = 1e-6
"""Smallest fraction of a Newton step that is tried."""
METRIC_FLOOR = 1e-12
"""Added to the metric, relative to its largest entry: where both ends are free it is singular."""


class Stationary(ProblemMethod):
    """Newton's method with a line search on the norm of the gradient.

    It ends in a stationary point of the action of any index, such as a motion of mechanics beyond
    its first conjugate point, mostly in one near the guess: the action may grow on the way.
    """

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
        """See ProblemMethod.minimize; what is made small is the gradient."""
        search = _Search(ActionObjective(problem, "band"), start.x)
        with Deadline(criteria.time_limit).in_force():
            why = search.run(criteria.max_iterations, report)
        x, value = search.x, cost_of(problem, search.x)
        n_neg = search.objective.negative_eigenvalues(x) if why is Reason.STATIONARY else -1
        if why is Reason.STATIONARY:
            status, steps = Status.STATIONARY, search.steps
            message = f"a stationary point of cost {value:.10g} and index {n_neg} after {steps} "
            message += f"steps.{chart_sentence(problem, x)}"
        else:
            status, reason = unfinished(why)
            if why is Reason.DIVERGED:
                reason = "no step makes the gradient smaller"
            message = (
                f"{reason} after {search.steps} steps, before a stationary point was found; try a "
                "guess nearer to one."
            )
        return Answer(problem, x, value, status, message, search.steps, n_neg)


class _Search:
    """The iterates. x: the last one. steps: number of steps that were taken."""

    def __init__(self, objective: ActionObjective, x: DiscretePath) -> None:
        self.objective, self.x, self.steps = objective, x, 0
        layout, metric = objective.structure.layout, objective.structure.metric["nodal"]
        n = objective.problem.ld.lagrangian.nv
        D = sparse_sum(layout, metric[..., None, None] * np.eye(n))
        floor = METRIC_FLOOR * max(abs(D).max(), 1e-300)
        self.metric = _factor(D, floor)

    def run(self, most: int, report: Report | None) -> Reason:
        """Take steps until the gradient is one of rounding errors; why it stopped."""
        try:
            for _ in range(most):
                between_steps(self.objective, self.x)
                why = self._step()
                if why is not None:
                    return why
                if report is not None:
                    report(self.steps, self.objective.problem.ld.action(self.x))
        except STOPS as stopped:
            return why_stopped(stopped)
        return Reason.ITERATION_LIMIT

    def _step(self) -> Reason | None:
        """One Newton step, shortened until the gradient decreases; why no further one is taken."""
        model = self.objective.model(self.x, None, None)
        assert isinstance(model, BandModel)
        layout, gradient = model.layout, model.gradient
        H = sparse_sum(layout, model.intervals.hessian)
        try:
            step = _factor(H).solve(-gradient)
        except RuntimeError:  # exactly singular
            return Reason.DIVERGED
        length = self.objective.relative_size(self.x, step, model)
        if not np.isfinite(length):
            return Reason.DIVERGED
        size, fraction = self._norm(gradient), 1.0
        while fraction >= LEAST_FRACTION:
            trial = self.objective.retract(self.x, fraction * step, model)
            if self._norm(self._gradient(trial, model)) <= (1.0 - DECREASE * fraction) * size:
                self.x, self.steps = trial, self.steps + 1
                return Reason.STATIONARY if fraction * length <= ROUNDING_LENGTH else None
            if length <= CONVERGED_LENGTH:
                return Reason.STATIONARY
            fraction /= 2
        return Reason.DIVERGED

    def _gradient(self, x: DiscretePath, model: BandModel) -> Array:
        if not np.isfinite(self.objective.value(x)):
            return np.full_like(model.gradient, np.inf)
        return self.objective.gradient(x, model)

    def _norm(self, gradient: Array) -> float:
        """|g| in the dual of the metric, sqrt(g^T D^-1 g)."""
        if not np.isfinite(gradient).all():
            return float("inf")
        return float(np.sqrt(abs(gradient @ self.metric.solve(gradient))))


def _factor(matrix: csc_matrix, floor: float = 0.0) -> SuperLU:
    """The factors of a sparse matrix plus a multiple of the identity. Raises RuntimeError."""
    from scipy.sparse import csc_matrix, identity  # slow to import, and only needed here
    from scipy.sparse.linalg import splu

    return splu(csc_matrix(matrix + floor * identity(matrix.shape[0])) if floor else matrix)
