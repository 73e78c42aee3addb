"""The quadratic model of a discrete action plus the price of time, in the path and log T."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from hovi.optimize.banded_model import BandModel
from hovi.optimize.bordered_model import Border, BorderedModel
from hovi.optimize.equation_model import EquationModel
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.free_duration.duration_border import (
    Forces,
    duration_border,
    stretch_of,
)
from hovi.planning.solver.free_duration.row_border import RowForces
from hovi.planning.solver.free_duration.timed_path import (
    TimedPath,
    TimePrice,
    columns_of_ends,
    end_columns,
    stretched_path,
)

Array = npt.NDArray[np.float64]
ActionAt = Callable[[float], ActionObjective]
"""The action for a duration, in [s]."""


class TimedModel(BorderedModel):
    """The bordered model at a motion.

    action: of its duration, whose last model was `inner`. x: the motion.
    inner: the model in the path alone. price: of time. metric: entry of log T in the metric
    T^3 integral |da|^2, in which a motion of 1 rad between rests has the squared length 12.
    forces: of limits at the points, per batch; none if None. rows: of limits between them.
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
        self.jets = action.jets(x.path)
        problem = action.problem
        ends = end_columns(problem, x.path)
        self.ends = None if ends is None else columns_of_ends(ends, problem)
        known = duration_border(problem.ld, self.expansion, self.jets, forces)
        if rows is not None:
            known = rows.added_to(known)
        if self.ends is not None:
            known = known.with_ends(self.expansion, self.ends, problem.ld.k)
        cost = price.weight * x.duration
        border = Border(
            known.slope + cost,
            inner.scatter(known.column),
            known.corner + cost,
            metric,
            price.room(x.duration),
        )
        super().__init__(inner, border)

    def point_steps(self, step: Array) -> list[Array]:
        """Change of the jet at the points, to first order, (P, (k + 1) n) per batch."""
        t, columns = float(step[-1]), self.gather(step)
        if self.ends is not None:
            columns += t * self.ends
        changes = self.action.ld.point_steps(columns, "nodal", self.expansion)
        return [dx + t * stretch_of(jet) for dx, jet in zip(changes, self.jets, strict=True)]

    def predicted_slopes(self, step: Array) -> list[Array]:
        """`output_slope` of the outputs that a step predicts, per batch."""
        parts = zip(
            self.action.ld.lagrangians, self.expansion.outputs, self.point_steps(step), strict=True
        )
        return [L.predicted_slope(y, J, dx) for L, (y, J), dx in parts]


def moved_in_time(
    action: ActionAt, price: TimePrice, x: TimedPath, step: Array, model: QuadraticModel
) -> TimedPath:
    """The motion after a step: stretched to its new duration, then moved in the columns.

    Fixed velocities at the ends are kept: their columns h v change with the duration.
    """
    T = price.after(x.duration, float(step[-1]))
    problem, ratio = action(x.duration).problem, T / x.duration
    fixed, j, columns = end_columns(problem, x.path), np.arange(problem.ld.k), model.gather(step)
    if fixed is not None:
        fixed *= ((ratio**j - 1.0) / np.maximum(j, 1))[:, None]
        columns += columns_of_ends(fixed, problem)
    return TimedPath(action(T).moved(stretched_path(x.path, ratio), columns), T)
