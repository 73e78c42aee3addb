"""Motions with equality constraints: Newton's method with the multipliers as unknowns."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Ended, Reason
from hovi.optimize.interior_point import MAX_SADDLES
from hovi.optimize.lagrange_newton import minimize_under_equations
from hovi.optimize.start import Start
from hovi.optimize.trust_region import minimize
from hovi.planning.problem.limits import no_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.constrained_action import ConstrainedAction
from hovi.planning.solver.methods.method import Guess, ProblemMethod, Report
from hovi.planning.solver.missed_equations import (
    FEASIBLE_RESIDUAL,
    missed_sentence,
    spurious_sentence,
    unmet_sentence,
    within,
)
from hovi.planning.solver.outcome.cost_with_time import price_of_time
from hovi.planning.solver.penalized_action import PenalizedAction
from hovi.planning.solver.status import Status, status_of
from hovi.system.deadline import Deadline, OutOfTimeError

Array = npt.NDArray[np.float64]

WARM_TORQUE_FRACTION = 0.1
"""Passive torque of a guess, relative to the largest torque, up to which multipliers are known."""
FIRST_DECREASE = 1e-3
"""Relative decrease at which a minimisation with a penalty stops."""


class LagrangeNewton(ProblemMethod):
    """Newton's method on the KKT equations.

    With equations at nodes alone, such as frame goals, a minimisation with a penalty leads from the
    guess to its neighbourhood: the cost decides there, and a trust region suits it.
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
        """See ProblemMethod.minimize."""
        if problem.unreachable:
            said = f"{problem.unreachable}."
            return Answer.at(problem, start.x, Status.INFEASIBLE, said)
        objective = ConstrainedAction(problem, start.x)
        return _answer(objective, _minimized(objective, start, criteria, report))


def _minimized(
    objective: ConstrainedAction, start: Guess, criteria: Criteria, report: Report | None
) -> Ended[DiscretePath, Array]:
    """The end of Newton's method, with the steps that led to where it began.

    From a saddle it begins again with a penalty and the multipliers there: negative curvature on
    the tangent space of the equations is one of the penalized action, too.
    """
    deadline, begin = Deadline(criteria.time_limit), Start(start.x, _multipliers(start, objective))
    if begin.z is not None or objective.problem.along or len(objective.problem.passive) > 0:
        found = minimize_under_equations(objective, begin, criteria, report)
    else:
        none = np.zeros(sum(objective.equations.sizes))
        found = _through_penalty(objective, Start(start.x, none), criteria, report)
    for _ in range(MAX_SADDLES if criteria.escape_saddles else 0):
        steps, saddles = found.steps, found.saddles
        more = criteria.max_iterations - len(steps)
        if more <= 0 or _negative_eigenvalues(objective, found) <= 0:
            break
        left = dataclasses.replace(criteria, time_limit=deadline.seconds_left, max_iterations=more)
        on_step = _with_offset(report, len(steps))
        found = _through_penalty(objective, Start(found.x, found.z), left, on_step)
        found.steps, found.saddles = steps + found.steps, saddles + found.saddles
    return found


def _through_penalty(
    objective: ConstrainedAction,
    start: Start[DiscretePath, Array],
    criteria: Criteria,
    report: Report | None,
) -> Ended[DiscretePath, Array]:
    """The end of Newton's method from where a minimisation with a penalty leads.

    There equations at nodes nearly hold, and multipliers are known. start.z: those of its terms.
    """
    deadline, problem, z = Deadline(criteria.time_limit), objective.problem, start.z
    assert z is not None
    known = objective.multipliers(z)
    free = BoundedAction(problem, no_limits(problem.coordinates), multipliers=known)
    rough = dataclasses.replace(criteria, decrease=FIRST_DECREASE)
    first = minimize(PenalizedAction(free, objective.penalty), Start(start.x), rough, report)
    if first.why is Reason.STATIONARY:
        left = dataclasses.replace(criteria, time_limit=deadline.seconds_left)
        near = Start(first.x, z + objective.penalty * free.residual(first.x))
        on_step = _with_offset(report, len(first.steps))
        found = minimize_under_equations(objective, near, left, on_step)
    else:
        there = objective.evaluate(first.x)
        found = Ended(first.x, there, np.zeros_like(there.y), first.why)
    found.steps, found.saddles = first.steps + found.steps, first.saddles
    return found


def _answer(objective: ConstrainedAction, found: Ended[DiscretePath, Array]) -> Answer:
    """The answer of a solve, whether it ended in a minimum or not."""
    problem, x, nit = objective.problem, found.x, len(found.steps)
    n_neg = _negative_eigenvalues(objective, found)
    residuals = objective.action.residuals(x)
    cost = found.value + price_of_time(problem)
    satisfied = within(residuals, FEASIBLE_RESIDUAL, FEASIBLE_RESIDUAL)
    done = found.why is Reason.STATIONARY or (found.why is Reason.ITERATION_LIMIT and satisfied)
    reason = spurious_sentence(problem, x) if done else ""
    if found.why is Reason.INFEASIBLE:
        reason = unmet_sentence(problem, x, residuals)
    status, message = _status(problem, found, reason, cost, nit, n_neg)
    forces, jets = objective.forces(found.z, x), objective.action.jets(x)
    return Answer(problem, x, cost, status, message, nit, n_neg, found.steps, forces, jets=jets)


def _multipliers(start: Guess, objective: ConstrainedAction) -> Array | None:
    """Least-squares multipliers at a path, which are those of a near minimum up to its distance.

    None where passive torques are large, and with equations at nodes where no minimum is near.
    """
    path, problem = start.x, objective.problem
    if not start.near and len(problem.passive) == 0:
        return None
    if objective.action.residuals(path).torque_fraction > WARM_TORQUE_FRACTION:
        return None
    there = objective.evaluate(path)
    known = objective.model(path, np.zeros_like(there.y)).least_squares_multipliers()
    if len(problem.passive) > 0:
        return known
    model = objective.model(path, known)
    factor = model.factor(0.0)
    if factor is None:
        return None
    step, _ = factor.solve(-model.gradient, -there.y)
    decrease = 0.5 * abs(model.curvature(step))
    return known if decrease <= FIRST_DECREASE * abs(there.value) else None


def _with_offset(report: Report | None, done: int) -> Report | None:
    """A report whose step numbers continue from earlier ones."""
    if report is None:
        return None
    return lambda step, cost: report(done + step, cost)


def _status(
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
    return status, message + missed_sentence(problem, ended.x)


def _negative_eigenvalues(objective: ConstrainedAction, found: Ended[DiscretePath, Array]) -> int:
    """n_neg on the tangent space of the equations; -1 unless stationary, or if time runs out."""
    if found.convex:
        return 0
    if found.why is not Reason.STATIONARY:
        return -1
    try:
        return objective.model(found.x, found.z).negative_eigenvalues()
    except OutOfTimeError:
        return -1
