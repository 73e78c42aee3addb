"""The margins of a motion to its limits and obstacles, of a plan or of a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance import clearance_violation
from hovi.planning.problem.limits import Limits
from hovi.planning.solver.outcome import limit_margins as limited
from hovi.planning.solver.outcome.limit_margins import LimitMargins
from hovi.planning.solver.outcome.margins import margins_to_bounds, margins_to_obstacles
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError
from hovi.viewing.recorded_limits import imposed_limits, kept_distances


def limit_margins(motion: Solution | Trajectory) -> LimitMargins | None:
    """The margins of a motion to the limits of its plan; None without limits."""
    return limited.limit_margins(_trajectory_of(motion), _limits_of(motion))[0]


def nearest_pair(motion: Solution | Trajectory) -> tuple[float | None, str | None]:
    """The least distance of any pair, in [m], and that pair; None for a plan without obstacles."""
    if isinstance(motion, Solution) and motion.problem is not None:
        known = margins_to_obstacles(motion.problem, motion.trajectory)
        return known.get("distance"), known.get("nearest_pair")
    trajectory = _trajectory_of(motion)
    kept = kept_distances(trajectory)
    return (None, None) if kept is None else clearance_violation.nearest_pair(trajectory, *kept)


@dataclass(frozen=True)
class KnownMargins:
    """What a report shows of the margins of a motion, and whether the motion is usable.

    limits, distance, segments, nearest_pair, conditions, missed, times, regions: as hovi.Margins;
        None, or none, where there are none.
    violation: as Solution.violation; None if it is not known.
    missing: why the rest is not known; "" if all is.
    """

    limits: LimitMargins | None = None
    distance: float | None = None
    segments: Mapping[str, LimitMargins] = field(default_factory=dict)
    violation: str | None = None
    missing: str = ""
    nearest_pair: str | None = None
    conditions: Mapping[str, float] = field(default_factory=dict)
    missed: Mapping[str, float] = field(default_factory=dict)
    times: Mapping[str, float] = field(default_factory=dict)
    regions: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, solution: Solution, deadline: Deadline) -> KnownMargins:
        """What is known by a deadline; distances of long motions take minutes.

        Of a motion that is but a guess, as there is none, nothing is of interest.
        """
        if is_guess(solution):
            return cls(missing="there is no motion, only a guess")
        motion, problem = solution.trajectory, solution.problem
        if problem is None:
            return cls()
        known, violation = dict[str, Any](), None
        try:
            with deadline.in_force():
                known |= margins_to_bounds(problem, motion)
                violation = solution.violation
                known |= margins_to_obstacles(problem, motion)
                return cls(**known, violation=violation)
        except OutOfTimeError as late:
            return cls(**known, violation=violation, missing=str(late))


def is_guess(solution: Solution) -> bool:
    """Whether the motion is but a guess, as nothing had to be solved to know that there is none."""
    return solution.status is Status.INFEASIBLE and solution.nit == 0


def _trajectory_of(motion: Solution | Trajectory) -> Trajectory:
    return motion.trajectory if isinstance(motion, Solution) else motion


def _limits_of(motion: Solution | Trajectory) -> Limits | None:
    """The limits of the solved problem; for a motion from a file, those that it records."""
    if isinstance(motion, Solution) and motion.problem is not None:
        return motion.problem.limits
    return imposed_limits(_trajectory_of(motion))
