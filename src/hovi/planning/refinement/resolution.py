"""Resolution: whether a minimum of the discrete action is one between the quadrature points, too.

On a coarse grid the torque may vanish at the points and swing between them. Such a motion minimizes
the discrete action, but not the integral along its curve.
"""

from __future__ import annotations

import dataclasses
from functools import cached_property
from typing import Literal, Self

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.discrete.grid import DiscretePath
from hovi.discrete.measures.motion_error import relative_difference
from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError
from hovi.methods.method import Method
from hovi.optimize.criteria import MAX_ITERATIONS
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.candidate import ROUNDING_FLOOR, error_of_cost
from hovi.planning.refinement.error_estimate import (
    LIMITED_SAFETY_FACTOR,
    FinerSolution,
    finer_than,
    prolonged,
    with_estimate,
)
from hovi.planning.refinement.faults.narrow_features import with_features
from hovi.planning.refinement.faults.on_curve import (
    RESOLVED,
    costs_nothing,
    difference_on_curve,
    fault_of_period,
    fault_on_curve,
)
from hovi.planning.refinement.faults.remedy import remedy
from hovi.planning.refinement.limit_sensitivity import cost_of_tolerance, limit_prices
from hovi.planning.refinement.spinning import fault_of_valley, spin
from hovi.planning.solver.methods.method import ProblemMethod, Report
from hovi.planning.solver.methods.stationary import Stationary
from hovi.planning.solver.outcome.cost_with_time import cost_of
from hovi.planning.solver.outcome.judge import judged, without_success
from hovi.planning.solver.receding.shift import Shift
from hovi.planning.solver.solver import Check, MotionCheck, Solution, solved_on_grid
from hovi.planning.solver.status import Status
from hovi.system.blas_threads import one_blas_thread
from hovi.system.dataclass import dataclass
from hovi.system.deadline import OutOfTimeError, is_late
from hovi.system.interruption import interrupted, interruptible

Array = npt.NDArray[np.float64]

NEARBY = 0.05
"""Change of q, and of T v, in [rad] or [m], up to which a motion near one that passed is not
compared with a finer one again."""
FARTHER, GROWTH = 0.5, 2.0
"""Largest such change without obstacles, equations and segments while the same limits are active
or, without any, no joint spins; and the factor on an estimate that is kept beyond NEARBY."""
PRICE_CHANGE, LEAST_PRICE = 0.25, 0.02
"""Relative change of the price of a limit up to which it is the same one, and the least price, as a
fraction of the cost, that this is relative to: see limit_prices."""
ERROR_PER_PRICE = 0.01
"""Error of the cost, per change of the price of a limit, that is added to an estimate that is kept:
a limit that begins to hold adds less."""
SMALL_DIFFERENCE = 1e-3
"""Relative difference of the costs at the points and along the curve of a motion that passed up to
which it is not looked at again near it."""
NEARBY_COST = 0.5
"""Relative change of the cost up to which that holds: near rest small motions differ much."""

_NO_FINER_MINIMUM = "no minimum was found near it on a finer grid"


@check_arguments
@one_blas_thread
@interruptible
def solve(
    problem: TrajectoryProblem,
    guess: str | Trajectory | DiscretePath = "cubic",
    *,
    max_iterations: int = MAX_ITERATIONS,
    time_limit: float | None = None,
    escape_saddles: bool = True,
    report: Report | None = None,
    method: Method | ProblemMethod | None = None,
    seek: Literal["minimum", "stationary"] = "minimum",
) -> Solution:
    """A motion that makes the discrete action stationary, checked between the quadrature points.

    A minimum that the grid does not resolve has the status UNRESOLVED, and no success.

    problem: the boundary data and the discrete Lagrangian.
    guess: "cubic", "minimum-jerk", a Trajectory (on any grid), or a DiscretePath on this grid.
    max_iterations: maximum number of steps; with limits or constraints, per round.
    time_limit: in [s]. At either limit the best motion so far is returned.
    escape_saddles: whether to leave saddles along negative curvature; False stops there with
        status SADDLE.
    report: called with the number of each step and the least cost so far.
    method: a member of hovi.methods, or a method of your own (hovi.methods.Method); None for the
        first suitable one of hovi.planning.solver.methods.choice.
    seek: "stationary" for a stationary point of any index near the guess, whose n_neg is its Morse
        index and whose status is STATIONARY; for problems without limits, obstacles and equations.
    With limits, `cost` belongs to the motion that satisfies them everywhere, and intervals may
    have been split.
    Raises InputError for a guess or a method that does not fit the problem.
    """
    if seek == "stationary":
        method = method or Stationary()
    found = solved_on_grid(
        problem,
        guess,
        max_iterations=max_iterations,
        time_limit=time_limit,
        escape_saddles=escape_saddles,
        report=report,
        method=method,
    )
    return with_check(resolved(found))


def with_check(solution: Solution) -> Solution:
    """The solution, whose replans are checked whatever its status is."""
    return solution if solution.check else dataclasses.replace(solution, check=resolved)


