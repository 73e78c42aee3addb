"""The action with penalties for limits and equations, to restore feasibility, or to refute it.

A motion at which the violation of limits and equations has a minimum that is not zero is locally
infeasible: none near it violates them less. [NocedalWright2006, section 17.2]
"""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Ended, Outputs, Reason
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.start import Start
from hovi.optimize.trust_region import Objective, minimize
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.bounded_action import BoundedAction

Array = npt.NDArray[np.float64]

LEAST_VIOLATION_PENALTY = 1e6
"""Penalty, relative to the mean density of the action, at which the violation outweighs it."""
STALLED = 0.1
"""Fraction by which some steps have to decrease the violation; else it is near its least value."""
MAX_STEPS = 40
"""Maximum number of steps to the least violation."""
OUTWEIGHED = 0.5
"""Fraction of the action in the penalized one below which the limits count as impossible."""


class PenalizedAction(Objective[DiscretePath]):
    """action + penalty/2 (sum weights (distance outside the bounds)^2 + |c|^2).

    limited: with the same penalty of its equations c; terms of its multipliers count as action.
    """

    def __init__(self, limited: BoundedAction, penalty: float) -> None:
        self.limited = limited
        if limited.action.multipliers is not None:
            limited.penalty = penalty
        self.penalty = penalty
        self._last: tuple[DiscretePath, Outputs] | None = None

    def violation(self, x: DiscretePath) -> float:
        """Largest distance outside the bounds, as a fraction of the range."""
        return float(np.max(np.abs(self._outside(x)), initial=0.0))

    def motion(self, x: DiscretePath) -> tuple[TrajectoryProblem, DiscretePath]:
        """The problem and the motion at a point."""
        return self.limited.motion(x)

    def value(self, x: DiscretePath) -> float:
        """The penalized action."""
        return self._outputs(x).value + 0.5 * self.penalty * self._outside_squares(x)

    def squares(self, x: DiscretePath) -> float:
        """Sum weights (distance outside the bounds)^2, plus |c|^2."""
        c = self.limited.residual(x)
        return self._outside_squares(x) + float(c @ c)

    def action(self, x: DiscretePath) -> float:
        """The action alone."""
        return self.value(x) - 0.5 * self.penalty * self.squares(x)

    @property
    def negligible(self) -> float:
        """See Objective.negligible."""
        return self.limited.action.negligible

    def is_least(self, ended: Ended[DiscretePath, None]) -> bool:
        """Whether a violation is near a minimum, which is not zero."""
        slow = ended.why in (Reason.STALLED, Reason.STATIONARY)
        return slow and self.action(ended.x) <= OUTWEIGHED * ended.value

    def model(
        self, x: DiscretePath, previous: QuadraticModel | None, step: Array | None
    ) -> QuadraticModel:
        """The quadratic model, with the bounds that are violated at x."""
        if previous is None or step is None:
            self.limited.predict([])
        else:
            self.limited.accept(step, previous)
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

    def _outside_squares(self, x: DiscretePath) -> float:
        """Sum weights (distance outside the bounds)^2."""
        return float(np.sum(self.limited.bounds.weights * self._outside(x) ** 2))

    def _outside(self, x: DiscretePath) -> Array:
        y, bounds = self._outputs(x).y, self.limited.bounds
        return np.asarray(np.maximum(y - bounds.upper, 0) - np.maximum(bounds.lower - y, 0))


def least_violation(
    penalized: PenalizedAction, path: DiscretePath, criteria: Criteria
) -> Ended[DiscretePath, None]:
    """Minimise the violation of limits from a motion, as far as it decreases quickly.

    penalized: with LEAST_VIOLATION_PENALTY. criteria: for the remaining time.
    """
    steps = min(MAX_STEPS, criteria.max_iterations)
    criteria = dataclasses.replace(criteria, max_iterations=steps, stalled=STALLED)
    return minimize(penalized, Start(path), criteria)
