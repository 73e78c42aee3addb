"""How near a motion comes to what it was planned to keep away from."""

from __future__ import annotations

from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.violation import approach_along
from hovi.viewing.distance_panel import kept_distances


def least_distance(trajectory: Trajectory) -> float | None:
    """The least distance of any pair, in [m]; None where nothing was to be kept away from."""
    kept = kept_distances(trajectory)
    if kept is None:
        return None
    clearance, distances = kept
    return float(approach_along(trajectory, distances, clearance.margin).distance.min())
