"""The action plus the price of time under limits, with the duration as one more unknown."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.bounded_objective import BoundedObjective, Refinement
from hovi.optimize.ended import Outputs
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.free_duration.duration_border import Forces
from hovi.planning.solver.free_duration.row_border import RowForces, RowMap
from hovi.planning.solver.free_duration.timed_model import TimedModel, moved_in_time
from hovi.planning.solver.free_duration.timed_path import (
    TimedPath,
    TimePrice,
    stretched_problem,
)
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.planning.solver.multipliers import Multipliers

Array = npt.NDArray[np.float64]


DURATION_METRIC = 400.0
"""Entry of log T in the metric: with the first radius of 20 it may change by 1, since only longer
motions may be within the limits at all."""


class TimedBoundedAction(BoundedObjective[TimedPath]):
    """S(x, T) + w T in the columns x of the path and log T, with bounded outputs at the points.

    The points have the weights h w of the first duration T0: those of the barrier do not depend on
    the unknowns, and the forces of limits count T0 / T times in the integral over T.

    problem: with limits, without obstacles, on a grid that the band supports, for the duration T0.
    limits, margins, rows, multipliers, tolerances: as for BoundedAction. price: of time.
    """

    radii = 20.0, 20.0  # a long step in time leads to another motion

    def __init__(
        self,
        problem: TrajectoryProblem,
        limits: Limits,
        margins: Array | None,
        price: TimePrice,
        rows: LimitRows,
        multipliers: Multipliers | None = None,
        tolerances: tuple[float, float] | None = None,
    ) -> None:
        self.problem = problem
        self.limits = limits
        self.margins = margins
        self.price = price
        self.rows = rows
        self.multipliers, self.tolerances = multipliers, tolerances
        self._at: dict[float, _AtDuration] = {}
        self._first = self._begun()
        self.bounds = self._first.bounds
        self._slopes: list[Array] = []
        self._stretch = np.zeros(0)

    def at(self, duration: float) -> _AtDuration:
        """The bounded action for a duration, in [s]; the first and the last two are kept."""
        found = self._first if duration == self.problem.grid.duration else self._at.get(duration)
        if found is None:
            if len(self._at) > 1:
                del self._at[next(iter(self._at))]
            found = self._at[duration] = self._first.stretched(duration)
        found.action.multipliers = self.multipliers
        return found

    def _begun(self) -> _AtDuration:
        """The bounded action for the first duration, of which the others are stretched ones."""
        known = self.multipliers, self.tolerances
        return _AtDuration(self.problem, self.limits, self.margins, self.rows, *known)

    def action(self, duration: float) -> ActionObjective:
        """The action for a duration, in [s]."""
        return self.at(duration).action

    def fraction(self, duration: float) -> float:
        """T0 / T, by which the forces of limits count in the integral over T."""
        return self.problem.grid.duration / duration

    def outputs(self, x: TimedPath) -> Outputs:
        """S + w T, and the bounded outputs relative to their ranges."""
        found = self.at(x.duration).outputs(x.path)
        return Outputs(found.value + self.price.weight * x.duration, found.y)

    def model(self, x: TimedPath, sigma: Array, rho: Array, multipliers: Array) -> TimedModel:
        """The bordered model with the terms of the bounds: see BoundedObjective.model."""
        at, fraction = self.at(x.duration), self.fraction(x.duration)
        at.predict(self._slopes)
        inner = at.model(x.path, fraction * sigma, fraction * rho, fraction * multipliers)
        gradient, force = (at.forces(x.path, fraction * each) for each in (rho, multipliers))
        forces = [Forces(*each) for each in zip(gradient, force, strict=True)]
        first = len(rho) - self.rows.size
        weights = self.bounds.weights[first:]
        rows = RowForces(
            at.row_map(x.path),
            weights * sigma[first:],
            weights * rho[first:],
            weights * multipliers[first:],
        )
        model = TimedModel(at.action, x, inner, self.price, DURATION_METRIC, forces, rows)
        alone = np.zeros_like(model.gradient)
        alone[-1] = 1.0
        self._stretch = self.push(alone, model)
        return model

    def push(self, step: Array, model: QuadraticModel) -> Array:
        """First-order change of the bounded outputs, shape (R,)."""
        assert isinstance(model, TimedModel)
        rows = []
        for dx, (_y, J) in zip(model.point_steps(step), model.expansion.outputs, strict=True):
            rows.append(np.concatenate([dx, np.matmul(J, dx[:, :, None])[:, :, 0]], axis=1))
        dy = self._first.relative(np.concatenate(rows))
        return np.append(dy, model.row_steps(step))

    def pull(self, forces: Array, model: QuadraticModel) -> Array:
        """Gradient of sum of weights (forces y) in the columns and log T."""
        assert isinstance(model, TimedModel)
        T = model.x.duration
        columns = self.at(T).pull(self.fraction(T) * forces, model.inner)
        return np.append(columns, np.vdot(self.bounds.weights * forces, self._stretch))

    def accept(self, step: Array, model: QuadraticModel) -> None:
        """Use the outputs that the step predicts as weights of the next model's curvature."""
        assert isinstance(model, TimedModel)
        self._slopes = model.predicted_slopes(step)

    def hold(self, x: TimedPath, change: Array) -> float:
        """See BoundedObjective.hold."""
        action = self.action(x.duration)
        added = action.hold(x.path, change)
        self.multipliers = action.multipliers
        return added

    def satisfies_equations(self, x: TimedPath) -> bool:
        """Whether equations hold to their tolerances."""
        return self.at(x.duration).satisfies_equations(x.path)

    def refine(self, x: TimedPath, level: float) -> Refinement | None:
        """Bound more control points of the motion: see LimitRows."""
        found = self.at(x.duration).refine(x.path, level)
        if found is not None:
            self.rows = self.at(x.duration).extended.on(self.problem.grid)
            self._at.clear()
            self._first = self._begun()
            self.bounds = self._first.bounds
        return found

    def retract(self, x: TimedPath, step: Array, model: QuadraticModel) -> TimedPath:
        """The motion in the new duration, then moved by the step in the columns."""
        return moved_in_time(self.action, self.price, x, step, model)


