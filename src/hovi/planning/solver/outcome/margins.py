"""How far a motion stays from its limits and from obstacles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from hovi.checks.arguments import check_arguments
from hovi.conditions.excess import excess_along
from hovi.conditions.missed_along import missed_along
from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance_violation import nearest_pair
from hovi.planning.clearance.distances import distances_between
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.outcome.limit_margins import LimitMargins, limit_margins
from hovi.system.dataclass import dataclass


@check_arguments
@dataclass(frozen=True, eq=False)
class Margins:
    """How far a motion stays from each of its limits and from obstacles, between the nodes, too.

    limits: the margins to the limits; None for a plan without limits.
    distance: the least distance to obstacles and, with self-collision, between links, in [m]; None
        for a plan without either.
    segments: of a sequence, the margins to the limits of each segment, by its name.
    nearest_pair: the link and the obstacle, or the two links, at that distance; None without one.
    conditions: the margin to the bounds of each condition, by its name, as a fraction of its scale.
    missed: the largest |y - value| of each condition with a value at all times, by its name.
    """

    limits: LimitMargins | None = None
    distance: float | None = None
    segments: Mapping[str, LimitMargins] = field(default_factory=dict)
    nearest_pair: str | None = None
    conditions: Mapping[str, float] = field(default_factory=dict)
    missed: Mapping[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        """The tightest limit of the motion and of each segment, and the least distance."""
        known = ["no limits" if self.limits is None else str(self.limits)]
        known += [f"{name!r}: {each}" for name, each in self.segments.items()]
        known += [f"{name!r}: margin {100 * x:.3g} %" for name, x in self.conditions.items()]
        known += [f"{name!r}: missed by at most {x:.2g}" for name, x in self.missed.items()]
        if self.distance is not None:
            known.append(f"least distance {self.distance:.4g} m, of {self.nearest_pair}")
        return "\n".join(known)


def margins_of(problem: TrajectoryProblem, motion: Trajectory) -> Margins:
    """The margins of a motion of a problem.

    Raises OutOfTimeError when the deadline in force passes before they are known.
    """
    return Margins(**margins_to_bounds(problem, motion), **margins_to_obstacles(problem, motion))


def margins_to_bounds(problem: TrajectoryProblem, motion: Trajectory) -> dict[str, Any]:
    """The fields of Margins but for distances."""
    limits, segments = limit_margins(motion, problem.limits)
    conditions = {each.name: -float(excess_along(motion, each).max()) for each in problem.bounds}
    missed = {each.given.name: each.size for each in missed_along(problem.along, motion)}
    return {"limits": limits, "segments": segments, "conditions": conditions, "missed": missed}


def margins_to_obstacles(problem: TrajectoryProblem, motion: Trajectory) -> dict[str, Any]:
    """The least distance of all pairs, those out of reach included, and its pair."""
    if problem.clearance is None or not problem.clearance.wanted:
        return {}
    every = distances_between(problem.robot, problem.clearance)
    distance, pair = nearest_pair(motion, problem.clearance, every)
    return {"distance": distance, "nearest_pair": pair}
