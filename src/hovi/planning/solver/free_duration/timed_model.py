"""The quadratic model of a discrete action plus the price of time, in the path and log L.

Where columns of what is kept change with L, the moments of equations along the motion do, too, by
G = A u for those columns u and the Jacobian A of the equations. Steps in log L alone take that back
by -E, the least step with A E = G, so that equations do not depend on log L.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from hovi.optimize.banded_model import BandModel
from hovi.optimize.bordered_model import Border, BorderedModel
from hovi.optimize.equation_model import EquationModel
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.planning.problem.time_price import TimePrice
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.free_duration.duration_border import (
    Forces,
    duration_border,
    stretch_of,
)
from hovi.planning.solver.free_duration.row_border import RowForces
from hovi.planning.solver.free_duration.timed_path import TimedPath, kept_columns, stretched_path

Array = npt.NDArray[np.float64]
ActionAt = Callable[[Array], ActionObjective]
"""The action for lengths of free parts, in [s]."""


class TimedModel(BorderedModel):
    """The bordered model at a motion.

    action: for its lengths, whose last model was `inner`. x: the motion.
    inner: the model in the path alone. price: of time. metric: entry of log L in the metric
    T^3 integral |da|^2, in which a motion of 1 rad between rests has the squared length 12.
    forces: of limits at the points, per batch; none if None. rows: of limits between them.
    parts: the part of every interval, -1 for none, (N,). kept: columns that change with log L of
    their part, to first order, (N, m, n). unknown: see `kept_columns`. stretches: the changes of
    the jets at the points, per batch. back: E, by which a step in log L moves the path back so that
    equations hold, (size, p).
    """

    def __init__(
        self,
        action: ActionObjective,
        x: TimedPath,
        inner: QuadraticModel,
        price: TimePrice,
        metric: float,
        forces: Sequence[Forces] | None = None,
        rows: RowForces | None = None,
    ) -> None:
        assert isinstance(inner, BandModel | EquationModel)
        self.action = action
        self.x = x
        self.expansion = action.expansion
        jets, problem = action.jets(x.path), action.problem
        self.parts = price.clock.parts(problem.grid, x.lengths)
        inside = self.parts >= 0
        self.stretches = [
            inside[intervals, None] * stretch_of(jet)
            for intervals, jet in zip(problem.ld.point_intervals, jets, strict=True)
        ]
        known = duration_border(problem.ld, self.expansion, jets, inside, forces)
        if rows is not None:
            known = rows.added_to(known)
        self.kept, self.unknown = kept_columns(problem, x.path, price.clock, x.lengths)
        if self.kept.any() or self.unknown.any():
            at_points = action.without_nodes(x.path)
            known = known.with_ends(at_points, self.kept, self.unknown, problem.ld.k)
        cost, own = price.weight * x.lengths, np.arange(len(x.lengths)) == self.parts[:, None]
        parts = own.T[:, :, None, None]
        columns = np.stack([inner.scatter(known.column * of) for of in parts], axis=1)
        slope, corner = known.slope @ own + cost, np.diag(known.corner @ own + cost)
        self.back = self._back_of(inner, parts)
        if self.back.any():
            bent = np.stack([hessian_product(inner, step) for step in self.back.T], axis=1)
            slope = slope - self.back.T @ inner.gradient
            corner = corner - columns.T @ self.back - self.back.T @ (columns - bent)
            columns = columns - bent
        super().__init__(inner, Border(slope, columns, corner, metric, price.room(x.lengths)))

    def _back_of(self, inner: BandModel | EquationModel, parts: Array) -> Array:
        """`back`, from which intervals belong to each part, (p, N, 1, 1)."""
        back = np.zeros((len(inner.gradient), len(parts)))
        equations = self.action.equations
        if not isinstance(inner, EquationModel) or not self.kept.any() or not equations.along:
            return back
        kkt = inner.kkt
        at_nodes = sum(each.size for each in equations.at_nodes)  # do not change with L
        factor, force = kkt.normal_factor(kkt.curvature_scale), np.zeros(len(back))
        for part, of in enumerate(parts):
            change = kkt.pushed_columns(self.kept * of)
            change[len(change) - at_nodes :] = 0.0
            back[:, part] = factor.solve(force, change)[0]
        return back

    def gather(self, s: Array) -> Array:
        """The columns of every interval in the other unknowns, moved back: see the module."""
        return self.inner.gather(s[: self.size] - self.back @ s[self.size :])

    def in_unknowns(self, columns: Array, slopes: Array) -> Array:
        """The gradient in all unknowns, from those in the path and in log L alone."""
        return np.append(columns, slopes - self.back.T @ columns)

    def stretch(self, step: Array) -> Array:
        """The change of log L of the part of every interval in a step, 0 without, (N,)."""
        return np.append(step[self.size :], 0.0)[self.parts]

    def point_steps(self, step: Array) -> list[Array]:
        """Change of the jet at the points, to first order, (P, (k + 1) n) per batch."""
        t, ld = self.stretch(step), self.action.ld
        columns = self.gather(step) + t[:, None, None] * self.kept
        changes = ld.point_steps(columns, "nodal", self.expansion)
        parts = zip(changes, self.stretches, ld.point_intervals, strict=True)
        return [dx + t[of, None] * dy for dx, dy, of in parts]

    def predicted_slopes(self, step: Array) -> list[Array]:
        """`output_slope` of the outputs that a step predicts, per batch."""
        parts = zip(
            self.action.ld.lagrangians, self.expansion.outputs, self.point_steps(step), strict=True
        )
        return [L.predicted_slope(y, J, dx) for L, (y, J), dx in parts]


def hessian_product(model: BandModel | EquationModel, step: Array) -> Array:
    """H s of a model, without its equations."""
    intervals = model.inner.intervals if isinstance(model, EquationModel) else model.intervals
    bent = np.einsum("kabij,kbj->kai", intervals.hessian, model.gather(step))
    return model.scatter(bent)


def moved_in_time(
    action: ActionAt, price: TimePrice, x: TimedPath, step: Array, model: QuadraticModel
) -> TimedPath:
    """The motion after a step: stretched to its new lengths, then moved in the columns.

    What is kept where parts begin and end has columns that change with the lengths.
    model: at x.
    """
    assert isinstance(model, TimedModel)
    before, clock = x.lengths, price.clock
    lengths = price.after(before, step[-len(before) :])
    problem = action(before).problem
    ratios = clock.ratios(problem.grid, before, lengths)[:, None, None]
    columns = model.gather(step)
    if not clock.whole:
        columns = columns * ratios**model.unknown
    at_ends = np.where(model.unknown > 0, 0.0, model.kept)  # `stretched_path` has the others
    if at_ends.any():
        orders = np.zeros((columns.shape[1], 1))
        orders[: 2 * x.path.order, 0] = np.tile(np.arange(x.path.order), 2)
        columns += (ratios**orders - 1.0) / np.maximum(orders, 1.0) * at_ends
    path = stretched_path(x.path, problem.grid, clock, before, lengths)
    return TimedPath(action(lengths).moved(path, columns), lengths)
