"""The action with quadratic penalties instead of limits, to restore feasibility, or to refute it.

A motion at which the violation has a minimum that is not zero is locally infeasible: none near it
violates the limits less. [NocedalWright2006, section 17.2]
"""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.bounded_objective import Outputs
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Reason
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.trust_region import Objective, minimize
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

LEAST_VIOLATION_PENALTY = 1e6
"""Penalty, relative to the mean density of the action, at which the violation outweighs it."""
STALLED = 0.1
"""Share by which some steps have to decrease it; else it is near its least value."""
MAX_STEPS = 40
"""Maximum number of steps."""
OUTWEIGHED = 0.5
"""Largest share of the action in the penalized one that tells that limits cannot be met."""


class PenalizedAction(Objective[DiscretePath]):
    """action + penalty/2 sum weights (distance outside the bounds)^2."""

    def __init__(self, limited: BoundedAction, penalty: float) -> None:
        self.limited = limited
        self.penalty = penalty
        self._last: tuple[DiscretePath, Outputs] | None = None

    def violation(self, x: DiscretePath) -> float:
        """Largest distance outside the bounds, as a share of the range."""
        return float(np.max(np.abs(self._outside(x)), initial=0.0))

    def value(self, x: DiscretePath) -> float:
        """The penalized action."""
        return self._outputs(x).value + 0.5 * self.penalty * self.squares(x)

    def squares(self, x: DiscretePath) -> float:
        """Sum weights (distance outside the bounds)^2."""
        return float(np.sum(self.limited.bounds.weights * self._outside(x) ** 2))

    def model(
        self, x: DiscretePath, previous: QuadraticModel | None, step: Array | None
    ) -> QuadraticModel:
        """The quadratic model, with the bounds that are violated at x."""
        outside = self._outside(x)
        force = self.penalty * outside
        return self.limited.model(x, self.penalty * (outside != 0), force, force)

    def retract(self, x: DiscretePath, step: Array, model: QuadraticModel) -> DiscretePath:
        """The path moved by a step."""
        return self.limited.retract(x, step, model)

    def relative_size(self, x: DiscretePath, step: Array, model: QuadraticModel) -> float:
        """As for the action."""
        return self.limited.action.relative_size(x, step, model)

    def _outputs(self, x: DiscretePath) -> Outputs:
        if self._last is None or self._last[0] is not x:
            self._last = x, self.limited.outputs(x)
        return self._last[1]

    def _outside(self, x: DiscretePath) -> Array:
        y, bounds = self._outputs(x).y, self.limited.bounds
        return np.asarray(np.maximum(y - bounds.upper, 0) - np.maximum(bounds.lower - y, 0))


@dataclass(frozen=True, eq=False)
class LeastViolation:
    """A motion near one of least violation, and how it was found.

    path, value: the motion and its action. violation: the largest, as a share of its range.
    squares: sum weights (distance outside)^2. steps, stop: how many, and why they ended.
    least: whether the violation is near a minimum, which is not zero.
    """

    path: DiscretePath
    value: float
    violation: float
    squares: float
    least: bool
    steps: int
    why: Reason


def least_violation(
    limited: BoundedAction, path: DiscretePath, density: float, criteria: Criteria
) -> LeastViolation:
    """Minimise the violation of limits from a motion, as far as it decreases quickly.

    density: mean density of the action. criteria: for the remaining time.
    """
    penalized = PenalizedAction(limited, LEAST_VIOLATION_PENALTY * density)
    steps = min(MAX_STEPS, criteria.max_iterations)
    criteria = dataclasses.replace(criteria, max_iterations=steps, stalled=STALLED)
    found = minimize(penalized, path, criteria)
    squares, violation = penalized.squares(found.x), penalized.violation(found.x)
    action = found.value - 0.5 * penalized.penalty * squares
    least = found.why in (Reason.STALLED, Reason.STATIONARY) and action <= OUTWEIGHED * found.value
    return LeastViolation(found.x, action, violation, squares, least, found.iterations, found.why)