class _AtDuration(BoundedAction):
    """The bounded action for one duration, whose predicted outputs come from another."""

    def __init__(
        self,
        problem: TrajectoryProblem,
        limits: Limits,
        margins: Array | None,
        rows: LimitRows,
        known: Multipliers | None,
        tolerances: tuple[float, float] | None,
    ) -> None:
        super().__init__(problem, limits, margins, "band", known, rows=rows)
        self.extended, self.tolerances = rows, tolerances
        self.action.keep_points = True

    def stretched(self, duration: float) -> _AtDuration:
        """The same for another duration, in [s], before the first model.

        Bounds and the columns of the Hessian's pattern stay, weights grow with the duration.
        """
        ratio = duration / self.problem.grid.duration
        other = copy.copy(self)
        other.problem = stretched_problem(self.problem, duration)
        known = self.action.multipliers
        other.action = ActionObjective(other.problem, "band", multipliers=known, keep_points=True)
        other.ld, other.lagrangian = other.action.ld, other.action.lagrangian
        lower, upper, weights = self._at_points
        other._at_points = lower, upper, ratio * weights
        other._predicted = None
        other.rows = other.extended = self.extended.stretched(other.problem.grid)
        other._row_weights, other._row_columns = other.rows.weights, other.rows.columns("nodal")
        other.bounds = dataclasses.replace(
            self.bounds, weights=ratio * self.bounds.weights, measure=duration
        )
        return other

    def row_map(self, path: DiscretePath) -> RowMap:
        """The rows with their values and derivatives at a path."""
        return RowMap(self.extended, self._row_columns, self.extended.values(path))

    def predict(self, slopes: list[Array]) -> None:
        """Take `output_slope` of predicted outputs, per batch; those of the path if empty."""
        self._predicted = slopes or None

    def relative(self, changes: Array) -> Array:
        """Changes of (q, ..., outputs) at the points as those of the bounded outputs, (R,)."""
        return np.asarray((changes[:, self.columns] * self._inverse_ranges).ravel())
