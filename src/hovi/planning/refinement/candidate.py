"""A solution with its estimated error, in the unit of a tolerance."""

from __future__ import annotations

import dataclasses
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.discrete.curve_integral import integral_along
from hovi.discrete.measures.motion_error import relative_difference
from hovi.errors import InputError
from hovi.planning.problem.tolerance import CURVE_TOLERANCE, Quantity, Tolerance
from hovi.planning.refinement.between_nodes import MissedBetweenNodes, missed_between_nodes
from hovi.planning.refinement.error_estimate import (
    FinerSolution,
    estimate_against,
    finer_than,
)
from hovi.planning.refinement.faults.along_motion import may_be_narrow
from hovi.planning.refinement.limit_sensitivity import cost_of_tolerance
from hovi.planning.refinement.nodal_hamiltonian import nodal_hamiltonian
from hovi.planning.solver.limits.limit_rows import MAX_LOSS
from hovi.planning.solver.outcome.cost_with_time import price_of_time
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status
from hovi.schemes import is_galerkin
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

ACCEPTED_FRACTION = 0.8
"""Largest accepted estimate, as a fraction of the tolerance."""
CANCELLATION_LIMIT = 20.0
"""Largest accepted sum of the intervals' |contributions| to the cost's error, in tolerances."""
HAMILTONIAN_ERROR_FRACTION = 0.1
"""Relative error of the cost that is inferred from the nodal Hamiltonian, over its spread."""
ROUNDING_FLOOR = 1e-14
"""Smallest estimate of the relative error of the cost."""
BARRIER_EXCESS = 10.0
"""Relative excess of a cost over its minimum, per last barrier parameter of the solve."""
LOOSE_SAFETY_FACTOR = 3.0
"""Factor on estimates above CURVE_TOLERANCE, where the finer solution is not much better."""
CONTRADICTION_RATIO = 10.0
"""Ratio of the difference of costs on two grids to their estimated errors above which the solver
is taken to have reached another minimum."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A solution with its estimated error.

    finer: the nearby solution on a finer grid, if any. error: estimate in the tolerance's unit;
        NaN if unknown.
    along: relative error of the integral of L~ along the curve; 0 for schemes without a curve.
    narrow: whether effects may change in a short time, so that the tolerance holds along the curve.
    missed: what equations are missed by between the nodes; None without any.
    uncancelled: the error with the sum of |contributions| instead of their sum, and at least the
        error inferred from the Hamiltonian.
    contradicted: relative difference from the cost on the next grid if it is far larger than the
        estimates, else 0.
    later: relative difference from the most accurate cost of a later grid, or from the cost of an
        unfinished solve there if that is lower.
    """

    solution: Solution
    tolerance: Tolerance
    finer: FinerSolution | None = None
    error: float = np.nan
    uncancelled: float = np.nan
    along: float = np.nan
    missed: MissedBetweenNodes | None = None
    contradicted: float = 0.0
    later: float = 0.0
    narrow: bool = False

    @classmethod
    def of(
        cls,
        solution: Solution,
        tolerance: Tolerance,
        time_limit: float | None = None,
        previous_decrease: float | None = None,
    ) -> Self:
        """A solution with the estimate of its error.

        time_limit: of the finer solution, in [s]. previous_decrease: see FinerSolution.
        """
        finer = finer_than(solution, time_limit) if solution.success else None
        if finer is None:
            return cls(solution, tolerance)
        if np.array_equal(finer.problem.grid.steps, solution.trajectory.grid.steps):
            finer = dataclasses.replace(finer, previous_decrease=previous_decrease)
        assert solution.problem is not None
        along = error_along(solution, finer)
        missed = missed_between_nodes(solution.problem, solution.trajectory)
        if tolerance.quantity is Quantity.COST:
            errors = _errors_of_cost(solution, finer, tolerance)
            narrow = may_be_narrow(solution.problem.ld.lagrangian)
            return cls(solution, tolerance, finer, *errors, along, missed, narrow=narrow)
        error = tolerance.measure(estimate_against(solution, finer, tolerance.frame))
        return cls(solution, tolerance, finer, error, error, along, missed)

    @property
    def within_tolerance(self) -> bool:
        """Whether the estimated error is within the tolerance, and the curve carries the motion."""
        accepted = _accepted(self.error, self.uncancelled, self.tolerance)
        return self.finer is not None and accepted and self.is_carried

    @property
    def is_carried(self) -> bool:
        """Whether the integral along the curve is accurate, and equations hold between nodes."""
        return self.along <= self._largest_along and self.largest_missed <= 1.0

    @property
    def is_trusted(self) -> bool:
        """Whether the error of the cost is not small by cancellation of contributions only."""
        return _trusted(self.uncancelled, self.tolerance)

    @property
    def is_at_floor(self) -> bool:
        """Whether most of the cost's error is one that no grid reduces."""
        known = max(self.error, self.uncancelled / CANCELLATION_LIMIT)
        cost = self.tolerance.quantity is Quantity.COST and self.is_carried
        return cost and bool(known <= 2 * least_error(self.solution))

    @property
    def largest_missed(self) -> float:
        """The largest of `missed`; 0 without equations along the motion."""
        return 0.0 if self.missed is None else float(self.missed.by_interval.max())

    @property
    def asks(self) -> str:
        """What asks for a finer grid, in words; "" if nothing does."""
        if self.finer is None:
            return "a motion on a finer grid, of which none was found"
        accepted = _accepted(self.error, self.uncancelled, self.tolerance)
        asking = {
            self.tolerance.subject: not accepted,
            "the integral along the curve": self.along > self._largest_along,
            "" if self.missed is None else self.missed.worst: self.largest_missed > 1.0,
        }
        return " and ".join(what for what, asked in asking.items() if asked)

    @property
    def difference(self) -> float:
        """The relative error of the cost or of the integral along the curve, the larger one.

        inf if it is unknown.
        """
        known = self.error_of_cost
        return np.inf if known is None else max(known, self.along)

    @property
    def larger_error(self) -> float:
        """The error in the tolerance's unit, or that of the integral along the curve if larger."""
        in_cost = self.tolerance.quantity is Quantity.COST
        return max(self.error, self.along) if in_cost else self.error

    @property
    def _largest_along(self) -> float:
        cost = self.tolerance.quantity is Quantity.COST
        if cost and self.narrow:
            return self.tolerance.size
        return max(self.tolerance.size, CURVE_TOLERANCE) if cost else CURVE_TOLERANCE

    @property
    def error_of_cost(self) -> float | None:
        """The relative error of the cost; None if unknown."""
        if self.finer is None:
            return None
        own = error_of_cost(self.solution, self.finer)
        own = max(own, self.along) if self.narrow else own
        return max(own, self.contradicted, self.later)

    def contradicts(self, earlier: Candidate) -> bool:
        """Whether the cost differs from that of an earlier grid by far more than both errors."""
        if earlier.finer is None:
            return False
        errors = error_of_cost(earlier.solution, earlier.finer)
        if self.finer is not None:
            errors += error_of_cost(self.solution, self.finer)
        return (
            relative_difference(earlier.finer.cost, self.solution.cost)
            > CONTRADICTION_RATIO * errors
        )

    def corrected(self, later: Candidate) -> Candidate:
        """This candidate with the difference from the cost on the next grid as its error."""
        difference = relative_difference(self.solution.cost, later.solution.cost)
        error = difference if self.tolerance.quantity is Quantity.COST else np.nan
        return dataclasses.replace(self, error=error, contradicted=difference)

    def compared_with(self, later_one: Candidate) -> Candidate:
        """This candidate with an error that a later grid's most accurate cost does not refute.

        So does an unfinished solve without limits that has reached a lower cost: its minimum would
        cost even less.
        """
        finer = later_one.finer
        if later_one.solution.success:
            cost = later_one.solution.cost if finer is None else finer.cost
        else:
            cost = _cost_of_unfinished(later_one.solution)
            if not cost < self.solution.cost:
                return self
        later = relative_difference(self.solution.cost, cost)
        in_cost = self.tolerance.quantity is Quantity.COST
        error = max(self.error, later) if in_cost else self.error
        return dataclasses.replace(self, error=error, later=max(self.later, later))

    def better_than(self, other: Candidate) -> bool:
        """Whether this one is preferred: minima first, then the smaller error."""
        if self.solution.success != other.solution.success:
            return self.solution.success
        return bool(np.isnan(other.error) or self.larger_error < other.larger_error)


