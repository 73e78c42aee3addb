"""solve_jointly: a motion and its duration, by one solve."""

from __future__ import annotations

import dataclasses
import math
import time

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Ended, Reason
from hovi.optimize.start import Start
from hovi.optimize.trust_region import minimize
from hovi.planning.problem.contradictions import contradiction
from hovi.planning.problem.limits import Limits, no_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import LAST_BARRIER
from hovi.planning.solver.action_objective import MAX_BAND_INTERVALS
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.free_duration.timed_action import TimedAction
from hovi.planning.solver.free_duration.timed_path import TimedPath, TimePrice, stretched_path
from hovi.planning.solver.free_duration.timed_search import minimum_within_limits
from hovi.planning.solver.methods.interior_point import InteriorPoint, takes_rows
from hovi.planning.solver.methods.method import Guess
from hovi.planning.solver.outcome.cost_with_time import price_of_time
from hovi.planning.solver.solver import STATIONARY_DECREASE, Solution, solution_of
from hovi.planning.solver.status import Status, chart_sentence, status_of
from hovi.system.blas_threads import one_blas_thread
from hovi.system.deadline import Deadline, OutOfTimeError
from hovi.system.interruption import interruptible


def solves_jointly(problem: TrajectoryProblem, near: bool) -> bool:
    """Whether the duration can be an unknown of a problem's motion.

    Where more depends on it than the action and the limits, it cannot: functions of time, obstacles
    that move, via points, segments and equations with times of their own, passive torques, and
    velocities asked for at the goal. Limits on the torque rate are imposed after a first solve, a
    start is led back inside its limits in a time of its own, and many intervals need the merge
    tree. Equations and distances are followed from a motion that nearly is a solution.
    near: whether the guess is one.
    """
    equations, distances, limits = problem.equations, problem.distances, problem.limits
    last = problem.grid.intervals
    if problem.periodic or problem.via or len(problem.passive) > 0:
        return False
    if problem.ld.segments is not None or last > MAX_BAND_INTERVALS:
        return False
    if problem.ld.lagrangian.timed or any(each.timed for each in problem.bounds):
        return False
    if limits is not None and (limits.on_torque_rate or limits.excused):
        return False
    if any(each.y.needs - {"q"} or each.where.node < last for each in equations):
        return False
    if distances is not None and (distances.paths or not takes_rows(problem)):
        return False
    return near or (not equations and distances is None)


@one_blas_thread
@interruptible
def solve_jointly(
    problem: TrajectoryProblem,
    path: DiscretePath,
    price: TimePrice,
    *,
    max_iterations: int = 500,
    time_limit: float | None = None,
    escape_saddles: bool = True,
    near: bool = False,
    barrier: float = LAST_BARRIER,
) -> Solution:
    """A motion x and a duration T that minimise S(x, T) + w T, with T between bounds.

    n_neg counts the duration among the unknowns, unless it is at a bound. The cost is S, with the
    price of time if the problem has one; the solution's problem is that of its duration. At a limit
    it is the best motion so far.

    problem: one that `solves_jointly`, for any duration. path: the guess, for this duration.
    price: of time, and the bounds of T. Other arguments as of `solve_on_grid`.
    """
    began = time.perf_counter()
    first, guess = _within(problem, path, price)
    criteria = Criteria(
        decrease=STATIONARY_DECREASE,
        max_iterations=max_iterations,
        time_limit=time_limit,
        escape_saddles=escape_saddles,
        exact=True,
        barrier=barrier,
    )
    if problem.limited or problem.constrained:
        limits = problem.limits or no_limits(problem.coordinates)
        result = _limited(first, limits, Start(guess, near=near), price, criteria)
    else:
        result = _unlimited(first, guess, price, criteria)
    return solution_of(result, 0.0, time.perf_counter() - began)


def _within(
    problem: TrajectoryProblem, path: DiscretePath, price: TimePrice
) -> tuple[TrajectoryProblem, DiscretePath]:
    """The problem and the guess for the nearest duration within the bounds."""
    before = problem.grid.duration
    T = float(np.clip(before, price.lower, price.upper))
    if before == T:
        return problem, problem.moved(path)
    first = problem.on(problem.grid.stretched(T))
    return first, first.moved(stretched_path(path, T / before))


def _unlimited(
    problem: TrajectoryProblem, guess: DiscretePath, price: TimePrice, criteria: Criteria
) -> Answer:
    """By the trust region."""
    objective = TimedAction(problem, price)
    ended = minimize(objective, Start(TimedPath(guess, problem.grid.duration)), criteria)
    n_neg = 0 if ended.convex else _negative_eigenvalues(objective, ended)
    T, path = ended.x.duration, ended.x.path
    final = problem.on(problem.grid.stretched(T))
    cost = ended.value - price.weight * T + price_of_time(final)
    nit, at_end = len(ended.steps), Ended(path, ended.outputs, None, ended.why)
    status, message = status_of(final, at_end, cost, nit, n_neg)
    message += chart_sentence(final, path)
    moved = final.moved(path)
    return Answer(final, moved, cost, status, message, nit, n_neg, ended.steps)


def _limited(
    problem: TrajectoryProblem,
    limits: Limits,
    start: Guess,
    price: TimePrice,
    criteria: Criteria,
) -> Answer:
    """By the interior point, unless limits and ends contradict each other for all durations."""
    longest = problem.on(problem.grid.stretched(price.upper))
    reason = contradiction(longest, limits)
    if reason:
        message = f"no motion within the limits was found: {reason}."
        return Answer.at(problem, start.x, Status.INFEASIBLE, message)
    deadline = Deadline(criteria.time_limit)
    found = minimum_within_limits(problem, limits, start, price, criteria)
    T = found.problem.grid.duration
    inside = all(not math.isclose(T, x, rel_tol=1e-12) for x in (price.lower, price.upper))
    if inside or found.status is not Status.MINIMUM:
        return found
    # as for a given duration: the barrier was relative to the cost with the price of time
    again = InteriorPoint().minimize(
        found.problem,
        Start(found.path, found.central, near=True),
        dataclasses.replace(criteria, time_limit=deadline.seconds_left),
    )
    steps, history = found.nit + again.nit, [*found.history, *again.history]
    best = again if again.status is Status.MINIMUM else found
    return dataclasses.replace(best, nit=steps, history=history)


def _negative_eigenvalues(objective: TimedAction, ended: Ended[TimedPath, None]) -> int:
    """n_neg of the exact bordered Hessian; -1 if the value is not finite, or if time runs out."""
    if ended.why is Reason.DIVERGED or not np.isfinite(ended.value):
        return -1
    try:
        model = objective.model(ended.x, None, None)
        return 0 if model.factor(0.0) is not None else model.negative_eigenvalues()
    except OutOfTimeError:
        return -1
