"""The limits and obstacles that a motion file records."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError, InputError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import Distances, distances_between
from hovi.planning.problem.limits import Limits

_OBSTACLE_COLOR = np.array([0.75, 0.32, 0.22, 1.0])  # brick: stands out from robots and background


def imposed_limits(trajectory: Trajectory) -> Limits | None:
    """The limits recorded in a motion's metadata; None where there are none.

    Metadata may come from a file: invalid limits, or limits of another robot, count as none.
    """
    data = trajectory.metadata.get("limits")
    if not isinstance(data, dict):
        return None
    try:
        limits = Limits.from_dict(data)
    except (InputError, KeyError, TypeError, ValueError):
        return None
    fits = limits.lower.shape[1] == trajectory.v.shape[1]
    fits = fits and not (limits.on_rates and trajectory.grid.order < 3)
    return limits if fits and limits.bounded.any() else None


def imposed_clearance(trajectory: Trajectory) -> Clearance | None:
    """The clearance recorded in a motion's metadata; None where there is none.

    Metadata may come from a file: an invalid clearance counts as none.
    """
    data = trajectory.metadata.get("clearance")
    if not isinstance(data, dict):
        return None
    try:
        return Clearance.from_dict(data)
    except (InputError, AttributeError, KeyError, TypeError, ValueError):
        return None


def kept_distances(trajectory: Trajectory) -> tuple[Clearance, Distances] | None:
    """The recorded clearance and its distances; None where not recorded or not computable."""
    clearance = imposed_clearance(trajectory)
    if clearance is None or not clearance.wanted or trajectory.robot is None:
        return None
    try:
        return clearance, distances_between(trajectory.robot, clearance)
    except HoviError:  # meshes that are missing on this machine
        return None


def with_obstacles(visual: pin.GeometryModel, trajectory: Trajectory) -> pin.GeometryModel:
    """The drawn objects of a robot and the obstacles of its motion."""
    clearance = imposed_clearance(trajectory)
    if clearance is None or not clearance.obstacles:
        return visual
    both = visual.copy()
    for number, each in enumerate(clearance.obstacles):
        name = f"obstacle {number}"
        item = pin.GeometryObject(name, 0, 0, each.placement(), each.shape())
        item.meshColor = _OBSTACLE_COLOR
        both.addGeometryObject(item)
    return both
