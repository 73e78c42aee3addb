"""How near a motion comes to what it was planned to keep away from."""

from __future__ import annotations

from hovi.clearance_check import approach_along
from hovi.distance_panel import kept_distances
from hovi.trajectory import Trajectory


def least_distance(trajectory: Trajectory) -> float | None:
    """The least distance of any pair, in [m]; None where nothing was to be kept away from."""
    kept = kept_distances(trajectory)
    if kept is None:
        return None
    clearance, distances = kept
    return float(approach_along(trajectory, distances, clearance.margin).distance.min())
