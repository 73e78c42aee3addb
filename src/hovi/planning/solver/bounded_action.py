"""The discrete action under limits, as an objective of the interior point."""

from __future__ import annotations

import copy
import dataclasses
import itertools
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native
from hovi.conditions.function import Points
from hovi.discrete.contraction import Expansion
from hovi.discrete.discrete_lagrangian import Batch
from hovi.discrete.grid import DiscretePath
from hovi.errors import InputError
from hovi.optimize.banded_model import BandModel
from hovi.optimize.barrier import MOST_MARGIN, Bounds
from hovi.optimize.ended import Outputs
from hovi.optimize.equation_model import EquationModel
from hovi.optimize.program import Program, Refinement
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.quadratic_program import QuadraticProgram
from hovi.planning.problem.limits import Limits, limited_columns
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective, LinearAlgebra
from hovi.planning.solver.between_points import MarginsBetweenPoints
from hovi.planning.solver.condition_outputs import ConditionOutputs
from hovi.planning.solver.limits.limit_rows import LimitRows, push_rows
from hovi.planning.solver.missed_equations import within
from hovi.planning.solver.multipliers import Multipliers
from hovi.scene.lagrangian import PointTerms, over_time

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


class BoundedAction(Program[DiscretePath]):
    """The discrete action, with (q, v, a, tau), or more, bounded at the quadrature points.

    What `rows` bound is bounded at all times instead. Further outputs of the motion, such as
    distances to obstacles and the values of conditions, follow in the last columns.

    problem: the trajectory problem.
    limits: the bounds.
    margins: fraction of its range by which each lower and upper bound is tightened in each
        interval, shape (2, N, kinds nv + more); none if None.
    algebra, multipliers: as for ActionObjective.
    more: further outputs.
    rows: control points, bounded instead of values at the points and refined in place; or None.
    penalty: of |c|^2 / 2 of equations in the value, instead of steps that satisfy them.
    tolerances: where steps satisfy equations and their multipliers follow, those of passive
        torques, relative to the largest torque, and of conditions, in the unit of y; None where the
        multipliers stay.
    """

    tolerances: tuple[float, float] | None = None
    penalty: float = 0.0
    between: MarginsBetweenPoints | None = None
    """Margins that follow the motion from step to step; None if they stay."""

    def __init__(
        self,
        problem: TrajectoryProblem,
        limits: Limits,
        margins: Array | None = None,
        algebra: LinearAlgebra | None = None,
        multipliers: Multipliers | None = None,
        more: ConditionOutputs | None = None,
        rows: LimitRows | None = None,
    ) -> None:
        self.problem = problem
        self.limits = limits
        self.action = ActionObjective(problem, algebra, problem.structure, multipliers)
        self.ld = self.action.ld
        self.lagrangian = self.action.lagrangian
        self._jet_size = (self.lagrangian.order + 1) * self.lagrangian.nv
        self._size = self._jet_size + len(self.lagrangian.output_weight)
        bounded = limits.bounded if rows is None else rows.of.others(limits)
        self._bounded = np.flatnonzero(bounded.ravel())
        columns = limited_columns(self.lagrangian.order, self.lagrangian.nv)
        self.columns = columns[self._bounded]
        if self.columns.max(initial=0) >= self._size:
            needed = "tau need a Lagrangian whose outputs are torques"
            if limits.on_torque_rate:
                needed = "the torque rate need a Lagrangian of one scene with a cost on the jerk"
            raise InputError(f"limits on {needed}; leave them out.")
        self.more = more
        self.rows = rows
        self._row_columns = np.zeros((0, self.ld.columns))
        self._at_points = self._point_bounds(margins)
        self._with_rows()
        self._predicted: list[Array] | None = None
        self._jacobian = np.zeros((0, 0, 0))
        self._torque_weights = np.zeros((0, 0))
        self._before_hold = multipliers

    def _with_rows(self) -> None:
        """The bounds of the outputs at the points, then those of the rows."""
        lower, upper, weights = (part.ravel() for part in self._at_points)
        rows, self._row_weights = self.rows, np.zeros(0)
        if rows is not None and rows.size > 0:
            low, high = rows.bounds
            lower, upper = np.append(lower, low), np.append(upper, high)
            self._row_weights = rows.weights
            weights = np.append(weights, self._row_weights)
            self._row_columns = rows.columns(self.action.coordinates)
        self.bounds = Bounds(lower, upper, weights, self.problem.grid.duration)

    def motion(self, x: DiscretePath) -> tuple[TrajectoryProblem, DiscretePath]:
        """The problem and the motion at a point."""
        return self.problem, x

    def outputs(self, x: DiscretePath) -> Outputs:
        """The discrete action, and the bounded outputs relative to their ranges."""
        outputs = self.action.outputs(x)
        value = self.action.value_of(x, outputs)
        if self.penalty > 0.0:
            c = self.residual(x)
            value += 0.5 * self.penalty * float(c @ c)
        return Outputs(value, self._bounded_outputs(x, outputs))

    def _bounded_outputs(self, x: DiscretePath, outputs: list[Array]) -> Array:
        """Those at the points, then those of the rows, (R,), from the Lagrangian's outputs."""
        first = self._jet_size
        if self.columns.min(initial=first) >= first:  # such as torques, while rows bound q, v and a
            every = outputs[0] if len(outputs) == 1 else np.concatenate(outputs)
            y = (every[:, self.columns - first] - self._origin) * self._inverse_ranges
        else:
            y = self._scaled(self._at_all_points(x, outputs))
        if self.more is not None:
            y = np.concatenate([y, self.more.values(self._motion_at_points(x, outputs))], axis=1)
        return y.ravel() if self.rows is None else np.append(y, self.rows.values(x))

    def _at_all_points(self, x: DiscretePath, outputs: list[Array]) -> Array:
        """(q, v, ..., outputs) at all points, shape (P, size)."""
        space = self.lagrangian.space
        rows = [
            np.concatenate([q if space is None else space.coordinates(q), *rates, tau], axis=1)
            for (q, *rates), tau in zip(self.action.jets(x), outputs, strict=True)
        ]
        return np.concatenate(rows)

    def model(
        self, x: DiscretePath, sigma: Array, rho: Array, multipliers: Array
    ) -> QuadraticModel:
        """The model of the action with the terms of the bounds: see Program.model."""
        if self.penalty == 0.0:
            return self._model(x, sigma, rho, multipliers)
        self.hold(self.penalty * self.residual(x))
        try:
            return self._model(x, sigma, rho, multipliers)
        finally:
            self.let_go()

    def _model(
        self, x: DiscretePath, sigma: Array, rho: Array, multipliers: Array
    ) -> QuadraticModel:
        points = (self.at_points(part) for part in (sigma, rho, multipliers))
        sigma_at, rho_at, multipliers_at = points
        gradient = self._unscaled(rho_at, 1)
        weight = self._unscaled(sigma_at, 2)
        force = self._unscaled(multipliers_at, 1)
        terms, curvatures = [], []
        k = self._jet_size  # (q, v, a, ...) first, then tau
        for i, part in enumerate(self._parts):
            slope, curve = gradient[part], weight[part]
            terms.append(PointTerms(slope[:, :k], curve[:, :k], slope[:, k:], curve[:, k:]))
            curvatures.append(self._slope(x, i) + force[part, k:])
        if self.more is not None:
            terms = self._with_more(x, terms, sigma_at, rho_at, multipliers_at)
            curvatures = self._with_torque_weights(curvatures)
        model = self.action.model_with(x, curvatures, terms, self._row_terms(sigma, rho))
        return self._under_equations(x, model)

    def _under_equations(self, x: DiscretePath, model: QuadraticModel) -> QuadraticModel:
        """The model, whose steps satisfy equations to first order, or with their penalty."""
        if not isinstance(model, BandModel):
            return model
        if self.penalty > 0.0:
            return self.action.with_penalty(x, model, self.penalty)
        if self.tolerances is None:
            return model
        return self.action.under_equations(x, model)

    def _row_terms(self, sigma: Array, rho: Array) -> Callable[[Expansion], None] | None:
        """What adds the terms of the rows to an expansion; None without rows."""
        rows, J = self.rows, self._row_columns
        if rows is None or rows.size == 0:
            return None
        here = self.row_outputs
        slopes, curves = (self._row_weights * each[here] for each in (rho, sigma))

        def add(expansion: Expansion) -> None:
            native.pull_rows(rows.intervals, rows.joints, J, slopes, expansion.gradient)
            native.add_squares(rows.intervals, rows.joints, J, curves, expansion.hessian)

        return add

    def forces(self, x: DiscretePath, multipliers: Array) -> list[PointTerms]:
        """The multipliers of bounds and constraints as terms in (q, v, a, tau) at the points.

        multipliers: of the outputs, shape (R,).
        """
        at_points = self.at_points(multipliers)
        force = self._unscaled(at_points, 1)
        k = self._jet_size
        zero = np.zeros_like(force)
        terms = [
            PointTerms(force[p, :k], zero[p, :k], force[p, k:], zero[p, k:]) for p in self._parts
        ]
        if self.more is not None:
            terms = self._with_more(x, terms, np.zeros_like(at_points), at_points, at_points)
            if self._timed:
                rates = self._rates_in_time(x, at_points[:, len(self.columns) :])
                parts = zip(terms, self._parts, strict=True)
                terms = [dataclasses.replace(t, time_gradient=rates[p]) for t, p in parts]
        known = self.action.multipliers
        if known is not None:
            terms = known.added_to(terms)
            self.action.equations.add_forces(terms, known.conditions, self.action.jets(x))
        return terms

    def prices(self, multipliers: Array) -> Array:
        """|d cost| / d(lower, upper) per range of what is bounded, (2, kinds), not negative.

        By the envelope theorem sum w |z|, of the values at the points, then of the coordinates of
        control points, then of all distances, in their unit. multipliers: of the outputs, (R,).
        """
        forces = self.plain(self.bounds.weights * multipliers)
        values = self._point_count // self._points
        kinds, most = np.tile(np.arange(values), self._points), values
        if self.rows is not None:
            kinds = np.append(kinds, values + self.rows.coordinate)
            most += len(self.rows.of.order)
        kinds = np.append(kinds, np.full(len(forces) - len(kinds), most))
        sides = np.maximum(-forces, 0.0), np.maximum(forces, 0.0)
        return np.stack([np.bincount(kinds, each, most + 1) for each in sides])

    @property
    def _timed(self) -> bool:
        """Whether further outputs or their bounds depend on time itself, or may."""
        distances = self.problem.distances
        moving = distances is not None and bool(distances.paths)
        return moving or self.lagrangian.timed or any(each.timed for each in self.problem.bounds)

    def _rates_in_time(self, x: DiscretePath, force: Array) -> Array:
        """sum force d(y - bound)/dt of the further outputs at a fixed jet, (P,); force: (P, K)."""
        more, times = self.more, np.concatenate(self.ld.point_times)
        assert more is not None

        def beyond(t: Array) -> Array:
            jets = zip(self.ld.lagrangians, self.action.jets(x), self._parts, strict=True)
            at = self._motion_at_points(x, [L.output(*jet, t=t[part]) for L, jet, part in jets])
            low, high = more.bounds(t)
            above = np.isfinite(high) & ((force > 0) | ~np.isfinite(low))
            held = np.where(above, high, np.where(np.isfinite(low), low, 0.0))
            return more.values(dataclasses.replace(at, t=t)) - held

        return np.asarray(np.vecdot(force, over_time(beyond, times)))

    def _with_more(
        self,
        x: DiscretePath,
        terms: list[PointTerms],
        sigma: Array,
        rho: Array,
        multipliers: Array,
    ) -> list[PointTerms]:
        """The terms with those of the further outputs added."""
        assert self.more is not None
        first, at = len(self.columns), self._motion_at_points(x, self.action.outputs(x))
        J, curve, self._torque_weights = self.more.expand(at, multipliers[:, first:])
        self._jacobian, m = J, J.shape[2]
        slope = np.matmul(rho[:, None, first:], J)[:, 0]  # (P, m)
        curve = curve + np.matmul(J.transpose(0, 2, 1), sigma[:, first:, None] * J)
        for term, part in zip(terms, self._parts, strict=True):
            term.jet_gradient[:, :m] += slope[part]
        return [
            dataclasses.replace(term, leading_weight=curve[part])
            for term, part in zip(terms, self._parts, strict=True)
        ]

    def _with_torque_weights(self, curvatures: list[Array]) -> list[Array]:
        """The weights of the outputs' curvature with those of torques in the further outputs."""
        more = self._torque_weights
        others = self._size - self._jet_size - more.shape[1]  # such as torque rates
        padded = np.pad(more, ((0, 0), (0, others)))
        return [each + padded[part] for each, part in zip(curvatures, self._parts, strict=True)]

    def quadratic(
        self,
        x: DiscretePath,
        forces: Array,
        sigma: Array | None = None,
        rho: Array | None = None,
    ) -> QuadraticProgram:
        """See Program.quadratic; for grids whose model is a band."""
        self.predict([])
        none = np.zeros_like(forces)
        model = self.model(
            x, none if sigma is None else sigma, none if rho is None else rho, forces
        )
        if not isinstance(model, BandModel | EquationModel):
            raise InputError(
                "a quadratic program needs a grid of at most 1,000 intervals; use fewer."
            )
        rows = self.output_intervals, self.output_slopes(model.intervals.gradient.shape)
        return QuadraticProgram.of(model, self.bounds, self.outputs(x).y, rows)

    def output_slopes(self, shape: tuple[int, ...]) -> Array:
        """Slopes of the outputs in the columns of their intervals, (R, m, n).

        shape: (N, m, n), of the columns of all intervals.
        """
        slopes = np.zeros((len(self.bounds.lower), *shape[1:]))
        for c, i in np.ndindex(*shape[1:]):
            one = np.zeros(shape)
            one[:, c, i] = 1.0
            slopes[:, c, i] = self.push_columns(one)
        return slopes

    def push(self, step: Array, model: QuadraticModel) -> Array:
        """First-order change of the bounded outputs, shape (R,)."""
        return self.push_columns(model.gather(step))

    def push_columns(self, columns: Array) -> Array:
        """The same for a step in the columns of the intervals, (N, m, n)."""
        expansion = self.action.expansion
        if self.more is None and expansion.charts is None:
            return self._push_compiled(columns)
        dy = self.push_jets(self.ld.point_steps(columns, self.action.coordinates, expansion))
        if self.rows is None or self.rows.size == 0:
            return dy
        return np.append(dy, push_rows(self.rows, self._row_columns, columns))

    def push_jets(self, changes: list[Array]) -> Array:
        """That of the outputs at the points, flat, for a change of the jets there.

        changes: shape (P, (k + 1) nv) per batch.
        """
        parts = []
        for dx, (_tau, J) in zip(changes, self.action.expansion.outputs, strict=True):
            dtau = np.matmul(J, dx[:, :, None])[:, :, 0]
            parts.append(np.concatenate([dx, dtau], axis=1))
        changed = np.concatenate(parts)
        dy = changed[:, self.columns] * self._inverse_ranges
        if self.more is not None:
            dx = changed[:, : self._jacobian.shape[2], None]
            dy = np.concatenate([dy, np.matmul(self._jacobian, dx)[:, :, 0]], axis=1)
        return np.asarray(dy.ravel())

    def _push_compiled(self, columns: Array) -> Array:
        """The change at the points, then of the rows, (R,), compiled."""
        rows, count = self.rows, self._point_count
        out = np.empty(count + (0 if rows is None else rows.size))
        at_points = out[:count].reshape(self._points, -1)
        for batch, part, (_, J) in self._batches:
            step = np.ascontiguousarray(columns[batch.index, : self.ld.k * 2 + batch.modes])
            native.push(
                *self._tables(batch), step, self.columns, self._inverse_ranges, J, at_points[part]
            )
        if rows is not None and rows.size > 0:
            native.push_rows(rows.intervals, rows.joints, self._row_columns, columns, out[count:])
        return out

    def pull(self, forces: Array, model: QuadraticModel) -> Array:
        """Gradient of sum of weights (forces y) in the unknowns."""
        at_points, expansion = self.at_points(forces), self.action.expansion
        local = np.zeros_like(model.intervals.gradient)
        for i, (batch, part, (_, J)) in enumerate(self._batches):
            here = np.ascontiguousarray(at_points[part])
            if self.more is None and expansion.charts is None:
                pulled = np.empty((len(batch.h), self.ld.k * 2 + batch.modes, self.lagrangian.nv))
                tables = self._tables(batch)
                native.pull(*tables, here, self.columns, self._inverse_ranges, J, pulled)
            else:
                gradient = self._point_gradient(here, J, part)
                if expansion.charts is not None:
                    pulled = expansion.charts[i].nodal_gradient(gradient)
                else:
                    pulled = batch.contracted(gradient, self.action.coordinates)
            if pulled.shape == local.shape:  # of all intervals
                local = pulled
                continue
            own = np.zeros_like(local[:, : pulled.shape[1]])
            batch.add(pulled, own)
            local[:, : pulled.shape[1]] += own
        rows = self.rows
        if rows is not None and rows.size > 0:
            weighted = self._row_weights * forces[self.row_outputs]
            native.pull_rows(rows.intervals, rows.joints, self._row_columns, weighted, local)
        return model.scatter(local)

    def _point_gradient(self, forces: Array, jacobian: Array, part: slice) -> Array:
        """sum forces dy / d(q, v, ...) at the points of a batch, (P, k + 1, nv)."""
        k, nv, m = self._jet_size, self.lagrangian.nv, self._jacobian.shape[2]
        slope = self._unscaled(forces, 1)
        gradient = slope[:, :k] + np.matmul(slope[:, None, k:], jacobian)[:, 0]
        if self.more is not None:
            further = forces[:, None, len(self.columns) :]
            gradient[:, :m] += np.matmul(further, self._jacobian[part])[:, 0]
        return np.asarray(gradient.reshape(len(gradient), -1, nv))

    def accept(self, step: Array, model: QuadraticModel) -> None:
        """Use the torques that the step predicts as weights of the next model's curvature."""
        self.predict(self.action.predicted_slopes(model.gather(step)))

    def predict(self, slopes: list[Array]) -> None:
        """Take R y of predicted outputs, per batch; those of the path if empty."""
        self._predicted = slopes or None

    def hold(self, change: Array) -> None:
        """See Program.hold."""
        self._before_hold = self.action.multipliers
        self.action.hold(change)

    def let_go(self) -> None:
        """See Program.let_go."""
        self.action.multipliers = self._before_hold

    def residual(self, x: DiscretePath) -> Array:
        """c of equations at x, shape (E,); none where their multipliers are not known."""
        return self.action.residual(x)

    def satisfies_equations(self, x: DiscretePath) -> bool:
        """Whether equations hold to their tolerances."""
        if self.tolerances is None:
            return True
        return within(self.action.residuals(x), *self.tolerances)

    def refine(
        self, x: DiscretePath, level: float, forces: Array | None = None
    ) -> Refinement | None:
        """Bound more control points of the motion: see LimitRows."""
        if self.rows is None:
            return None
        tighter = self._tightened(x, level)  # may run out of time, and rows are as they were then
        known = None if forces is None else self.plain(forces)[self.row_outputs]
        before, found = self.rows.size, self.rows.refine(x, level, known)
        if found is None and not tighter:
            return None
        none = np.zeros(0, dtype=np.intp)
        of_rows = found or Refinement(np.arange(before), none)
        self._with_rows()
        first = self._point_count
        kept = np.append(np.arange(first), first + of_rows.kept)
        return Refinement(kept, np.where(of_rows.origin < 0, -1, first + of_rows.origin))

    def tighten(self, x: DiscretePath, level: float) -> bool:
        """See Program: bounds at the points, for what the motion exceeds between them."""
        tighter = self._tightened(x, level)
        if tighter:
            self._with_rows()
        return tighter

    def _tightened(self, x: DiscretePath, level: float) -> bool:
        if self.between is None or self._point_count == 0:
            return False
        if not self.between.follow(self.problem, x, self._excess_at_points(x), level):
            return False
        self._at_points = self._point_bounds(self.between.values)
        return True

    def _excess_at_points(self, x: DiscretePath) -> Array:
        """The largest excess at the points of every interval, shaped as margins; -inf for none."""
        y = self.at_points(self._bounded_outputs(x, self.action.outputs(x)))
        lower, upper, _ = self._point_bounds(None)
        intervals, first = np.concatenate(self.ld.point_intervals), self.limits.lower.size
        found = np.full(
            (2, self.ld.grid.intervals, first + y.shape[1] - len(self.columns)), -np.inf
        )
        chosen = np.append(self._bounded, np.arange(first, found.shape[2]))
        for side, excess in enumerate((lower - y, y - upper)):
            of_chosen = np.full((len(found[0]), y.shape[1]), -np.inf)
            np.maximum.at(of_chosen, intervals, excess)
            found[side][:, chosen] = of_chosen
        return found

    def retract(self, x: DiscretePath, step: Array, model: QuadraticModel) -> DiscretePath:
        """The path moved by a step."""
        return self.action.retract(x, step, model)

    def with_fixed_rows(self) -> Self:
        """The same, to be solved on its own with rows that stay as they are."""
        other = copy.copy(self)
        other.action = copy.copy(self.action)
        other.rows = None if self.rows is None else self.rows.fixed_on(self.rows.grid)
        other.between = None
        return other

    def stretched(self, problem: TrajectoryProblem) -> Self:
        """The same bounded action for another duration of its problem, without a model yet.

        Bounds and the pattern of the Hessian stay; weights are proportional to the steps.
        """
        steps = problem.grid.steps / self.problem.grid.steps
        other = copy.copy(self)
        other.problem, own = problem, self.action
        other.action = ActionObjective(
            problem, own.algebra, multipliers=own.multipliers, keep_points=own.keep_points
        )
        other.ld, other.lagrangian = other.action.ld, other.action.lagrangian
        other.more = None if self.more is None else ConditionOutputs(problem)
        lower, upper, weights = self._at_points
        at_points = steps[np.concatenate(self.ld.point_intervals)]
        other._at_points = lower, upper, at_points[:, None] * weights
        other._predicted = None
        if self.rows is not None:
            other.rows = self.rows.stretched(problem.grid)
            other._row_weights = other.rows.weights
            other._row_columns = other.rows.columns(own.coordinates)
        weights, T = steps[self.output_intervals] * self.bounds.weights, problem.grid.duration
        other.bounds = dataclasses.replace(self.bounds, weights=weights, measure=T)
        return other

    @property
    def output_intervals(self) -> Index:
        """The interval of every output, shape (R,)."""
        at_points = np.concatenate(self.ld.point_intervals)
        rows = np.zeros(0, np.intp) if self.rows is None else self.rows.intervals
        return np.append(np.repeat(at_points, self._point_count // self._points), rows)

    def plain(self, ordered: Array) -> Array:
        """Values of outputs at the points, then of rows of limits, then of distances."""
        return ordered

    def ordered(self, plain: Array) -> Array:
        """Such values in the order of the outputs."""
        return plain

    @property
    def row_outputs(self) -> slice:
        """Where rows of limits are among plain outputs."""
        first = self._point_count
        return slice(first, first + (0 if self.rows is None else self.rows.size))

    def at_points(self, values: Array) -> Array:
        """Of values of all outputs, (R,), those at the points, (P, K)."""
        return values[: self._point_count].reshape(self._points, -1)

    @property
    def _points(self) -> int:
        """P, the number of points."""
        return len(self._at_points[0])

    @property
    def _point_count(self) -> int:
        """P K, the number of outputs at the points."""
        return int(self._at_points[0].size)

    @property
    def _batches(self) -> Iterator[tuple[Batch, slice, tuple[Array, Array]]]:
        """The batches, where their points are, and their outputs in the last expansion."""
        return zip(self.ld.batches, self._parts, self.action.expansion.outputs, strict=True)

    def _tables(self, batch: Batch) -> tuple[Array, Array, Array]:
        """Table, weights and steps of a batch, as compiled functions take them."""
        table = np.ascontiguousarray(batch.tables[self.action.coordinates])
        return table, batch.contraction_weights, np.ascontiguousarray(batch.h)

    def _motion_at_points(self, x: DiscretePath, outputs: list[Array]) -> Points:
        """The motion at all quadrature points; without torques where there are none."""
        q, v, a = (np.concatenate([jet[i] for jet in self.action.jets(x)]) for i in range(3))
        tau = np.ascontiguousarray(np.concatenate(outputs)[:, : self.lagrangian.nv])
        return Points(q, v, np.concatenate(self.ld.point_times), a, tau)

    def _slope(self, x: DiscretePath, batch: int) -> Array:
        """R y as predicted, or at x before the first step, plus the multipliers of torques."""
        if self._predicted is not None:
            known = self.action.multipliers
            slope = self._predicted[batch]
            return slope if known is None else slope + known.torque[batch]
        jet, t = self.action.jets(x)[batch], self.ld.point_times[batch]
        outputs = self.ld.lagrangians[batch].output(*jet, t=t)
        return self.action.output_slope(outputs, batch)

    @cached_property
    def _inverse_ranges(self) -> Array:
        return np.asarray(1.0 / self.limits.ranges.ravel()[self._bounded])

    @cached_property
    def _parts(self) -> list[slice]:
        """Slice of each batch in the array of all points."""
        ends = np.cumsum([0, *(len(weights) for weights in self.ld.point_weights)])
        return [slice(a, b) for a, b in itertools.pairwise(ends)]

    @cached_property
    def _origin(self) -> Array:
        """Origin of each scaled output: its lower bound, or its only one."""
        lower, upper = self.limits.lower.ravel(), self.limits.upper.ravel()
        return np.where(np.isfinite(lower), lower, upper)[self._bounded]

    def _scaled(self, rows: Array) -> Array:
        return (rows[:, self.columns] - self._origin) * self._inverse_ranges

    def _unscaled(self, y: Array, power: int) -> Array:
        """Derivatives in scaled outputs as derivatives in (q, ..., q^(k), outputs), (P, size)."""
        full = np.zeros((len(y), self._size))
        full[:, self.columns] = y[:, : len(self.columns)] * self._inverse_ranges**power
        return full

    def _point_bounds(self, margins: Array | None) -> tuple[Array, Array, Array]:
        """Lower and upper bounds and weights of the outputs at the points, (P, K) each."""
        size = 0 if self.more is None else self.more.size
        intervals = np.concatenate(self.ld.point_intervals)
        weights = np.concatenate(self.ld.point_weights)[:, None]
        lower, upper = (self._rows_of(bound) for bound in self.limits.on(self.problem.grid.t))
        if len(lower) > 1:  # they differ between segments
            lower, upper = lower[intervals], upper[intervals]
        if self.limits.excused:
            lower, upper = lower - self._wider(-1), upper + self._wider(1)
        shape = (len(intervals), lower.shape[1])
        lower, upper = (np.broadcast_to(x, shape) for x in (lower, upper))
        if self.more is not None:
            low, high = self.more.bounds(np.concatenate(self.ld.point_times))
            lower = np.concatenate([lower, low], axis=1)
            upper = np.concatenate([upper, high], axis=1)
        weights = np.broadcast_to(weights, lower.shape)
        if margins is None or not margins.any():
            return lower, upper, weights
        tightening = margins.reshape(2, len(margins[0]), -1)
        first = self.limits.lower.size
        chosen = np.append(self._bounded, np.arange(first, first + size))
        tightening = np.minimum(
            tightening[:, :, chosen][:, intervals], MOST_MARGIN * (upper - lower)
        )
        return lower + tightening[0], upper - tightening[1], weights

    def _wider(self, side: int) -> Array:
        """By how much bounds of a side are wider at the points, (P, K) without further outputs."""
        wider = self.limits.wider(side, np.concatenate(self.ld.point_times))
        return np.asarray(wider.reshape(len(wider), -1)[:, self._bounded] * self._inverse_ranges)

    def _rows_of(self, bound: Array) -> Array:
        """Bounds (N or 1, kinds, nv) in scaled outputs, shape (N or 1, K)."""
        chosen = bound.reshape(len(bound), -1)[:, self._bounded]
        return (chosen - self._origin) * self._inverse_ranges
