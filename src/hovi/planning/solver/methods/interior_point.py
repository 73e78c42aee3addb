"""Motions with limits and obstacles: an interior-point method with tightened bounds."""

from __future__ import annotations

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.methods.method import Method
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import STOPPED, STOPS, Reason, why_stopped
from hovi.planning.problem.contradictions import contradiction
from hovi.planning.problem.limits import no_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.methods.bounded_search import BoundedSearch
from hovi.planning.solver.methods.feasibility import feasible_motion
from hovi.planning.solver.methods.limits_between_points import halved, usable
from hovi.planning.solver.methods.method import Guess, ProblemMethod, Report
from hovi.planning.solver.missed_equations import missed_sentence
from hovi.planning.solver.non_finite import non_finite_condition, non_finite_sentence
from hovi.planning.solver.outcome.cost_with_time import cost_of
from hovi.planning.solver.status import (
    Status,
    diverged,
    infeasible_sentence,
    saddle_in_words,
    status_of,
    unfinished,
)
from hovi.system.dataclass import dataclass


@dataclass(frozen=True)
class InteriorPoint(ProblemMethod):
    """A primal-dual interior-point method, whose steps satisfy equations to first order.

    First a motion within bounds at the quadrature points is found; then bounds are tightened and
    intervals halved until the limits hold everywhere to their tolerance.

    free: what was found without distances, whose steps count; None where that was not looked for.
    method: another one that minimises the programs, and whose ends are judged; None for none.
    """

    free: Answer | None = None
    method: Method | None = None

    def supports(self, problem: TrajectoryProblem) -> bool:
        """All problems; by another method, those without distances of obstacles or links."""
        return self.method is None or problem.distances is None

    def minimize(
        self,
        problem: TrajectoryProblem,
        start: Guess,
        criteria: Criteria,
        report: Report | None = None,
    ) -> Answer:
        """See ProblemMethod.minimize; intervals may be split."""
        limits = problem.limits or no_limits(problem.coordinates)
        reason = contradiction(problem, limits)
        if reason:
            said = infeasible_sentence(reason, problem)
            return Answer.at(problem, start.x, Status.INFEASIBLE, said)
        search = BoundedSearch(problem, limits, criteria, report, start, method=self.method)
        if self.free is not None:
            search.goes_on_from(self.free)
        try:
            return _searched(search)
        except STOPS as stopped:  # between iterations, which end with their current point
            return _ended(search, why_stopped(stopped))


def _searched(search: BoundedSearch) -> Answer:
    """Run all stages."""
    ended, reason = feasible_motion(search)
    reason, excess = reason or search.unmet, 0.0
    if not reason and usable(ended) and not search.rows.fixed:
        ended, reason, excess = halved(search, ended)
        reason = reason or search.unmet
        if not reason and ended.why is Reason.STATIONARY:  # others may just lack rows yet
            reason = search.too_close(ended.x)
    problem, x, n_neg = search.problem, ended.x, search.negative_eigenvalues(ended)
    value, nit = cost_of(problem, x), search.iterations
    broken = "" if ended.why in STOPPED else _non_finite(search, x, value, excess)
    if broken:  # by an effect, not by the limits
        status, message = Status.DIVERGED, diverged(broken, nit)
    elif reason:
        status, message = Status.INFEASIBLE, infeasible_sentence(reason, problem)
    elif not problem.limited:
        status, message = status_of(problem, ended, value, nit, n_neg)
        message += "" if status is Status.MINIMUM else missed_sentence(problem, x)
    elif ended.why is not Reason.STATIONARY:
        status, message = _unfinished(ended.why, nit, value)
        message += missed_sentence(problem, x) if problem.constrained else ""
    elif n_neg == 0:
        status, message = Status.MINIMUM, _minimum(search, value, excess)
    else:
        status, message = Status.SADDLE, _saddle(value, n_neg)
    instants, forces, prices = None, None, None
    if ended.why not in (*STOPPED, Reason.DIVERGED):  # or rows may be of a later attempt
        instants, forces = search.forces(ended)
        prices = search.prices(ended) if problem.limited else None
    history, central, solved = search.history, None, None
    if status is Status.MINIMUM and problem.limited:
        central, solved = search.central_path(ended), search.solved_bounds(ended)
    known = value, status, message, nit, n_neg, history, forces, instants, prices
    return Answer(problem, x, *known, central=central, solved_bounds=solved)


def _ended(search: BoundedSearch, why: Reason) -> Answer:
    """The motion of the last solve."""
    problem, path = search.last
    value, nit = cost_of(problem, path), search.iterations
    status, message = _unfinished(why, nit, value)
    message += missed_sentence(problem, path) if problem.constrained else ""
    return Answer(problem, path, value, status, message, nit, history=search.history)


def _non_finite(search: BoundedSearch, path: DiscretePath, cost: float, excess: float) -> str:
    """The first number that is infinite or NaN, as a clause; "" if all are finite.

    excess: the largest over any limit, between the points too.
    """
    if np.isfinite(cost) and not np.isnan(excess):
        return non_finite_condition(search.problem, path)
    at_points = non_finite_sentence(search.problem, path)
    return at_points or f"{search.worst(path)}, between the quadrature points"


def _unfinished(why: Reason, nit: int, cost: float) -> tuple[Status, str]:
    status, reason = unfinished(why)
    return status, (
        f"{reason} after {nit} steps, before a minimum within the limits was found; the motion is "
        f"the best so far, of cost {cost:.10g}."
    )


def _minimum(search: BoundedSearch, cost: float, excess: float) -> str:
    fraction = f" to {excess:.1e} of their ranges" if excess > 0 else ""
    held = f"limits hold everywhere{fraction}, on {search.problem.grid.intervals} intervals"
    return f"a minimum of cost {cost:.10g} after {search.iterations} steps; {held}."


def _saddle(cost: float, n_neg: int) -> str:
    return f"{saddle_in_words(cost, n_neg)}; solve again with another guess."