@one_blas_thread
@interruptible
def resolved(solution: Solution) -> Solution:
    """A success with an error estimate, or the same motion with the status UNRESOLVED.

    A minimum is resolved if
    (a) with Galerkin tables, whose curve is their own, the action differs by at most 1 % from the
        integral of L~ along the curve, and no torque of a passive joint exceeds 1 % of the largest
        torque;
    (b) the solution on a finer grid, reached from this one, is a minimum whose cost differs by at
        most 1 %. The finer grid has two more modes per interval, of a Galerkin table for any
        scheme; under limits every interval is halved where that fails;
    (c) that solution was found;
    (d) where without limits a light joint spins, or the finer solution is far away (among obstacles
        only where a joint spins and the costs differ), a still finer grid confirms the finer one:
        see `fault_of_valley`;
    (e) no effect has features between the points that change the cost by more: see `features_of`;
    (f) it is usable: see `judged`.
    Solutions of another status are returned unchanged. If the deadline in force passes before
    all of this is known, the status is TIME_LIMIT, and INTERRUPTED after Ctrl-C.
    """
    if not solution.success or solution.problem is None:
        return solution
    try:
        solution = judged(solution)
        if not solution.success:
            return solution
        solution, reason = _checked(solution)
    except OutOfTimeError:
        return _not_checked(solution)
    if reason and (is_late() or interrupted()):  # perhaps only as the finer solve was ended
        return _not_checked(solution)
    if reason:
        return _unresolved(solution, reason)
    if solution.status is Status.STATIONARY:
        return with_check(solution)
    return dataclasses.replace(solution, check=Resolution.of(solution))


def _checked(solution: Solution) -> tuple[Solution, str]:
    """The solution with an estimate, and why it is no minimum along its way, or ""."""
    reason, finer = fault_of_period(solution) or fault_on_curve(solution), None
    if solution.status is Status.STATIONARY:
        solution, reason = (solution, reason) if reason else _compared_with_stationary(solution)
        return (solution, reason) if reason else with_features(solution)
    if not reason and solution.error_estimate is None and solution.accuracy is None:
        solution, reason, finer = _compared_with_finer(solution)
    elif not reason and not costs_nothing(solution):
        reason = _fault_of_estimate(solution)
    error = None if costs_nothing(solution) else solution.error_estimate
    reason = reason or fault_of_valley(solution, error, finer)
    if not reason:
        solution, reason = with_features(solution)
    return solution, reason


@dataclass(frozen=True, eq=False)
class Resolution(MotionCheck):
    """The check of motions that are replanned from a resolved one.

    path, cost: of the resolved motion. estimate: of the relative error of its cost, kept for
    motions near it. motion: the resolved one; None for the rest of a longer one.
    """

    path: DiscretePath
    cost: float
    estimate: float
    motion: Solution | None = None

    @classmethod
    def of(cls, solution: Solution) -> Self:
        """That of a solution with an estimate."""
        assert solution.error_estimate is not None
        motion = dataclasses.replace(solution, check=None)
        return cls(solution.trajectory.path, solution.cost, solution.error_estimate, motion)

    @cached_property
    def on_curve(self) -> float:
        """The relative difference of its costs at the points and on the curve; inf if unknown."""
        return np.inf if self.motion is None else difference_on_curve(self.motion)

    @cached_property
    def prices(self) -> Array | None:
        """Prices of its limits: see limit_prices; None without limits, and if not known."""
        motion = self.motion
        if motion is None or motion.problem is None or motion.prices is None:
            return None
        return limit_prices(motion) if motion.problem.limited else None

    @cached_property
    def largest_change(self) -> float:
        """Largest change of q and T v, in [rad] or [m], at which the estimate is kept."""
        motion = self.motion
        if motion is None or motion.problem is None or not _limits_alone(motion.problem):
            return NEARBY
        calm = self.prices is not None if motion.problem.limited else spin(motion) is None
        return FARTHER if calm else NEARBY

    def __call__(self, solution: Solution) -> Solution:
        """The solution as `resolved` returns it; near the resolved one with (a) and (e) at most."""
        try:
            solution = judged(solution)
        except OutOfTimeError:
            return _not_checked(solution)
        estimate = self._kept_for(solution) if solution.success else None
        if estimate is None:
            return resolved(solution)
        reason = fault_of_period(solution)
        if self.on_curve > SMALL_DIFFERENCE:
            reason = reason or fault_on_curve(solution)
        if not reason:
            solution, reason = with_features(with_estimate(solution, estimate))
        if reason:
            return _unresolved(solution, reason)
        return dataclasses.replace(solution, check=self)

    def shifted(self, shift: Shift, problem: TrajectoryProblem) -> Check:
        """The same for the rest of the motion, where the error of the cost is as large.

        Anything may be compared again where the motion is on another grid.
        """
        if len(self.path.q) != len(shift.problem.grid.t):
            return resolved
        path = shift.path(self.path)
        cost = cost_of(problem, path)
        estimate = self.estimate * abs(self.cost) / max(abs(cost), problem.negligible_cost, 1e-300)
        too_large = estimate > _largest_estimate(problem)
        return resolved if too_large else Resolution(path, cost, estimate)

    def _kept_for(self, solution: Solution) -> float | None:
        """The estimate that is kept for a motion; None for one that is not near."""
        problem, path = solution.problem, solution.trajectory.path
        assert problem is not None
        change = abs(solution.cost - self.cost)
        if path.q.shape != self.path.q.shape or change > NEARBY_COST * abs(self.cost):
            return None
        dq = problem.coordinates.difference(self.path.q, path.q)
        dv = problem.grid.duration * (path.v - self.path.v)
        far, more = float(max(np.abs(dq).max(), np.abs(dv).max())), 0.0
        if far > NEARBY and far > self.largest_change:  # expensive: not for small changes
            return None
        if self.prices is not None:
            prices = limit_prices(solution)
            if prices.shape != self.prices.shape:
                return None
            changes = np.abs(prices - self.prices)
            if (changes > PRICE_CHANGE * np.maximum(self.prices, LEAST_PRICE)).any():
                return None
            more = ERROR_PER_PRICE * float(changes.max())
        estimate = (1.0 if far <= NEARBY else GROWTH) * self.estimate + more
        small = (far <= NEARBY and more == 0.0) or estimate <= _largest_estimate(problem)
        return estimate if small else None


