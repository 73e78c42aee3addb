"""The margins of a motion to its limits and obstacles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.clearance_violation import approach_along
from hovi.planning.clearance.distances import Distances
from hovi.planning.problem.limit_violation import AT_LIMIT
from hovi.planning.problem.limit_violation import closeness as margins_along
from hovi.planning.problem.limits import KINDS, Limits
from hovi.planning.solver.solver import Solution
from hovi.system.deadline import Deadline, OutOfTimeError
from hovi.viewing.recorded_limits import imposed_limits, kept_distances

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LimitMargins:
    """The smallest margin to the limits, per kind and velocity coordinate.

    names: of the coordinates.
    margin: distance to the nearest bound as a fraction of the range, shape (kinds, nv); negative
        beyond the bound, infinite where there is none.
    limits: of the plan.
    """

    names: tuple[str, ...]
    margin: Array
    limits: Limits

    @property
    def excess(self) -> float:
        """The largest excess over a limit as a fraction of its range; 0 where all limits hold."""
        return max(0.0, -float(self.margin.min()))

    @property
    def exceeded(self) -> bool:
        """Whether a limit is exceeded by more than its tolerance."""
        return self.excess > self.limits.tolerance

    def is_limited(self, kind: str) -> bool:
        """Whether any joint has a limit of this kind."""
        return kind in self.limits.kinds and bool(self.limits.bounded[KINDS.index(kind)].any())

    def text(self, kind: str, joint: int) -> str:
        """The margin in percent of the range, marked with * at a limit and ! beyond it."""
        margin = self.margin[KINDS.index(kind), joint]
        if not np.isfinite(margin):
            return "-"
        if margin < -self.limits.tolerance:
            return f"!{100 * margin:.3g} %"
        return f"*{100 * max(margin, 0.0):.1f} %" if margin <= AT_LIMIT else f"{100 * margin:.1f} %"

    def by_kind(self) -> dict[str, dict[str, float]]:
        """The margins, by kind and joint."""
        return {
            kind: dict(zip(self.names, row.tolist(), strict=True))
            for kind, row in zip(self.limits.kinds, self.margin, strict=True)
        }


def limit_margins(motion: Solution | Trajectory) -> LimitMargins | None:
    """The margins of a motion to the limits of its plan; None without limits."""
    limits, trajectory = _limits_of(motion), _trajectory_of(motion)
    if limits is None or not limits.bounded.any():
        return None
    return LimitMargins(trajectory.coordinate_names, margins_along(trajectory, limits), limits)


def least_distance(motion: Solution | Trajectory) -> float | None:
    """The least distance of any pair, in [m]; None for a plan without obstacles."""
    kept = _distances_of(motion)
    if kept is None:
        return None
    clearance, distances = kept
    approach = approach_along(_trajectory_of(motion), distances, clearance.margin)
    return float((approach.distance - distances.allowance).min())


@dataclass(frozen=True)
class Margins:
    """The margins to limits and obstacles that a report shows.

    limits, distance: as limit_margins and least_distance; None without limits or obstacles.
    missing: why the rest is not known; "" if all is.
    """

    limits: LimitMargins | None = None
    distance: float | None = None
    missing: str = ""

    @classmethod
    def of(cls, solution: Solution, deadline: Deadline) -> Margins:
        """The margins that are known by a deadline; distances of long motions take minutes."""
        limits = None
        try:
            with deadline.in_force():
                limits = limit_margins(solution)
                return cls(limits, least_distance(solution))
        except OutOfTimeError as late:
            return cls(limits, missing=str(late))


def _trajectory_of(motion: Solution | Trajectory) -> Trajectory:
    return motion.trajectory if isinstance(motion, Solution) else motion


def _limits_of(motion: Solution | Trajectory) -> Limits | None:
    """The limits of the solved problem; for a motion from a file, those that it records."""
    if isinstance(motion, Solution) and motion.problem is not None:
        return motion.problem.limits
    return imposed_limits(_trajectory_of(motion))


def _distances_of(motion: Solution | Trajectory) -> tuple[Clearance, Distances] | None:
    """The clearance and distances of the solved problem, or those that the motion records."""
    if not isinstance(motion, Solution) or motion.problem is None:
        return kept_distances(_trajectory_of(motion))
    clearance, distances = motion.problem.clearance, motion.problem.distances
    return None if clearance is None or distances is None else (clearance, distances)
