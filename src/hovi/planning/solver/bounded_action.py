"""The discrete action under limits, as an objective of the interior point."""

from __future__ import annotations

import dataclasses
import itertools
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.errors import InputError
from hovi.optimize.barrier import Bounds
from hovi.optimize.interior_point import BoundedObjective, Outputs
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.planning.problem.limits import Limits, limited_columns
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective, LinearAlgebra
from hovi.planning.solver.clearance_outputs import PointOutputs
from hovi.planning.solver.multipliers import Multipliers
from hovi.scene.lagrangian import PointTerms

Array = npt.NDArray[np.float64]


class BoundedAction(BoundedObjective[DiscretePath]):
    """The discrete action, with (q, v, a, tau), or more, bounded at the quadrature points.

    Further outputs y(q) >= 0, such as distances to obstacles, follow in the last columns.

    problem: the trajectory problem.
    limits: the bounds.
    margins: share of its range by which each lower and upper bound is tightened in each interval,
        shape (2, N, kinds nv + more); none if None.
    algebra, multipliers: as for ActionObjective.
    more: further outputs.
    """

    def __init__(
        self,
        problem: TrajectoryProblem,
        limits: Limits,
        margins: Array | None = None,
        algebra: LinearAlgebra | None = None,
        multipliers: Multipliers | None = None,
        more: PointOutputs | None = None,
    ) -> None:
        self.problem = problem
        self.limits = limits
        self.action = ActionObjective(problem, algebra, problem.structure, multipliers)
        self.ld = self.action.ld
        self.lagrangian = self.action.lagrangian
        self._jet_size = (self.lagrangian.order + 1) * self.lagrangian.nv
        self._size = self._jet_size + len(self.lagrangian.output_weight)
        self._bounded = np.flatnonzero(limits.bounded.ravel())
        columns = limited_columns(self.lagrangian.order, self.lagrangian.nv)
        self.columns = columns[self._bounded]
        if self.columns.max(initial=0) >= self._size:
            needed = "tau need a Lagrangian whose outputs are torques"
            if limits.on_torque_rate:
                needed = "the torque rate need a Lagrangian of one scene with a cost on the jerk"
            raise InputError(f"limits on {needed}; leave them out.")
        self.more = more
        self.bounds = self._bounds(margins)
        self._predicted: list[Array] | None = None
        self._linear: list[Array] = []
        self._rho = np.zeros(0)
        self._jacobian = np.zeros((0, 0, 0))

    def outputs(self, x: DiscretePath) -> Outputs:
        """The discrete action, and the bounded outputs relative to their ranges."""
        outputs = self.action.outputs(x)
        pairs = zip(self.action.jets(x), outputs, strict=True)
        space = self.lagrangian.space
        rows = [
            np.concatenate([q if space is None else space.coordinates(q), *rates, tau], axis=1)
            for (q, *rates), tau in pairs
        ]
        y = self._scaled(np.concatenate(rows))
        if self.more is not None:
            y = np.concatenate([y, self.more.values(self._configurations(x))], axis=1)
        return Outputs(self.action.value_of(x, outputs), y)

    def model(
        self, x: DiscretePath, sigma: Array, rho: Array, multipliers: Array
    ) -> QuadraticModel:
        """The model of the action with the terms of the bounds: see BoundedObjective.model."""
        self._rho = rho
        gradient = self._unscaled(rho, 1)
        weight = self._unscaled(sigma, 2)
        force = self._unscaled(multipliers, 1)
        terms, curvatures = [], []
        k = self._jet_size  # (q, v, a, ...) first, then tau
        for i, part in enumerate(self._parts):
            slope, curve = gradient[part], weight[part]
            terms.append(PointTerms(slope[:, :k], curve[:, :k], slope[:, k:], curve[:, k:]))
            curvatures.append(self._slope(x, i) + force[part, k:])
        if self.more is not None:
            terms = self._with_more(x, terms, sigma, rho, multipliers)
        return self.action.model_with(x, curvatures, terms)

    def forces(self, x: DiscretePath, multipliers: Array) -> list[PointTerms]:
        """The multipliers of bounds and constraints as terms in (q, v, a, tau) at the points.

        multipliers: of the outputs, shape (P, K).
        """
        force = self._unscaled(multipliers, 1)
        k = self._jet_size
        zero = np.zeros_like(force)
        terms = [
            PointTerms(force[p, :k], zero[p, :k], force[p, k:], zero[p, k:]) for p in self._parts
        ]
        if self.more is not None:
            terms = self._with_more(x, terms, np.zeros_like(multipliers), multipliers, multipliers)
        known = self.action.multipliers
        return terms if known is None else known.added_to(terms)

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
        first, nv = len(self.columns), self.lagrangian.nv
        J, curve = self.more.expand(self._configurations(x), multipliers[:, first:])
        self._jacobian = J
        slope = np.matmul(rho[:, None, first:], J)[:, 0]  # (P, nv)
        curve = curve + np.matmul(J.transpose(0, 2, 1), sigma[:, first:, None] * J)
        for term, part in zip(terms, self._parts, strict=True):
            term.jet_gradient[:, :nv] += slope[part]
        return [
            dataclasses.replace(term, configuration_weight=curve[part])
            for term, part in zip(terms, self._parts, strict=True)
        ]

    def linear_outputs(self, step: Array, model: QuadraticModel) -> tuple[float, Array]:
        """First-order change of the action and of the bounded outputs."""
        expansion = self.action.expansion
        changes = self.ld.point_steps(model.gather(step), self.action.coordinates, expansion)
        rows = []
        self._linear = []
        for dx, (_tau, J) in zip(changes, expansion.outputs, strict=True):
            dtau = np.matmul(J, dx[:, :, None])[:, :, 0]
            self._linear.append(dtau)
            rows.append(np.concatenate([dx, dtau], axis=1))
        changed = np.concatenate(rows)
        dy = changed[:, self.columns] / self._ranges
        if self.more is not None:
            dq = changed[:, : self.lagrangian.nv, None]
            dy = np.concatenate([dy, np.matmul(self._jacobian, dq)[:, :, 0]], axis=1)
        slope = float(np.vdot(model.gradient, step))
        return slope - float(np.sum(self.bounds.weights * self._rho * dy)), dy

    def apply_fraction(self, fraction: float) -> None:
        """Use the torques that the step predicts as weights of the next model's curvature."""
        pairs = zip(self.action.expansion.outputs, self._linear, strict=True)
        self._predicted = [
            self.action.output_slope(tau + fraction * dtau, i)
            for i, ((tau, _), dtau) in enumerate(pairs)
        ]

    def retract(self, x: DiscretePath, step: Array, model: QuadraticModel) -> DiscretePath:
        """The path moved by a step."""
        return self.action.retract(x, step, model)

    def _configurations(self, x: DiscretePath) -> Array:
        """q at all quadrature points, (P, nq)."""
        return np.concatenate([jet[0] for jet in self.action.jets(x)])

    def _slope(self, x: DiscretePath, batch: int) -> Array:
        """R y as predicted, or at x before the first step."""
        if self._predicted is not None:
            return self._predicted[batch]
        jet, t = self.action.jets(x)[batch], self.ld.point_times[batch]
        outputs = self.ld.lagrangians[batch].output(*jet, t=t)
        return self.action.output_slope(outputs, batch)

    @cached_property
    def _ranges(self) -> Array:
        return np.asarray(self.limits.ranges.ravel()[self._bounded])

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
        return (rows[:, self.columns] - self._origin) / self._ranges

    def _unscaled(self, y: Array, power: int) -> Array:
        """Derivatives in scaled outputs as derivatives in (q, ..., q^(k), outputs), (P, size)."""
        full = np.zeros((len(y), self._size))
        full[:, self.columns] = y[:, : len(self.columns)] / self._ranges**power
        return full

    def _bounds(self, margins: Array | None) -> Bounds:
        size = 0 if self.more is None else self.more.size
        intervals = np.concatenate(self.ld.point_intervals)
        weights = np.concatenate(self.ld.point_weights)[:, None]
        lower, upper = (self._rows_of(bound) for bound in self.limits.on(self.problem.grid.t))
        lower = np.pad(lower, ((0, 0), (0, size)))
        upper = np.pad(upper, ((0, 0), (0, size)), constant_values=np.inf)
        if len(lower) > 1:  # they differ between segments
            lower, upper = lower[intervals], upper[intervals]
        shape = (len(intervals), lower.shape[1])
        if margins is None:
            return Bounds(np.broadcast_to(lower, shape), np.broadcast_to(upper, shape), weights)
        tightening = margins.reshape(2, len(margins[0]), -1)
        first = self.limits.lower.size
        chosen = np.append(self._bounded, np.arange(first, first + size))
        tightening = tightening[:, :, chosen][:, intervals]
        return Bounds(lower + tightening[0], upper - tightening[1], weights)

    def _rows_of(self, bound: Array) -> Array:
        """Bounds (N or 1, kinds, nv) in scaled outputs, shape (N or 1, K)."""
        return (bound.reshape(len(bound), -1)[:, self._bounded] - self._origin) / self._ranges