def _cost_of_unfinished(solution: Solution) -> float:
    """The cost of an unfinished solve without limits: of the action, or along its curve if larger.

    inf if it may violate limits or equations, or ended for another reason.
    """
    problem, status = solution.problem, solution.status
    if problem is None or status not in (Status.ITERATION_LIMIT, Status.TIME_LIMIT):
        return np.inf
    if problem.limited or problem.constrained or not np.isfinite(solution.cost):
        return np.inf
    along = integral_along(problem.ld.lagrangian, solution.trajectory).value
    return float(max(solution.cost, along + price_of_time(problem)))


def _errors_of_cost(
    solution: Solution, finer: FinerSolution, tolerance: Tolerance
) -> tuple[float, float]:
    """The fields `error` and `uncancelled`."""
    error = error_of_cost(solution, finer)
    uncancelled = max(error, float(contributions(finer).sum()))
    if _accepted(error, uncancelled, tolerance):  # else a finer grid is needed anyway
        uncancelled = max(uncancelled, _hamiltonian_error(solution))
    return error, uncancelled


def _accepted(error: float, uncancelled: float, tolerance: Tolerance) -> bool:
    return error <= ACCEPTED_FRACTION * tolerance.size and _trusted(uncancelled, tolerance)


def _trusted(uncancelled: float, tolerance: Tolerance) -> bool:
    return bool(uncancelled <= CANCELLATION_LIMIT * tolerance.size)


