"""The minimum of the discrete action near a path, by Newton's method with reused Hessians.

Close to a minimum a gradient and a step with an earlier factorisation make as much progress as a
full Newton step, and cost less.
"""

from __future__ import annotations

import time

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.optimize.quadratic_model import Factor, QuadraticModel
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.outcome.without_solve import minimum_at
from hovi.planning.solver.solver import Solution
from hovi.system.dataclass import dataclass
from hovi.system.deadline import raise_if_late

MAX_HESSIANS = 5
"""Maximum number of Hessians that are factored."""
MAX_CORRECTIONS = 2
"""Maximum number of further steps with one Hessian."""
MAX_CONTRACTION = 0.3
"""Ratio of the lengths of successive steps above which a new Hessian is computed."""
LAST_STEP_FRACTION = 0.02
"""Length of the last step of an approach, relative to the longest distance covered."""
ROUNDING_LENGTH = 1e-15
"""Length of a step, relative to the data, that is due to rounding."""
MAX_POLISHING_STEPS = 8
"""Maximum number of steps of the final iteration to rounding."""
CONVERGED_LENGTH = 1e-9
"""Largest length of a last step if the steps no longer contract."""
LONG_STEP = 3e-3
"""Length of a step after which a new Hessian is computed in any case."""
MAX_REUSE_DISTANCE = 1e-2
"""Distance covered with a Hessian above which a new one is computed for the final iteration."""


@dataclass(frozen=True, eq=False)
class NearbyMinimum:
    """The end of an approach to a minimum, up to a small fraction of the distance covered.

    objective: the discrete action. path: the last iterate. value: the action at the minimum, to
        first order in the remaining distance.
    model, factor: the last Hessian. distance: sum of the lengths of the steps with it, of which
        `last` is the last.
    steps: total number of steps. began: time of the performance counter, in [s].
    """

    objective: ActionObjective
    path: DiscretePath
    value: float
    model: QuadraticModel
    factor: Factor
    distance: float
    last: float
    steps: int
    began: float

    def solution(self) -> Solution | None:
        """The minimum to rounding errors; None if the iteration fails."""
        objective, x, last = self.objective, self.path, self.last
        model: QuadraticModel | None = self.model if self.distance <= MAX_REUSE_DISTANCE else None
        factor, steps, length = self.factor, self.steps, np.inf
        for _ in range(MAX_POLISHING_STEPS):
            raise_if_late()
            if model is None:
                model, last = objective.model(x, None, None), np.inf
                renewed = model.factor(0.0)
                if renewed is None:
                    return None
                factor = renewed
            step = factor.solve(-objective.gradient(x, model))
            length = objective.relative_size(x, step, model)
            if not length <= MAX_CONTRACTION * last:
                if length <= CONVERGED_LENGTH:
                    break
                model = None
                continue
            x, steps = objective.retract(x, step, model), steps + 1
            if length <= ROUNDING_LENGTH or (
                length * length <= ROUNDING_LENGTH * last and last < np.inf
            ):
                break
            last = length
        if not length <= CONVERGED_LENGTH or objective.model(x, None, None).factor(0.0) is None:
            return None  # only the exact Hessian shows whether this is a minimum
        seconds = time.perf_counter() - self.began
        return minimum_at(objective.problem, x, steps, seconds)


def nearby_minimum(
    objective: ActionObjective,
    x: DiscretePath,
    model: QuadraticModel,
    known: float | None = None,
) -> NearbyMinimum | None:
    """Newton's method from a path; None if it does not contract at once.

    model: the objective's model at the path, its curvature best weighted with
        interpolated_slopes. Later Hessians are weighted with predicted outputs.
    known: a cost whose difference from the minimal cost is to be accurate.
    Lengths measure changes of q and T v, which in a flat valley change the action only little.
    """
    began, longest, steps, before = time.perf_counter(), 0.0, 0, np.inf
    for _ in range(MAX_HESSIANS):
        raise_if_late()
        factor = model.factor(0.0)
        if factor is None:
            return None
        value, gradient = objective.expansion.action, model.gradient
        distance, last, total = 0.0, before, np.zeros_like(gradient)
        for correction in range(MAX_CORRECTIONS + 1):
            step = factor.solve(-gradient)
            length = objective.relative_size(x, step, model)
            if not length <= (MAX_CONTRACTION if correction else 1.0) * last:
                break
            x, steps, distance = objective.retract(x, step, model), steps + 1, distance + length
            longest, total = max(longest, length), total + step
            decrease = -0.5 * float(np.vdot(gradient, step))
            near = length <= max(LAST_STEP_FRACTION * longest, ROUNDING_LENGTH)
            if near and (known is None or decrease <= LAST_STEP_FRACTION * abs(value - known)):
                return NearbyMinimum(
                    objective, x, value - decrease, model, factor, distance, length, steps, began
                )
            before, last = length if correction == 0 else before, length
            if length > LONG_STEP or correction == MAX_CORRECTIONS:
                break
            after = objective.gradient(x, model)
            # trapezoidal rule along the step, with an error of third order in its length
            value += 0.5 * float(np.vdot(gradient + after, step))
            gradient = after
        if distance == 0.0:
            return None
        model = objective.model(x, model, total)
    return None
