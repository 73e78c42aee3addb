"""The action with quadratic penalties instead of limits, to restore feasibility."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.trust_region import Objective
from hovi.planning.solver.bounded_action import BoundedAction

Array = npt.NDArray[np.float64]


class PenalizedAction(Objective[DiscretePath]):
    """action + penalty/2 sum weights (distance outside the bounds)^2."""

    def __init__(self, limited: BoundedAction, penalty: float) -> None:
        self.limited = limited
        self.penalty = penalty

    def violation(self, x: DiscretePath) -> float:
        """Largest distance outside the bounds, as a share of the range."""
        return float(np.max(np.abs(self._outside(x)), initial=0.0))

    def value(self, x: DiscretePath) -> float:
        """The penalized action."""
        squares = float(np.sum(self.limited.bounds.weights * self._outside(x) ** 2))
        return self.limited.outputs(x).value + 0.5 * self.penalty * squares

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

    def _outside(self, x: DiscretePath) -> Array:
        y, bounds = self.limited.outputs(x).y, self.limited.bounds
        return np.asarray(np.maximum(y - bounds.upper, 0) - np.maximum(bounds.lower - y, 0))
