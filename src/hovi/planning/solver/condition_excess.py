"""By how much a motion exceeds the bounds of conditions, between the quadrature points, too."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.planning.conditions.condition import Bounded, scales
from hovi.planning.conditions.function import Points
from hovi.planning.problem.limit_violation import SampledBounds, excess_along, excess_of

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

NO_BOUND = 1e3
"""Distance from a bound, as a fraction of the scale, where it is infinite at an instant."""


class ConditionBounds(SampledBounds):
    """lower(t) - y <= 0 and y - upper(t) <= 0 of a condition, over its scale, (1, 2 size)."""

    def __init__(self, given: Bounded) -> None:
        self.given, self.scale = given, scales(given)
        self.tolerance = given.tolerance
        sides = zip(
            given.on.at(np.zeros(1), given.y.size), (given.on.lower, given.on.upper), strict=True
        )
        known = [np.isfinite(at_start) | callable(bound) for at_start, bound in sides]
        self.upper = np.where(np.concatenate(known, axis=1), 0.0, np.inf)

    def outputs(self, trajectory: Trajectory, k: Index, s: Array) -> Array:
        """lower(t) - y and y - upper(t) at positions s in intervals k, (M, 1, 2 size)."""
        y, t = self.values(trajectory, k, s)
        low, high = self.given.on.at(t, self.given.y.size)
        sides = np.concatenate([low - y, y - high], axis=1) / np.tile(self.scale, 2)
        return np.where(np.isfinite(self.upper), np.maximum(sides, -NO_BOUND), 0.0)[:, None]

    def values(self, trajectory: Trajectory, k: Index, s: Array) -> tuple[Array, Array]:
        """y (M, size) and the times (M,) at positions s in intervals k."""
        q, v, a = trajectory.jet_intervals(k, s)
        t = trajectory.t[k] + s * trajectory.grid.steps[k]
        tau = None
        if "tau" in self.given.y.needs:
            tau = trajectory.torques(k, s, (q, v, a))
        return self.given.y.values(Points(q, v, t, a, tau)), t

    def excess(self, trajectory: Trajectory, least: float) -> Array:
        """Excess over lower and upper bounds in every interval, (2, N, size).

        As a fraction of the scale, such that one that is tolerated is at most `least`.
        """
        over = excess_of(trajectory, self, np.isfinite(self.upper))[1][:, 0]
        return np.stack(np.split(over - (self.tolerance - least), 2, axis=1))

    def margin(self, trajectory: Trajectory) -> float:
        """The least distance from any bound, as a fraction of the scale; negative beyond it."""
        return -float(excess_along(trajectory, self).upper.max())

    def worst(self, trajectory: Trajectory) -> tuple[float, str]:
        """The largest excess as a fraction of the scale, and the value, time and bound in words."""
        found = excess_along(trajectory, self)
        over = np.where(np.isfinite(self.upper), found.upper, -np.inf)[:, 0]
        k, column = np.unravel_index(int(np.argmax(over)), over.shape)
        size = self.given.y.size
        side, entry = divmod(int(column), size)
        at = np.array([k]), np.array([found.at_upper[k, 0, column]])
        y, t = self.values(trajectory, *at)
        bound = self.given.on.at(t, size)[side][0, entry]
        unit = f" {self.given.unit}" if self.given.unit else ""
        return float(over[k, column]), (
            f"{in_words(self.given, entry)} reaches {y[0, entry]:.4g}{unit} at t = {t[0]:.3g} s, "
            f"its bound is {bound:.4g}"
        )


def in_words(given: Bounded, entry: int) -> str:
    """A condition and the entry of its function, in a sentence."""
    if given.of:
        return f"condition {given.name!r} of {given.of[entry]!r}"
    return f"condition {given.name!r}" + (f" of entry {entry}" if given.y.size > 1 else "")
