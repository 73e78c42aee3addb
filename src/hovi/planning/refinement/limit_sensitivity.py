"""How far limits move the cost, by their multipliers."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.planning.problem.limits import TOLERANCE
from hovi.planning.solver.solver import Solution

Array = npt.NDArray[np.float64]

SHIFT = 6.0
"""Shift of a bound, in tolerances: it is tightened by five, and may be exceeded by one."""


def cost_of_tolerance(solution: Solution) -> float:
    """Relative change of the cost with a shift of all limits by SHIFT tolerances.

    An upper bound, since control points are not tightened. 0 without limits, or where none is
    active. It is the smallest error that can be estimated.
    """
    problem = solution.problem
    assert problem is not None
    tolerance = TOLERANCE if problem.limits is None else problem.limits.tolerance
    return SHIFT * tolerance * float(limit_prices(solution).sum())


def limit_prices(solution: Solution) -> Array:
    """Relative change of the cost with every bound per range, shape (2, kinds), not negative.

    Those of lower bounds come first; kinds: see BoundedAction.prices. 0 without limits, or where
    none is active.
    """
    problem, prices = solution.problem, solution.prices
    if problem is None or not problem.limited or prices is None or solution.cost == 0:
        return np.zeros((2, 0))
    return prices / abs(solution.cost)
