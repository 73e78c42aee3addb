"""What a motion was planned to keep away from, and how to draw it."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.clearance.clearance import Clearance

_COLOR = np.array([0.75, 0.32, 0.22, 1.0])  # brick: no robot's color, and dark on the gray


def imposed_clearance(trajectory: Trajectory) -> Clearance | None:
    """The clearance that the metadata of a motion remembers; None where there is none.

    Metadata may come from a file: what does not describe a clearance counts as none.
    """
    data = trajectory.metadata.get("clearance")
    if not isinstance(data, dict):
        return None
    try:
        return Clearance.from_dict(data)
    except (InputError, AttributeError, KeyError, TypeError, ValueError):
        return None


def with_obstacles(visual: pin.GeometryModel, trajectory: Trajectory) -> pin.GeometryModel:
    """The drawn objects of a robot, and the obstacles of its motion."""
    clearance = imposed_clearance(trajectory)
    if clearance is None or not clearance.obstacles:
        return visual
    both = visual.copy()
    for number, each in enumerate(clearance.obstacles):
        name = f"obstacle {number}"
        item = pin.GeometryObject(name, 0, 0, each.placement(), each.shape())
        item.meshColor = _COLOR
        both.addGeometryObject(item)
    return both
