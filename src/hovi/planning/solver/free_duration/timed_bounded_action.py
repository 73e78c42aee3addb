"""The action plus the price of time under limits, with lengths of parts as further unknowns."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.ended import Outputs
from hovi.optimize.program import Program, Refinement
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.time_price import TimePrice
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.free_duration.duration_border import Forces
from hovi.planning.solver.free_duration.row_border import RowForces
from hovi.planning.solver.free_duration.timed_model import TimedModel, moved_in_time
from hovi.planning.solver.free_duration.timed_path import TimedPath, stretched_problem

Array = npt.NDArray[np.float64]

DURATION_METRIC = 400.0
"""Entry of log L in the metric: with the first radius of 20 it may change by 1, since only longer
motions may be within the limits at all."""


class TimedBoundedAction(Program[TimedPath]):
    """S(x, L) + w sum L in the columns x of the path and log L, with bounded outputs.

    The points have the weights h w of the first lengths L0: those of the barrier do not depend on
    the unknowns, and the forces of limits count L0 / L times in the integral over a part. Where
    distances are least does not change with L: their rows stay where they are in their intervals.

    first: the action with the bounds, in nodal coordinates, for the lengths L0; its expansions
    keep those at the points from now on. price: of time. lengths: L0, in [s].
    """

    radii = 20.0, 20.0
    """First radius of the trust region, in a cold start and in a warm one: a long step in time
    leads to another motion."""

    def __init__(self, first: BoundedAction, price: TimePrice, lengths: Array) -> None:
        first.action.keep_points = True
        self.first, self.price, self.lengths = first, price, lengths
        self._at: dict[bytes, BoundedAction] = {}
        self._slopes: list[Array] = []
        self._of_intervals = price.clock.parts(first.problem.grid, lengths)  # -1 for none
        self._update()
        self._terms: tuple[Array, Array, Array] | None = None
        self._last = first  # that of the last model
        self._rates = np.zeros(0)  # d outputs / d log L of their parts, (R,)

    def _update(self) -> None:
        """Take over the outputs of the first action, whose rows may be new."""
        self.bounds = self.first.bounds
        self._parts = self._of_intervals[self.first.output_intervals]
        # bounds cut more steps of several lengths, which move parts of the motion alone
        self.reopens = self.first.reopens or not self.price.clock.whole

    def at(self, lengths: Array) -> BoundedAction:
        """The bounded action for lengths, in [s]; the first and the last two are kept."""
        if np.array_equal(lengths, self.lengths):
            return self.first
        key = lengths.tobytes()
        if key not in self._at:
            if len(self._at) > 1:
                del self._at[next(iter(self._at))]
            self._at[key] = self._stretched(self.first, self.lengths, lengths)
        found = self._at[key]
        found.action.multipliers = self.first.action.multipliers
        return found

    def action(self, lengths: Array) -> ActionObjective:
        """The action for lengths, in [s]."""
        return self.at(lengths).action

    def fraction(self, lengths: Array) -> Array:
        """L0 / L, or 1 outside of parts, by which forces of limits count in the integral, (R,)."""
        return np.append(self.lengths / lengths, 1.0)[self._parts]

    def motion(self, x: TimedPath) -> tuple[TrajectoryProblem, DiscretePath]:
        """The problem of the lengths at a point, and the motion there."""
        problem = self.first.problem.lasting(self.price.clock, self.lengths, x.lengths)
        return problem, problem.moved(x.path)

    def outputs(self, x: TimedPath) -> Outputs:
        """S + w sum L, and the bounded outputs relative to their ranges."""
        found = self.at(x.lengths).outputs(x.path)
        return Outputs(found.value + self.price.of(x.lengths), found.y)

    @property
    def may_be_concave(self) -> bool:
        """See Program."""
        return self.first.may_be_concave

    def model(self, x: TimedPath, sigma: Array, rho: Array, multipliers: Array) -> TimedModel:
        """The bordered model with the terms of the bounds: see Program.model."""
        at, fraction = self.at(x.lengths), self.fraction(x.lengths)
        at.predict(self._slopes)
        self._terms = sigma, rho, multipliers
        inner = at.model(x.path, fraction * sigma, fraction * rho, fraction * multipliers)
        return self._bordered(x, inner)

    def model_without_concavity(self, x: TimedPath) -> QuadraticModel | None:
        """See Program."""
        inner = self.at(x.lengths).model_without_concavity(x.path)
        return None if inner is None else self._bordered(x, inner)

    def _bordered(self, x: TimedPath, inner: QuadraticModel) -> TimedModel:
        """The model in the path and log L from that in the path, with the last terms."""
        assert self._terms is not None
        at, fraction = self.at(x.lengths), self.fraction(x.lengths)
        rows, self._last = at.rows, at
        assert rows is not None
        gradient, force = (at.forces(x.path, fraction * each) for each in self._terms[1:])
        forces = [Forces(*each) for each in zip(gradient, force, strict=True)]
        weights, own = at.plain(self.bounds.weights), at.row_outputs
        weighted = ((weights * at.plain(each))[own] for each in self._terms)
        inside = self._of_intervals >= 0
        of_rows = RowForces(rows, inside, rows.columns("nodal"), rows.values(x.path), *weighted)
        model = TimedModel(at.action, x, inner, self.price, DURATION_METRIC, forces, of_rows)
        self._rates = self._rates_of(at, model, of_rows)
        return model

    def _rates_of(self, at: BoundedAction, model: TimedModel, rows: RowForces) -> Array:
        """Derivatives of the outputs in log L of their parts, (R,)."""
        plain = np.append(at.push_jets(model.stretches), rows.slopes)
        rates = at.ordered(np.append(plain, np.zeros(len(self.bounds.weights) - len(plain))))
        return rates + at.push_columns(model.kept) if model.kept.any() else rates

    def push(self, step: Array, model: QuadraticModel) -> Array:
        """First-order change of the bounded outputs, shape (R,)."""
        stretch = np.append(step[-len(self.lengths) :], 0.0)[self._parts]
        return self._last.push_columns(model.gather(step)) + stretch * self._rates

    def pull(self, forces: Array, model: QuadraticModel) -> Array:
        """Gradient of sum of weights (forces y) in the columns and log L."""
        assert isinstance(model, TimedModel)
        columns = self._last.pull(self.fraction(model.x.lengths) * forces, model.inner)
        slopes = self.bounds.weights * forces * self._rates
        of_parts = np.bincount(self._parts + 1, slopes, len(self.lengths) + 1)[1:]
        return model.in_unknowns(columns, of_parts.astype(np.float64))

    def accept(self, step: Array, model: QuadraticModel) -> None:
        """Use the outputs that the step predicts as weights of the next model's curvature."""
        assert isinstance(model, TimedModel)
        self._slopes = model.predicted_slopes(step)

    def hold(self, change: Array) -> None:
        """See Program.hold; other lengths take the multipliers over."""
        self.first.hold(change)

    def let_go(self) -> None:
        """See Program.let_go."""
        self.first.let_go()

    def residual(self, x: TimedPath) -> Array:
        """See Program.residual."""
        return self.at(x.lengths).residual(x.path)

    def satisfies_equations(self, x: TimedPath) -> bool:
        """Whether equations hold to their tolerances."""
        return self.at(x.lengths).satisfies_equations(x.path)

    def refine(self, x: TimedPath, level: float, forces: Array | None = None) -> Refinement | None:
        """Bound more of the motion: see BoundedAction."""
        at = self.at(x.lengths)
        return self._refined(x, at, at.refine(x.path, level, forces))

    def refine_at_once(self, x: TimedPath) -> Refinement | None:
        """See Program."""
        at = self.at(x.lengths)
        return self._refined(x, at, at.refine_at_once(x.path))

    def _refined(
        self, x: TimedPath, at: BoundedAction, found: Refinement | None
    ) -> Refinement | None:
        """What was found at some lengths, after the others take it over."""
        if found is not None:
            self.first = self._stretched(at, x.lengths, self.lengths)
            self._at.clear()
            self._update()
        return found

    def retract(self, x: TimedPath, step: Array, model: QuadraticModel) -> TimedPath:
        """The motion for the new lengths, then moved by the step in the columns."""
        return moved_in_time(self.action, self.price, x, step, model)

    def _stretched(self, action: BoundedAction, now: Array, lengths: Array) -> BoundedAction:
        """The same bounded action for other lengths, in [s]. now: its own."""
        return action.stretched(stretched_problem(action.problem, self.price.clock, now, lengths))
