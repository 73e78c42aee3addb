"""The discrete action under limits, with distances that stay at least as large as they must."""

from __future__ import annotations

from collections.abc import Callable
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.discrete.contraction import Expansion
from hovi.discrete.grid import DiscretePath
from hovi.optimize.barrier import Bounds
from hovi.optimize.ended import Outputs
from hovi.optimize.program import Refinement
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.planning.clearance.clearance import DISTANCE_SCALE
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import LinearAlgebra
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.condition_outputs import ConditionOutputs
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.planning.solver.multipliers import Multipliers
from hovi.planning.solver.near.clearance_rows import ClearanceRows
from hovi.planning.solver.near.expanded_rows import ExpandedRows
from hovi.planning.solver.near.recent_paths import RecentPaths
from hovi.scene.lagrangian import PointTerms

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

AHEAD = 0.5
"""Distance up to which pairs count as near, over DISTANCE_SCALE, per barrier parameter."""
DEEPEST = 0.005
"""Depth of a pair beyond which a step that takes it deeper is refused, in [m]."""


class ClearedAction(BoundedAction):
    """The action with limits, and with rows of distances, extended where pairs come near.

    Outputs are those at the points, then rows of limits and of distances in the order in which
    they were added: `near.order` has their numbers, those of limits first.

    near: rows of distances, extended in place. Other arguments as for BoundedAction.
    """

    radii = 50.0, 50.0
    """First radius of the trust region, in a cold start and in a warm one: the neighborhood of
    obstacles is not convex."""

    def __init__(
        self,
        problem: TrajectoryProblem,
        limits: Limits,
        margins: Array | None,
        algebra: LinearAlgebra | None,
        multipliers: Multipliers | None,
        more: ConditionOutputs | None,
        rows: LimitRows,
        near: ClearanceRows,
    ) -> None:
        self.near = near
        near.stand_behind(rows)
        self._limit_outputs = RecentPaths[Array]()
        super().__init__(problem, limits, margins, algebra, multipliers, more, rows)
        self._near: ExpandedRows | None = None
        self._deepest = np.inf

    def _with_rows(self) -> None:
        super()._with_rows()
        bounds, near = self.bounds, self.near
        self.reopens = near.size > 0
        if near.size == 0:
            return
        lower, upper, weights = (
            self.ordered(np.append(base, more))
            for base, more in (
                (bounds.lower, np.zeros(near.size)),
                (bounds.upper, np.full(near.size, np.inf)),
                (bounds.weights, near.weights),
            )
        )
        self.bounds = Bounds(lower, upper, weights, bounds.measure)

    def outputs(self, x: DiscretePath) -> Outputs:
        """See BoundedAction.outputs."""
        base = super().outputs(x)
        if not self.near.watched:
            return base
        value = np.inf if self.near.depth(x) > self._deepest else base.value
        return Outputs(value, self.ordered(np.append(base.y, self.near.values(x))))

    def _bounded_outputs(self, x: DiscretePath, outputs: list[Array]) -> Array:
        """Those without distances, which are kept for the last paths."""
        known = self._limit_outputs.get(x)
        if known is None:
            known = super()._bounded_outputs(x, outputs)
            self._limit_outputs = self._limit_outputs.with_entry(x, known)
        return known

    def model(
        self, x: DiscretePath, sigma: Array, rho: Array, multipliers: Array
    ) -> QuadraticModel:
        """See BoundedAction.model."""
        sigma, rho, multipliers = (self.plain(each) for each in (sigma, rho, multipliers))
        force = self.near.weights * multipliers[self._limit_count :]
        self._near = None
        if self.near.size > 0:
            self._near = self.near.expanded(x, force, self.action.coordinates)
        if self.near.watched:
            self._deepest = max(DEEPEST, self.near.depth(x))
        return super().model(x, sigma, rho, multipliers)

    @property
    def may_be_concave(self) -> bool:
        """See Program."""
        return self.near.size > 0

    def model_without_concavity(self, x: DiscretePath) -> QuadraticModel | None:
        """See Program: with the positive part of the rows' curvature."""
        near = self._near
        other = None if near is None else near.without_negative_curvature()
        if near is None or other is None:
            return None
        other.add_curvature(other.curvature - near.curvature, self.action.expansion.hessian)
        self._near = other
        return self._under_equations(x, self.action.model_of_expansion())

    def _row_terms(self, sigma: Array, rho: Array) -> Callable[[Expansion], None] | None:
        """What adds the terms of all rows to an expansion."""
        first = self._limit_count
        limits, near, weights = super()._row_terms(sigma, rho), self._near, self.near.weights
        if near is None:
            return limits
        slopes, curves = weights * rho[first:], weights * sigma[first:]

        def add(expansion: Expansion) -> None:
            if limits is not None:
                limits(expansion)
            near.pull(slopes, expansion.gradient)
            near.add_squares(slopes, curves, expansion.hessian)

        return add

    def push_columns(self, columns: Array) -> Array:
        """See BoundedAction.push_columns."""
        dy = super().push_columns(columns)
        if self._near is None:
            return dy
        return self.ordered(np.append(dy, self._near.push(columns)))

    def pull(self, forces: Array, model: QuadraticModel) -> Array:
        """See BoundedAction.pull."""
        forces = self.plain(forces)
        pulled = super().pull(forces, model)
        if self._near is None:
            return pulled
        local = np.zeros_like(model.intervals.gradient)
        self._near.pull(self.near.weights * forces[self._limit_count :], local)
        return pulled + model.scatter(local)

    def forces(self, x: DiscretePath, multipliers: Array) -> list[PointTerms]:
        """See BoundedAction.forces: without those of rows."""
        return super().forces(x, self.plain(multipliers))

    def refine(
        self, x: DiscretePath, level: float, forces: Array | None = None
    ) -> Refinement | None:
        """Bound more control points, and distances where pairs come near: see ClearanceRows."""
        assert self.rows is not None
        tighter = self._tightened(x, level)  # may run out of time, and rows are as they were then
        order, before = self.near.order, self.rows.size
        known = None if forces is None else self.plain(forces)[self.row_outputs]
        found = self.rows.refine(x, level, known)
        if found is not None:  # before anything that may run out of time
            self._limit_outputs = RecentPaths()
        sharper = self.near.sharpen(x)
        added = self.near.extend(self.problem, x, AHEAD * level * DISTANCE_SCALE)
        self.blocked = self.near.blocked
        if found is None and added == 0 and not (sharper or tighter):
            return None
        kept, origin = np.arange(before), np.zeros(0, dtype=np.intp)
        if found is not None:
            kept, origin = found.kept, found.origin
        return self._renumbered(order, before, kept, origin, added)

    def refine_at_once(self, x: DiscretePath) -> Refinement | None:
        """Bound the distances of pairs that have come near in a step, and round shapes less."""
        assert self.rows is not None
        if not self.near.watched:
            return None
        order, before = self.near.order, self.rows.size
        sharper, added = self.near.sharpen(x), self.near.follow(x)
        if added == 0 and not sharper:
            return None
        none = np.zeros(0, dtype=np.intp)
        return self._renumbered(order, before, np.arange(before), none, added)

    def with_fixed_rows(self) -> Self:
        """See BoundedAction.with_fixed_rows."""
        other = super().with_fixed_rows()
        other.near = self.near.copied(fixed=True).on(self.problem, other.rows)
        other._limit_outputs = RecentPaths()
        return other

    def stretched(self, problem: TrajectoryProblem) -> Self:
        """See BoundedAction.stretched: rows of distances stay where they are on their intervals."""
        other = super().stretched(problem)
        other.near, other._near = self.near.on(problem, other.rows), None
        other._limit_outputs = RecentPaths()
        return other

    @property
    def output_intervals(self) -> Index:
        """See BoundedAction.output_intervals."""
        first, limits = self._point_count, super().output_intervals
        rows = np.append(limits[first:], self.near.intervals)
        return np.append(limits[:first], rows[self.near.order] if self.near.size > 0 else rows)

    def _renumbered(
        self, order: Index, before: int, kept: Index, origin: Index, added: int
    ) -> Refinement:
        """The refinement in the order of the outputs, and the order after it.

        order: before it. before: number of rows of limits then, of which some were kept. origin: of
        new ones. added: number of new rows of distances, which come last.
        """
        first, size = self._point_count, self.rows.size if self.rows is not None else 0
        places = np.full(len(order), -1)  # of former rows among the present ones
        places[kept] = np.arange(len(kept))
        places[before:] = size + np.arange(len(order) - before)
        slots = np.empty(len(order), dtype=np.intp)  # of rows among the outputs
        slots[order] = np.arange(len(order))
        remaining = np.flatnonzero(places[order] >= 0)
        fresh = np.arange(len(kept), size)
        last = size + len(order) - before + np.arange(added)
        self.near.order = np.concatenate([places[order][remaining], fresh, last])
        self._with_rows()
        origins = np.where(origin < 0, -1, first + slots[origin])
        remained = np.append(np.arange(first), first + remaining)
        return Refinement(remained, np.append(origins, np.full(added, -1)))

    @property
    def _limit_count(self) -> int:
        """The number of outputs that are no distances."""
        return int(self.row_outputs.stop)

    def ordered(self, plain: Array) -> Array:
        """See BoundedAction.ordered."""
        first = self._point_count
        if self.near.size == 0:
            return plain
        return np.append(plain[:first], plain[first:][self.near.order])

    def plain(self, ordered: Array) -> Array:
        """See BoundedAction.plain."""
        if self.near.size == 0:  # rows of limits alone are in their order
            return ordered
        first, plain = self._point_count, np.empty_like(ordered)
        plain[:first] = ordered[:first]
        plain[first:][self.near.order] = ordered[first:]
        return plain
