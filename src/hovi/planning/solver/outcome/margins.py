"""How far a motion stays from its limits and from obstacles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Any

import numpy as np

from hovi.checks.arguments import check_arguments
from hovi.conditions.condition import residual
from hovi.conditions.excess import nearest_to_bounds
from hovi.conditions.missed_along import missed_along
from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance_violation import nearest_pair
from hovi.planning.clearance.distances import distances_between
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.outcome.limit_margins import LimitMargins, limit_margins
from hovi.planning.solver.regions import room_in_regions
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
    missed: the largest |y - value| of each condition with a value, at all or at given times, by its
        name.
    times: when each of `conditions` is nearest to its bounds, and each of `missed` is missed most,
        in [s].
    regions: what is left of the room of each bound of a goal's region where the frame ends, in [m]
        or [rad], by the frame and what is bounded.
    """

    limits: LimitMargins | None = None
    distance: float | None = None
    segments: Mapping[str, LimitMargins] = field(default_factory=dict)
    nearest_pair: str | None = None
    conditions: Mapping[str, float] = field(default_factory=dict)
    missed: Mapping[str, float] = field(default_factory=dict)
    times: Mapping[str, float] = field(default_factory=dict)
    regions: Mapping[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        """The tightest limit of the motion and of each segment, and the least distance."""
        known = ["no limits" if self.limits is None else str(self.limits)]
        known += [f"{name!r}: {each}" for name, each in self.segments.items()]
        known += [
            f"{name!r}: margin {100 * x:.3g} %{self.when(name)}"
            for name, x in self.conditions.items()
        ]
        known += [
            f"{name!r}: missed by at most {x:.2g}{self.when(name)}"
            for name, x in self.missed.items()
        ]
        known += [f"region, {name}: {x:.3g} left" for name, x in self.regions.items()]
        if self.distance is not None:
            known.append(f"least distance {self.distance:.4g} m, of {self.nearest_pair}")
        return "\n".join(known)

    def when(self, name: str) -> str:
        """When that of a condition is, as the end of a line; "" if it is not known."""
        return f" at t = {self.times[name]:.4g} s" if name in self.times else ""


def margins_of(problem: TrajectoryProblem, motion: Trajectory) -> Margins:
    """The margins of a motion of a problem.

    Raises OutOfTimeError when the deadline in force passes before they are known.
    """
    return Margins(**margins_to_bounds(problem, motion), **margins_to_obstacles(problem, motion))


def margins_to_bounds(problem: TrajectoryProblem, motion: Trajectory) -> dict[str, Any]:
    """The fields of Margins but for distances."""
    limits, segments = limit_margins(motion, problem.limits)
    nearest = {each.name: nearest_to_bounds(motion, each) for each in problem.bounds}
    missed = dict(_missed_at_times(problem, motion))
    for each in missed_along(problem.along, motion):
        missed[each.given.name] = each.size, each.time
    return {
        "limits": limits,
        "segments": segments,
        "conditions": {name: margin for name, (margin, _) in nearest.items()},
        "missed": {name: size for name, (size, _) in missed.items()},
        "times": {name: time for name, (_, time) in (nearest | missed).items()},
        "regions": room_in_regions(problem, motion),
    }


def _missed_at_times(
    problem: TrajectoryProblem, motion: Trajectory
) -> Iterator[tuple[str, tuple[float, float]]]:
    """The name of each condition with values at given times, the largest |y - value| and when."""
    asked = {each.name for each in problem.conditions}
    of = dict[str, tuple[float, float]]()
    for each in problem.equations:
        if each.name in asked:
            found = float(np.abs(residual(each, motion.path)).max()), each.where.time
            of[each.name] = max(of.get(each.name, found), found)
    yield from of.items()


def margins_to_obstacles(problem: TrajectoryProblem, motion: Trajectory) -> dict[str, Any]:
    """The least distance of all pairs, those out of reach included, and its pair."""
    if problem.clearance is None or not problem.clearance.wanted:
        return {}
    every = distances_between(problem.robot, problem.clearance)
    distance, pair = nearest_pair(motion, problem.clearance, every)
    return {"distance": distance, "nearest_pair": pair}
