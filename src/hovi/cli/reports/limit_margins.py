"""How close a motion comes to its limits and to what it was planned to keep away from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import Distances
from hovi.planning.clearance.violation import approach_along
from hovi.planning.problem.limit_violation import AT_LIMIT
from hovi.planning.problem.limit_violation import closeness as closeness_along
from hovi.planning.problem.limits import KINDS, Limits
from hovi.planning.solver.solver import Solution
from hovi.viewing.recorded_limits import imposed_limits, kept_distances

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Closeness:
    """What is left to the limits, one per kind and velocity coordinate.

    names: of the coordinates.
    room: share of the range that is left to the nearest bound, shape (4, nv); negative beyond it,
        infinite where there is none.
    limits: what was imposed.
    """

    names: tuple[str, ...]
    room: Array
    limits: Limits

    @property
    def excess(self) -> float:
        """The largest share of a range by which a limit is exceeded; 0 where all hold."""
        return max(0.0, -float(self.room.min()))

    @property
    def exceeded(self) -> bool:
        """Whether a limit is exceeded by more than its tolerance."""
        return self.excess > self.limits.tolerance

    def is_limited(self, kind: str) -> bool:
        """Whether any joint has a limit of this kind."""
        return bool(self.limits.bounded[KINDS.index(kind)].any())

    def in_words(self, kind: str, joint: int) -> str:
        """Percent of the range that is left, with a mark at or beyond a limit."""
        room = self.room[KINDS.index(kind), joint]
        if not np.isfinite(room):
            return "-"
        if room < -self.limits.tolerance:
            return f"!{100 * room:.3g} %"
        return f"*{100 * max(room, 0.0):.1f} %" if room <= AT_LIMIT else f"{100 * room:.1f} %"

    def by_kind(self) -> dict[str, dict[str, float]]:
        """The shares that are left, by kind and joint."""
        return {
            kind: dict(zip(self.names, row.tolist(), strict=True))
            for kind, row in zip(KINDS, self.room, strict=True)
        }


def closeness(motion: Solution | Trajectory) -> Closeness | None:
    """The room that a motion leaves to the limits it was planned under; None without any."""
    limits, trajectory = _limits_of(motion), _trajectory_of(motion)
    if limits is None or not limits.bounded.any():
        return None
    return Closeness(trajectory.coordinate_names, closeness_along(trajectory, limits), limits)


def least_distance(motion: Solution | Trajectory) -> float | None:
    """The least distance of any pair, in [m]; None where nothing was to be kept away from."""
    kept = _distances_of(motion)
    if kept is None:
        return None
    clearance, distances = kept
    approach = approach_along(_trajectory_of(motion), distances, clearance.margin)
    return float(approach.distance.min())


def _trajectory_of(motion: Solution | Trajectory) -> Trajectory:
    return motion.trajectory if isinstance(motion, Solution) else motion


def _limits_of(motion: Solution | Trajectory) -> Limits | None:
    """Those of the problem that was solved; a motion from a file has but what it records."""
    if isinstance(motion, Solution) and motion.problem is not None:
        return motion.problem.limits
    return imposed_limits(_trajectory_of(motion))


def _distances_of(motion: Solution | Trajectory) -> tuple[Clearance, Distances] | None:
    """The same for what was to be kept away from."""
    if not isinstance(motion, Solution) or motion.problem is None:
        return kept_distances(_trajectory_of(motion))
    clearance, distances = motion.problem.clearance, motion.problem.distances
    return None if clearance is None or distances is None else (clearance, distances)
