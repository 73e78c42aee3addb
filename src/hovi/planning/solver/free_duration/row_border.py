"""Limits between the points in the derivatives of a bordered action, in the logarithms of lengths.

A row bounds y, a derivative of order j of a joint coordinate: with the columns of the intervals
fixed, y is proportional to L^-j, so that dy/ds = -j y and d2y/ds2 = j^2 y for s = log L.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native
from hovi.planning.solver.free_duration.duration_border import DurationBorder
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class RowForces:
    """Rows at a path, with what acts on them: see the interior point.

    inside: which intervals belong to a part, (N,).
    columns: their derivatives in the columns, shape (E, m). values: y, (E,).
    sigma, rho, multipliers: weighted, (E,) each.
    """

    rows: LimitRows
    inside: Mask
    columns: Array
    values: Array
    sigma: Array
    rho: Array
    multipliers: Array

    @property
    def orders(self) -> Array:
        """j of the rows of parts, 0 for others, shape (E,)."""
        return np.asarray(self.rows.orders * self.inside[self.rows.intervals])

    @property
    def slopes(self) -> Array:
        """dy/ds with the columns fixed, shape (E,)."""
        return np.asarray(-self.orders * self.values)

    def added_to(self, border: DurationBorder) -> DurationBorder:
        """The border with the terms of the rows, whose weights do not grow with L."""
        rows, slopes, j = self.rows, self.slopes, self.orders
        column = border.column.copy()
        forces = self.sigma * slopes - j * self.multipliers
        native.pull_rows(rows.intervals, rows.joints, self.columns, forces, column)
        bend = self.sigma * slopes**2 + self.multipliers * j**2 * self.values
        of, count = rows.intervals, len(border.slope)
        slope = border.slope + np.bincount(of, self.rho * slopes, count)
        return DurationBorder(slope, column, border.corner + np.bincount(of, bend, count))
