"""What is known of a solution's error, in the unit of a tolerance, and whether that is enough."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.discrete.motion_error import relative_difference
from hovi.errors import InputError
from hovi.planning.problem.limits import TOLERANCE
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Quantity, Tolerance
from hovi.planning.refinement.error_estimate import FinerSolution, estimate_against, finer_than
from hovi.planning.refinement.nodal_hamiltonian import nodal_hamiltonian
from hovi.planning.solver.solver import Solution

Array = npt.NDArray[np.float64]

ACCEPTED = 0.8
"""Share of the tolerance that an estimated error may have."""
CANCELLED = 20.0
"""How many times the tolerance the contributions of the intervals may sum up to where they
cancel in the cost."""
UNSTEADY = 0.1
"""Error of the cost that a spread of the nodal Hamiltonian speaks of, as a share of the spread."""
ROUNDING = 1e-14
"""Relative error of the cost that rounding may leave: no smaller one is claimed."""
CAUTION = 1.5
"""Factor on the difference from a finer solution under limits, which is not better by orders."""
BLUR = 10.0
"""Relative error of the cost that limits leave, in units of their tolerance: bounds are drawn in
by some tolerances, and may be exceeded by one."""
CONTRADICTED = 10.0
"""Ratio of the difference of costs on two grids and their errors beyond which it is no error: the
motion went on to another minimum."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A solution with what is known of its error.

    finer: the solution next to it, where there is one. error: in the tolerance's unit; not a
        number where nothing is known.
    whole: as the error, with contributions to the cost that do not cancel, and by the Hamiltonian.
    contradicted: relative difference of the cost on the next grid, where it is far more than the
        error.
    """

    solution: Solution
    tolerance: Tolerance
    finer: FinerSolution | None = None
    error: float = np.nan
    whole: float = np.nan
    contradicted: float = 0.0

    @classmethod
    def of(cls, solution: Solution, tolerance: Tolerance) -> Self:
        """A solution with what can be found out about its error."""
        finer = finer_than(solution) if solution.success else None
        if finer is None:
            return cls(solution, tolerance)
        if tolerance.quantity is Quantity.COST:
            return cls(solution, tolerance, finer, *_errors_of_cost(solution, finer, tolerance))
        error = tolerance.measure(estimate_against(solution, finer, tolerance.frame))
        error *= CAUTION if finer.problem.limited else 1.0
        return cls(solution, tolerance, finer, error, error)

    @property
    def enough(self) -> bool:
        """Whether the error is within the tolerance, by what is known."""
        return self.finer is not None and _within(self.error, self.whole, self.tolerance)

    @property
    def error_of_cost(self) -> float | None:
        """The relative error of the cost; None where it is not known."""
        if self.finer is None:
            return None
        return max(error_of_cost(self.solution, self.finer), self.contradicted)

    def contradicts(self, earlier: Candidate) -> bool:
        """Whether this finer grid's cost is another by far more than both errors."""
        if earlier.finer is None:
            return False
        errors = error_of_cost(earlier.solution, earlier.finer)
        if self.finer is not None:
            errors += error_of_cost(self.solution, self.finer)
        return relative_difference(earlier.finer.cost, self.solution.cost) > CONTRADICTED * errors

    def corrected(self, later: Candidate) -> Candidate:
        """This one where its minimum moved away on the next grid, with what that says of it."""
        moved = relative_difference(self.solution.cost, later.solution.cost)
        known = moved if self.tolerance.quantity is Quantity.COST else np.nan
        return dataclasses.replace(self, error=known, contradicted=moved)

    def better_than(self, other: Candidate) -> bool:
        """Whether it is to be preferred: a minimum to none, then the smaller error."""
        if self.solution.success != other.solution.success:
            return self.solution.success
        return bool(np.isnan(other.error) or self.error < other.error)


def _errors_of_cost(
    solution: Solution, finer: FinerSolution, tolerance: Tolerance
) -> tuple[float, float]:
    """The error, and the whole."""
    error = error_of_cost(solution, finer)
    whole = max(error, float(contributions(finer).sum()))
    if _within(error, whole, tolerance):  # else a finer grid is tried anyway
        whole = max(whole, _unsteady(solution))
    return error, whole


def _within(error: float, whole: float, tolerance: Tolerance) -> bool:
    return error <= ACCEPTED * tolerance.size and whole <= CANCELLED * tolerance.size


def error_of_cost(solution: Solution, finer: FinerSolution) -> float:
    """Relative; 0 where there is no cost, and else not below what rounding or limits leave."""
    error = relative_difference(finer.known, finer.cost)
    if finer.known == 0:
        return error
    problem = solution.problem
    assert problem is not None
    error *= CAUTION if problem.limited else 1.0
    return max(error, least_error(problem))


def least_error(problem: TrajectoryProblem) -> float:
    """The smallest error of the cost that is claimed, relative."""
    if not problem.limited:
        return ROUNDING
    return BLUR * (TOLERANCE if problem.limits is None else problem.limits.tolerance)


def contributions(finer: FinerSolution) -> Array:
    """What each interval adds to the error of the cost, relative, without its sign."""
    return np.asarray(np.abs(finer.gains) / max(abs(finer.cost), np.finfo(float).tiny))


def _unsteady(solution: Solution) -> float:
    """What the nodal Hamiltonian says of the error, relative; 0 where it is not constant."""
    assert solution.problem is not None
    try:
        spread = nodal_hamiltonian(solution.problem, solution.trajectory).spread
    except InputError:
        return 0.0
    return UNSTEADY * spread
