"""Parts of intervals that are short where control points of whole intervals cannot bound a motion.

Towards the time at which what a start exceeds is inside its limits: on a part that reaches beyond
that time the limit itself bounds all control points.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.conditions.joint_quantity import DERIVATIVES
from hovi.discrete.grid import Grid
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.way_back.excused import ROUNDING
from hovi.planning.solver.limits.limited_coordinates import LimitedCoordinates
from hovi.planning.solver.limits.limited_parts import LimitedParts

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

SHORT = 0.25
"""Length of a part across the time until which a limit is exceeded, as a fraction of that time."""


def graded(parts: LimitedParts, grid: Grid, limits: Limits, of: LimitedCoordinates) -> LimitedParts:
    """The parts, halved as far as excused starts need it. of: all coordinates."""
    for each in limits.excused:
        order = DERIVATIVES.get(each.limit, -1)
        for c in np.flatnonzero((of.order == order) & (of.joint == each.coordinate)):
            parts = _short_across(parts, grid, int(c), each.until)
    return parts


def _short_across(parts: LimitedParts, grid: Grid, coordinate: int, until: float) -> LimitedParts:
    while True:
        h = grid.steps[parts.k]
        begin, length = grid.t[parts.k] + h * parts.left, h * parts.width
        across = (begin < until) & (begin + length > until * (1.0 + ROUNDING))
        long = (parts.coordinate == coordinate) & across & (length > SHORT * until)
        if not long.any():
            return parts
        parts = parts.at(~long).followed_by(parts.at(long).halves())
