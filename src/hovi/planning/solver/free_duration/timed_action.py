"""The action plus the price of time, with the duration as one more unknown."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.trust_region import Objective
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.free_duration.timed_model import TimedModel, moved_in_time
from hovi.planning.solver.free_duration.timed_path import (
    TimedPath,
    TimePrice,
    stretched_problem,
)

Array = npt.NDArray[np.float64]


DURATION_METRIC = 1e4
"""Entry of log T in the metric: with the first radius of 10 it may change by 0.1, so that the
motion takes shape before its duration moves far."""


class TimedAction(Objective[TimedPath]):
    """S(x, T) + w T in the columns x of the path and log T, T between bounds.

    The columns (q, h q', ..., c) of an interval keep the shape of the motion if T changes, and so
    do the proportions of the steps.

    problem: without limits or equations, on a grid that the band supports, for any duration.
    price: of time.
    """

    def __init__(self, problem: TrajectoryProblem, price: TimePrice) -> None:
        self.problem = problem
        self.price = price
        self._actions: dict[float, ActionObjective] = {}

    def action(self, duration: float) -> ActionObjective:
        """The action for a duration, in [s]; the last two are kept."""
        if duration not in self._actions:
            problem = stretched_problem(self.problem, duration)
            if len(self._actions) > 1:
                del self._actions[next(iter(self._actions))]
            self._actions[duration] = ActionObjective(
                problem, "band", self.problem.structure, keep_points=True
            )
        return self._actions[duration]

    def value(self, x: TimedPath) -> float:
        """S + w T."""
        return self.action(x.duration).value(x.path) + self.price.weight * x.duration

    def model(
        self, x: TimedPath, previous: QuadraticModel | None, step: Array | None
    ) -> TimedModel:
        """The quadratic model at x, its curvature weighted by the predicted outputs."""
        action = self.action(x.duration)
        if isinstance(previous, TimedModel) and step is not None:
            curvatures = previous.predicted_slopes(step)
        else:
            curvatures = [action.output_slope(y, i) for i, y in enumerate(action.outputs(x.path))]
        inner = action.model_with(x.path, curvatures, None)
        return TimedModel(action, x, inner, self.price, DURATION_METRIC)

    def retract(self, x: TimedPath, step: Array, model: QuadraticModel) -> TimedPath:
        """The motion in the new duration, then moved by the step in the columns."""
        return moved_in_time(self.action, self.price, x, step, model)

    def relative_size(self, x: TimedPath, step: Array, model: QuadraticModel) -> float:
        """The larger of that of the path and the change of log T."""
        own = self.action(x.duration).relative_size(x.path, step, model)
        return max(own, abs(float(step[-1])))
