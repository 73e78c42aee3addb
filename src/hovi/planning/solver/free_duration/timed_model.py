"""The quadratic model of a discrete action plus the price of time, in the path and log L."""

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
    the jets at the points, per batch.
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
            known = known.with_ends(self.expansion, self.kept, self.unknown, problem.ld.k)
        cost, own = price.weight * x.lengths, np.arange(len(x.lengths)) == self.parts[:, None]
        columns = [inner.scatter(known.column * of[:, None, None]) for of in own.T]
        border = Border(
            known.slope @ own + cost,
            np.stack(columns, axis=1),
            np.diag(known.corner @ own + cost),
            metric,
            price.room(x.lengths),
        )
        super().__init__(inner, border)

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
