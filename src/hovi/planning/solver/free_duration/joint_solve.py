"""solve_jointly: a motion and the lengths of its free parts, such as its duration, by one solve."""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import Equation
from hovi.discrete.grid import DiscretePath, Grid
from hovi.optimize.criteria import MAX_ITERATIONS, Criteria
from hovi.optimize.ended import Ended, Reason
from hovi.optimize.start import Start
from hovi.optimize.trust_region import minimize
from hovi.planning.problem.along_nodes import Rows
from hovi.planning.problem.clock import SAME_LENGTH, Clock
from hovi.planning.problem.contradictions import contradiction
from hovi.planning.problem.limits import Limits, no_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.time_price import TimePrice
from hovi.planning.problem.tolerance import LAST_BARRIER
from hovi.planning.solver.action_objective import MAX_BAND_INTERVALS
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.free_duration.timed_action import TimedAction
from hovi.planning.solver.free_duration.timed_path import TimedPath, stretched_path
from hovi.planning.solver.free_duration.timed_search import minimum_within_limits
from hovi.planning.solver.methods.interior_point import InteriorPoint
from hovi.planning.solver.methods.method import Guess
from hovi.planning.solver.outcome.cost_with_time import price_of_time
from hovi.planning.solver.solver import STATIONARY_DECREASE, Solution, solution_of
from hovi.planning.solver.status import Status, chart_sentence, status_of
from hovi.system.deadline import Deadline, OutOfTimeError

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


def solves_jointly(problem: TrajectoryProblem, clock: Clock, lengths: Array, near: bool) -> bool:
    """Whether lengths of parts can be unknowns of a problem's motion.

    Where more depends on them than the action and the limits, they cannot: functions of time,
    obstacles that move, passive torques, and velocities asked for at the goal. Limits on the torque
    rate are imposed after a first solve, a start is led back inside its limits in a time of its
    own, and many intervals need the merge tree. Equations and distances are followed from a motion
    that nearly is a solution.
    clock: which parts. lengths: those of the problem, in [s]. near: whether the guess is a solution
    nearly.
    """
    equations, distances, limits = problem.equations, problem.distances, problem.limits
    if problem.periodic or len(problem.passive) > 0:
        return False
    if problem.grid.intervals > MAX_BAND_INTERVALS or (problem.ld.k == 1 and not clock.whole):
        return False
    timed = any(each.timed for each in problem.ld.lagrangians)
    if timed or any(each.timed for each in problem.bounds):
        return False
    if limits is not None and (limits.on_torque_rate or limits.excused):
        return False
    nodes = clock.nodes(problem.grid, lengths)
    asked = [each for each in equations if not isinstance(each.y, Rows)]  # those along come next
    if not all(_stays(each, problem.grid, nodes) for each in asked):
        return False
    if any(each.where.level > 0 or each.timed for each in problem.along):
        return False
    if distances is not None and (distances.timed or problem.ld.chart is not None):
        return False
    return near or (not equations and distances is None)


def _stays(equation: Equation, grid: Grid, nodes: Index) -> bool:
    """Whether an equation means the same for all lengths of parts with these nodes, (p, 2)."""
    node = equation.where.node
    inside = ((nodes[:, 0] < node) & (node < nodes[:, 1])).any()
    moves = node in (0, grid.intervals) and node in nodes  # velocities there change with L
    return not inside and not (moves and equation.y.needs - {"q"})


def solve_jointly(
    problem: TrajectoryProblem,
    path: DiscretePath,
    price: TimePrice,
    lengths: Array,
    *,
    max_iterations: int = MAX_ITERATIONS,
    time_limit: float | None = None,
    escape_saddles: bool = True,
    near: bool = False,
    barrier: float = LAST_BARRIER,
) -> Solution:
    """A motion x and lengths L of parts that minimise S(x, L) + w sum L, with L between bounds.

    n_neg counts lengths among the unknowns, unless they are at bounds. The cost is S, with the
    price of time if the problem has one; the solution's problem is that of its lengths. At a limit
    it is the best motion so far.

    problem: one that `solves_jointly`, for any lengths. path: the guess, for the first ones.
    price: of time, and the bounds of L. lengths: those of the problem, in [s], shape (p,). Other
    arguments as of `solve_on_grid`.
    """
    began = time.perf_counter()
    first, guess, lengths = _within(problem, path, price, lengths)
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
        result = _limited(first, limits, Start(guess, near=near), price, lengths, criteria)
    else:
        result = _unlimited(first, guess, price, lengths, criteria)
    return solution_of(result, 0.0, time.perf_counter() - began)


def _within(
    problem: TrajectoryProblem, path: DiscretePath, price: TimePrice, before: Array
) -> tuple[TrajectoryProblem, DiscretePath, Array]:
    """The problem and the guess for the nearest lengths within the bounds, and these."""
    lengths, clock = np.clip(before, price.lower, price.upper), price.clock
    if np.allclose(lengths, before, rtol=SAME_LENGTH, atol=0.0):
        return problem, problem.moved(path), lengths
    first = problem.lasting(clock, before, lengths)
    moved = first.moved(stretched_path(path, problem.grid, clock, before, lengths))
    return first, moved, lengths


def _unlimited(
    problem: TrajectoryProblem,
    guess: DiscretePath,
    price: TimePrice,
    lengths: Array,
    criteria: Criteria,
) -> Answer:
    """By the trust region."""
    objective = TimedAction(problem, price, lengths)
    ended = minimize(objective, Start(TimedPath(guess, lengths)), criteria)
    n_neg = 0 if ended.convex else _negative_eigenvalues(objective, ended)
    path = ended.x.path
    final = problem.lasting(price.clock, lengths, ended.x.lengths)
    cost = ended.value - price.of(ended.x.lengths) + price_of_time(final)
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
    lengths: Array,
    criteria: Criteria,
) -> Answer:
    """By the interior point, unless limits and ends contradict each other for all lengths."""
    longest = problem.lasting(price.clock, lengths, price.upper)
    reason = contradiction(longest, limits)
    if reason:
        message = f"no motion within the limits was found: {reason}."
        return Answer.at(problem, start.x, Status.INFEASIBLE, message)
    deadline = Deadline(criteria.time_limit)
    found, lengths = minimum_within_limits(problem, limits, start, price, lengths, criteria)
    bounds = np.stack([price.lower, price.upper])
    kept = np.any(np.isclose(lengths, bounds, rtol=SAME_LENGTH, atol=0.0), axis=0)
    if not kept.any() or found.status is not Status.MINIMUM:
        return found
    # as for given lengths: the barrier was relative to the cost with their price
    near = Start(found.path, found.central, near=True)
    criteria = dataclasses.replace(criteria, time_limit=deadline.seconds_left)
    if kept.all():
        again = InteriorPoint().minimize(found.problem, near, criteria)
    else:
        others = price.with_given(lengths, kept)
        again = _limited(found.problem, limits, near, others, lengths[~kept], criteria)
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
