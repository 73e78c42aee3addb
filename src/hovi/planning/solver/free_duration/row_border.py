"""Limits between the points in the derivatives of a bordered action, in the logarithm of T.

A row bounds y, a derivative of order j of a joint coordinate: with the columns of the intervals
fixed, y is proportional to T^-j, so that dy/ds = -j y and d2y/ds2 = j^2 y for s = log T.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native
from hovi.planning.solver.free_duration.duration_border import DurationBorder
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RowForces:
    """Rows at a path, with what acts on them: see the interior point.

    columns: their derivatives in the columns, shape (E, m). values: y, (E,).
    sigma, rho, multipliers: weighted, (E,) each.
    """

    rows: LimitRows
    columns: Array
    values: Array
    sigma: Array
    rho: Array
    multipliers: Array

    @property
    def slopes(self) -> Array:
        """dy/ds with the columns fixed, shape (E,)."""
        return np.asarray(-self.rows.orders * self.values)

    def added_to(self, border: DurationBorder) -> DurationBorder:
        """The border with the terms of the rows, whose weights do not grow with T."""
        rows, slopes, j = self.rows, self.slopes, self.rows.orders
        column = border.column.copy()
        forces = self.sigma * slopes - j * self.multipliers
        native.pull_rows(rows.intervals, rows.joints, self.columns, forces, column)
        bend = self.sigma * slopes**2 + self.multipliers * j**2 * self.values
        slope = border.slope + float(self.rho @ slopes)
        return DurationBorder(slope, column, border.corner + float(bend.sum()))