def _largest_estimate(problem: TrajectoryProblem) -> float:
    """That of a resolved motion: within limits it has a safety factor."""
    return (LIMITED_SAFETY_FACTOR if problem.limited else 1.0) * RESOLVED


def _limits_alone(problem: TrajectoryProblem) -> bool:
    """Whether limits at most restrict a motion: no obstacles, equations or segments."""
    return problem.distances is None and not problem.constrained and problem.ld.segments is None


def _compared_with_finer(solution: Solution) -> tuple[Solution, str, FinerSolution | None]:
    """The solution with an estimate, why (b) or (c) does not hold or "", and the finer one."""
    try:
        finer = finer_than(solution)
    except HoviError as refused:
        reason = f"it could not be compared with a finer one: {str(refused).rstrip('.')}"
        return solution, reason, None
    if finer is None:
        return solution, _NO_FINER_MINIMUM, None
    return *_compared(solution, finer), finer


def _compared(solution: Solution, finer: FinerSolution) -> tuple[Solution, str]:
    """The solution with an error estimate, and why (b) does not hold, or ""."""
    estimate, difference = error_of_cost(solution, finer), abs(finer.known - finer.cost)
    compared = with_estimate(solution, estimate)
    assert solution.problem is not None
    if difference <= RESOLVED * max(abs(solution.cost), solution.problem.negligible_cost):
        return compared, ""
    return compared, _cost_change(difference / abs(solution.cost))


def _compared_with_stationary(solution: Solution) -> tuple[Solution, str]:
    """As `_compared_with_finer`, for a stationary point: the finer one has to have its index."""
    problem = solution.problem
    assert problem is not None
    start = prolonged(solution.trajectory.path, problem.finer.grid)
    finer = solved_on_grid(problem.finer, start, method=Stationary())
    if not finer.success:
        return solution, "no stationary point was found near it on a finer grid"
    if finer.n_neg != solution.n_neg:
        return solution, f"on a finer grid its index is {finer.n_neg} instead of {solution.n_neg}"
    change = relative_difference(solution.cost, finer.cost)
    compared = with_estimate(solution, max(change, ROUNDING_FLOOR))
    return compared, "" if change <= RESOLVED else _cost_change(change)


def _fault_of_estimate(solution: Solution) -> str:
    """Why (b) or (c) does not hold by a known error estimate; "" if they do.

    What the tolerance of limits costs is a part of the estimate that no grid changes.
    """
    if solution.error_estimate is None:
        return _NO_FINER_MINIMUM
    change = solution.error_estimate - cost_of_tolerance(solution)
    return "" if change <= RESOLVED else _cost_change(change)


def _cost_change(change: float) -> str:
    return f"a finer grid changes its cost by {100 * change:.2g} %"


def _unresolved(solution: Solution, reason: str) -> Solution:
    """The solution with the status UNRESOLVED; its message has the reason and what to do."""
    assert solution.problem is not None
    what = "a minimum" if solution.status is Status.MINIMUM else "stationary"
    message = (
        f"the motion is {what} on {solution.problem.grid.intervals} intervals, which do not "
        f"resolve it: {reason}; {remedy(solution, reason)}."
    )
    return without_success(solution, Status.UNRESOLVED, message)


def _not_checked(solution: Solution) -> Solution:
    """The solution without success, at Ctrl-C or late: what lies between its points is unknown."""
    assert solution.problem is not None
    stopped = interrupted()
    why = "the check was interrupted" if stopped else "the time limit was reached"
    message = (
        f"the motion is a minimum on {solution.problem.grid.intervals} intervals, of cost "
        f"{solution.cost:.10g}, but {why} before it was compared with one on a finer grid"
    )
    if stopped:
        return without_success(solution, Status.INTERRUPTED, f"{message}.")
    return without_success(solution, Status.TIME_LIMIT, f"{message}; allow more time.")
