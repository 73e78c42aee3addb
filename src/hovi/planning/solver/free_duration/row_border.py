"""Limits between the points in the derivatives of a bordered action, in the logarithm of T.

A row bounds y, a derivative of order j of a joint coordinate: with the columns of the intervals
fixed, y is proportional to T^-j, so that dy/ds = -j y and d2y/ds2 = j^2 y for s = log T.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native
from hovi.planning.solver.free_duration.duration_border import DurationBorder
from hovi.planning.solver.limits.limit_rows import LimitRows, push_rows
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RowMap:
    """Rows at a path: their derivatives in the columns, shape (E, m), and their values y, (E,)."""

    rows: LimitRows
    columns: Array
    values: Array

    @property
    def slopes(self) -> Array:
        """dy/ds with the columns fixed, shape (E,)."""
        return np.asarray(-self.rows.orders * self.values)

    def steps(self, columns: Array, change: float) -> Array:
        """First-order change of y in a step of the columns and a change of log T, (E,)."""
        return push_rows(self.rows, self.columns, columns) + change * self.slopes


@dataclass(frozen=True, eq=False)
class RowForces:
    """Weighted sigma, rho and multipliers of rows, (E,) each: see the interior point.

    at: the rows at a path.
    """

    at: RowMap
    sigma: Array
    rho: Array
    multipliers: Array

    def added_to(self, border: DurationBorder) -> DurationBorder:
        """The border with the terms of the rows, whose weights do not grow with T."""
        rows, slopes, j = self.at.rows, self.at.slopes, self.at.rows.orders
        column = border.column.copy()
        forces = self.sigma * slopes - j * self.multipliers
        native.pull_rows(rows.intervals, rows.joints, self.at.columns, forces, column)
        bend = self.sigma * slopes**2 + self.multipliers * j**2 * self.at.values
        slope = border.slope + float(self.rho @ slopes)
        return DurationBorder(slope, column, border.corner + float(bend.sum()))
