"""Distances to obstacles and between links, at all times."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.clearance_violation import (
    approach_along,
    approach_sentence,
    closest_along,
    near_pairs,
)
from hovi.planning.clearance.distances import Distances, distances_between
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.requirements.requirement import SATISFIED, Requirement
from hovi.system.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class Apart(Requirement):
    """Every pair of shapes keeps the margin, to SATISFIED in [m]."""

    problem: TrajectoryProblem
    clearance: Clearance

    def violation(self, motion: Trajectory) -> str:
        """The pair that comes closest, if one is nearer than the margin."""
        distances = self.problem.distances
        if distances is None:
            return ""
        margin = float(self.clearance.margin)
        pairs = near_pairs(motion, distances, margin - SATISFIED)
        if len(pairs) == 0:
            return ""
        near = distances.restricted(pairs.tolist())
        return approach_sentence(motion, near, approach_along(motion, near, margin), margin)

    def margins(self, motion: Trajectory) -> dict[str, Any]:
        """The least distance of all pairs, those out of reach included, and its pair."""
        known = all_distances(self.problem)
        if known is None:
            return {}
        distance, pair = nearest_pair(motion, *known)
        return {"distance": distance, "nearest_pair": pair}


def all_distances(problem: TrajectoryProblem) -> tuple[Clearance, Distances] | None:
    """The clearance and all distances that it bounds, far obstacles included; None without any."""
    clearance = problem.clearance
    if clearance is None or not clearance.wanted:
        return None
    return clearance, distances_between(problem.robot, clearance)


def least_distance(motion: Trajectory, clearance: Clearance, distances: Distances) -> float:
    """The least distance of any pair, in [m], which may be smaller where shapes may touch."""
    return nearest_pair(motion, clearance, distances)[0]


def nearest_pair(
    motion: Trajectory, clearance: Clearance, distances: Distances
) -> tuple[float, str]:
    """The least distance, as `least_distance`, and the pair at which it occurs, in words."""
    approach = closest_along(motion, distances, clearance.margin)
    closest = (approach.distance - distances.allowance).min(axis=0)
    pair = int(np.argmin(closest))
    return float(closest[pair]), str(dataclasses.replace(distances.pairs[pair], touching=False))
