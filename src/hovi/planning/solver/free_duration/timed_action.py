"""The action plus the price of time, with the lengths of free parts as further unknowns."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.trust_region import Objective
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.time_price import TimePrice
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.free_duration.timed_model import TimedModel, moved_in_time
from hovi.planning.solver.free_duration.timed_path import TimedPath, stretched_problem

Array = npt.NDArray[np.float64]


DURATION_METRIC = 1e4
"""Entry of log L in the metric: with the first radius of 10 it may change by 0.1, so that the
motion takes shape before its duration moves far."""


class TimedAction(Objective[TimedPath]):
    """S(x, L) + w sum L in the columns x of the path and log L, L between bounds.

    The columns (q, h q', ..., c) of an interval keep the shape of the motion if L changes, and so
    do the proportions of the steps in a part.

    problem: without limits or equations, on a grid that the band supports, for any lengths.
    price: of time. first: the lengths of the problem, in [s].
    """

    def __init__(self, problem: TrajectoryProblem, price: TimePrice, first: Array) -> None:
        self.problem, self.price, self.first = problem, price, first
        self._actions: dict[bytes, ActionObjective] = {}

    def action(self, lengths: Array) -> ActionObjective:
        """The action for lengths, in [s]; the last two are kept."""
        key = lengths.tobytes()
        if key not in self._actions:
            problem = stretched_problem(self.problem, self.price.clock, self.first, lengths)
            if len(self._actions) > 1:
                del self._actions[next(iter(self._actions))]
            self._actions[key] = ActionObjective(problem, "band", keep_points=True)
        return self._actions[key]

    def motion(self, x: TimedPath) -> tuple[TrajectoryProblem, DiscretePath]:
        """The problem of the lengths at a point, and the motion there."""
        problem = self.problem.lasting(self.price.clock, self.first, x.lengths)
        return problem, problem.moved(x.path)

    def value(self, x: TimedPath) -> float:
        """S + w sum L."""
        return self.action(x.lengths).value(x.path) + self.price.of(x.lengths)

    def model(
        self, x: TimedPath, previous: QuadraticModel | None, step: Array | None
    ) -> TimedModel:
        """The quadratic model at x, its curvature weighted by the predicted outputs."""
        action = self.action(x.lengths)
        if isinstance(previous, TimedModel) and step is not None:
            curvatures = previous.predicted_slopes(step)
        else:
            curvatures = [action.output_slope(y, i) for i, y in enumerate(action.outputs(x.path))]
        inner = action.model_with(x.path, curvatures, None)
        return TimedModel(action, x, inner, self.price, DURATION_METRIC)

    def retract(self, x: TimedPath, step: Array, model: QuadraticModel) -> TimedPath:
        """The motion for the new lengths, then moved by the step in the columns."""
        return moved_in_time(self.action, self.price, x, step, model)

    def relative_size(self, x: TimedPath, step: Array, model: QuadraticModel) -> float:
        """The larger of that of the path and the changes of log L."""
        own = self.action(x.lengths).relative_size(x.path, step, model)
        return max(own, float(np.abs(step[-len(x.lengths) :]).max()))
