"""Parts of intervals that are short where control points of whole intervals cannot bound a motion.

(1) Towards the time at which what a start exceeds is inside its limits: on a part that reaches
beyond that time the limit itself bounds all control points. (2) At ends near a bound that move
towards it: what an end gives determines control points as well, which are inside on short parts.
"""

from __future__ import annotations

from math import comb, perm

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.planning.conditions.joint_quantity import DERIVATIVES
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.way_back.excused import Excused
from hovi.planning.solver.limits.limited_coordinates import LimitedCoordinates
from hovi.planning.solver.limits.limited_parts import LimitedParts
from hovi.schemes.control_points import control_degree
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

SHORT = 0.25
"""Length of a part across the time until which a limit is exceeded, as a fraction of that time."""
MOST_HALVINGS = 12
"""Number of times that the part at an end is halved at most."""
SLACK = 0.5
"""Fraction of the tolerance by which control points that an end gives may be outside."""


@dataclass(frozen=True, eq=False)
class GivenEnds:
    """(q, q', ..., q^(k-1)) at the start and at the goal, and which are given, (2, k, nv) each."""

    jets: Array
    given: Mask

    @classmethod
    def of(cls, problem: TrajectoryProblem) -> GivenEnds:
        """Those of a problem."""
        pairs = list(problem.ends)
        pairs[0] = problem.coordinates.space.coordinates(pairs[0])
        return cls(np.stack(pairs, axis=1), ~problem.free_ends)

    def control_points(self, end: int, order: int, joint: int, length: float, degree: int) -> Array:
        """Those that an end gives on a part next to it, of a derivative of the motion."""
        held = self.given[end, order:, joint]
        rates = self.jets[end, order:, joint][: int(np.cumprod(held).sum())]
        rates = rates * (-1.0 if end else 1.0) ** np.arange(len(rates))
        return np.array(
            [
                sum(comb(i, j) / perm(degree, j) * length**j * rates[j] for j in range(i + 1))
                for i in range(min(len(rates), degree + 1))
            ]
        )


def graded(
    parts: LimitedParts,
    grid: Grid,
    limits: Limits,
    of: LimitedCoordinates,
    ends: GivenEnds | None = None,
) -> LimitedParts:
    """The parts, halved as far as excused starts and given ends need it. of: all coordinates."""
    for each in limits.excused:
        order = DERIVATIVES.get(each.limit, -1)
        for c in np.flatnonzero((of.order == order) & (of.joint == each.coordinate)):
            parts = _short_across(parts, grid, int(c), each.until)
    if ends is not None:
        for end in (0, 1):
            for c in np.flatnonzero(of.order < grid.order - 1):
                parts = _short_at_end(parts, grid, limits, of, ends, end, int(c))
    return parts


def _short_across(parts: LimitedParts, grid: Grid, coordinate: int, until: float) -> LimitedParts:
    while True:
        h = grid.steps[parts.k]
        begin, length = grid.t[parts.k] + h * parts.left, h * parts.width
        across = (begin < until) & (begin + length > until * (1.0 + 1e-12))
        long = (parts.coordinate == coordinate) & across & (length > SHORT * until)
        if not long.any():
            return parts
        parts = parts.at(~long).followed_by(parts.at(long).halves())


def _short_at_end(
    parts: LimitedParts,
    grid: Grid,
    limits: Limits,
    of: LimitedCoordinates,
    ends: GivenEnds,
    end: int,
    c: int,
) -> LimitedParts:
    order, joint = int(of.order[c]), int(of.joint[c])
    degree = control_degree(grid.order, grid.inner_modes, order)
    k = (0, grid.intervals - 1)[end]
    lower, upper = (x[min(k, len(x) - 1), c] for x in (of.lower, of.upper))
    slack = SLACK * limits.tolerance * of.ranges[c]
    led_back = [x for x in limits.excused if end == 0 and _bounds(x, order, joint)]
    for _ in range(MOST_HALVINGS):
        edge = parts.left + parts.width == 1.0 if end else parts.left == 0.0
        at_end = (parts.coordinate == c) & (parts.k == k) & edge
        length = float((parts.width[at_end] * grid.steps[k])[0])
        points = ends.control_points(end, order, joint, length, degree)
        wide = {side: _widening(led_back, side, length, degree)[: len(points)] for side in (-1, 1)}
        over = np.maximum(points - upper - wide[1], lower - wide[-1] - points) > slack
        if not over.any() or over[0]:
            return parts
        parts = parts.at(~at_end).followed_by(parts.at(at_end).halves())
    return parts


def _bounds(excused: Excused, order: int, joint: int) -> bool:
    return DERIVATIVES.get(excused.limit) == order and excused.coordinate == joint


def _widening(excused: list[Excused], side: int, length: float, degree: int) -> Array:
    """Control points by which bounds are wider on the first part, (degree + 1,)."""
    begin, lengths = np.zeros(1), np.array([length])
    mine = [x.control_points(begin, lengths, degree)[0] for x in excused if x.side == side]
    return np.asarray(sum(mine, np.zeros(degree + 1)))