def error_of_cost(solution: Solution, finer: FinerSolution) -> float:
    """Relative error of the cost, including the effects of the limits' tolerance and the barrier.

    Within limits at least the sum of the contributions: errors of opposite signs cancel in the
    difference of costs. Not below ROUNDING_FLOOR; 0 for zero cost with zero error.
    """
    error = relative_difference(finer.known, finer.cost, finer.problem.negligible_cost)
    if finer.known == 0:
        return error
    problem = solution.problem
    assert problem is not None
    if problem.limited:
        error = max(finer.safety_factor * error, float(contributions(finer).sum()))
        error += _excess_of_bounds(solution)
    elif error > CURVE_TOLERANCE:
        error *= LOOSE_SAFETY_FACTOR
    return max(error + cost_of_tolerance(solution), ROUNDING_FLOOR)


def _excess_of_bounds(solution: Solution) -> float:
    """Relative excess of a cost over its minimum as the solve ended early, beyond MAX_LOSS.

    That of control points away from the curve, and BARRIER_EXCESS times the last barrier parameter.
    """
    central = solution.central
    if central is None:
        return 0.0
    rows = central.rows
    loss = 0.0 if rows is None or rows.size == 0 else rows.max_loss - MAX_LOSS
    return loss + BARRIER_EXCESS * central.level


def error_along(solution: Solution, finer: FinerSolution) -> float:
    """Relative difference of the integral of L~ along the curve and the finer solution's cost.

    0 for schemes other than Galerkin tables, whose interpolant is not their own.
    """
    problem = solution.problem
    assert problem is not None
    if not all(is_galerkin(scheme) for scheme, _ in problem.grid.groups):
        return 0.0
    integral = integral_along(problem.ld.lagrangian, solution.trajectory)
    cost = integral.value + price_of_time(problem)
    return relative_difference(cost, finer.cost, problem.negligible_cost)


def least_error(solution: Solution) -> float:
    """The least relative error of the cost that can be estimated: see `cost_of_tolerance`.

    Within limits, plus MAX_LOSS, the price of bounding control points instead of the curve, and
    what a solve that ended early leaves.
    """
    rows = None if solution.central is None else solution.central.rows
    price = 0.0 if rows is None or rows.size == 0 else MAX_LOSS
    return max(ROUNDING_FLOOR, cost_of_tolerance(solution)) + price + _excess_of_bounds(solution)


def contributions(finer: FinerSolution) -> Array:
    """|contribution| of each interval to the relative error of the cost, shape (N,)."""
    size = max(abs(finer.cost), finer.problem.negligible_cost, np.finfo(float).tiny)
    return np.asarray(np.abs(finer.gains) / size)


def _hamiltonian_error(solution: Solution) -> float:
    """Relative error inferred from the nodal Hamiltonian; 0 where that need not be constant."""
    assert solution.problem is not None
    try:
        spread = nodal_hamiltonian(solution.problem, solution.trajectory).spread
    except InputError:
        return 0.0
    return HAMILTONIAN_ERROR_FRACTION * spread
