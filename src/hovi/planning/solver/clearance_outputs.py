"""Distances as outputs at the quadrature points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import DISTANCE_SCALE
from hovi.planning.clearance.clearance_violation import approach_along, approach_sentence
from hovi.planning.clearance.distances import Distances
from hovi.planning.conditions.function import Points
from hovi.planning.solver.point_outputs import ExpandedOutputs, PointOutputs

Array = npt.NDArray[np.float64]

EXTRA_CLEARANCE = 5e-4
"""Clearance at the points beyond the margin, in DISTANCE_SCALE: 0.05 mm for the motion between."""
CUTOFF = 1.0, 3.0
"""Excess over the margin, in DISTANCE_SCALE, from which outputs level off, and are constant."""


class ClearanceOutputs(PointOutputs):
    """y = (phi(d) - least) / DISTANCE_SCALE for every pair's distance d.

    phi(d) = d for near pairs and constant for far ones, with two continuous derivatives: far
    pairs have no influence, and need no derivatives.

    distances: of the pairs. least: lower bound, in [m]. between: that between the points.
    """

    def __init__(self, distances: Distances, least: float, between: float | None = None) -> None:
        self.distances = distances
        self.least = least
        self.between = least if between is None else between
        self._last: tuple[Array, Array] | None = None

    def restricted(self, pairs: Sequence[int]) -> ClearanceOutputs:
        """The outputs of some of the pairs, by their numbers."""
        return ClearanceOutputs(self.distances.restricted(pairs), self.least)

    @property
    def size(self) -> int:
        """Number of pairs."""
        return len(self.distances.pairs)

    @property
    def reach(self) -> float:
        """Distance beyond which an output is constant, in [m]."""
        return self.least + CUTOFF[1] * DISTANCE_SCALE

    def values(self, at: Points) -> Array:
        """y, shape (P, K)."""
        return saturated(self._excess(self.distances.at(at.q, at.t)))[0]

    def expand(self, at: Points, force: Array) -> ExpandedOutputs:
        """Derivatives in q: see PointOutputs."""
        q = self.distances.at(at.q, at.t)
        _, slope, bend = saturated(self._excess(q))
        weights = force * slope / DISTANCE_SCALE
        _, jacobian, curvature = self.distances.expansion(q, weights, self.reach)
        jacobian /= DISTANCE_SCALE
        bending = (force * bend)[:, :, None] * jacobian
        curvature += np.matmul(jacobian.transpose(0, 2, 1), bending)
        return ExpandedOutputs(slope[:, :, None] * jacobian, curvature)

    def excess(self, trajectory: Trajectory, tolerance: float) -> Array:
        """By how much pairs are nearer than they may be, in DISTANCE_SCALE, (2, N, K)."""
        approach = approach_along(trajectory, self.distances, self.between)
        short = (self.between - approach.distance) / DISTANCE_SCALE
        return np.stack([short, np.full_like(short, -np.inf)])

    def worst(self, trajectory: Trajectory, tolerance: float) -> tuple[float, str]:
        """The pair that comes closest."""
        approach = approach_along(trajectory, self.distances, self.between)
        margin = self.between - tolerance * DISTANCE_SCALE
        short = (self.between - approach.distance).max() / DISTANCE_SCALE
        return float(short), approach_sentence(trajectory, self.distances, approach, margin)

    def _excess(self, q: Array) -> Array:
        """Distances beyond the least one, in DISTANCE_SCALE; those of the last points are kept."""
        if self._last is None or not np.array_equal(self._last[0], q):
            distances = self.distances.values(q, self.reach)
            self._last = q.copy(), (distances - self.least) / DISTANCE_SCALE
        return self._last[1]


def saturated(y: Array) -> tuple[Array, Array, Array]:
    """phi(y) and its two derivatives, in DISTANCE_SCALE.

    y up to the first CUTOFF, then width (x - x^3 + x^4/2) more with x in [0, 1], then constant.
    """
    near, far = CUTOFF
    if not np.any(y > near):  # as where rows are of near pairs alone
        return y.copy(), np.ones_like(y), np.zeros_like(y)
    width = far - near
    x = np.clip((y - near) / width, 0.0, 1.0)
    level = near + width * (x - x**3 + 0.5 * x**4)
    slope, bend = (1.0 - x) ** 2 * (1.0 + 2.0 * x), -6.0 * x * (1.0 - x) / width
    return np.where(y > near, level, y), slope, bend
