"""The limits and obstacles that a motion file records."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError, InputError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import Distances, distances_between
from hovi.planning.obstacles.obstacle import Body, Obstacle
from hovi.planning.obstacles.obstacle_path import ObstaclePath
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.way_back.excused import excused_sentence
from hovi.system.dataclass import dataclass

_OBSTACLE_COLOR = np.array([0.75, 0.32, 0.22, 1.0])  # brick: stands out from robots and background


def imposed_limits(trajectory: Trajectory) -> Limits | None:
    """The limits on joints recorded in a motion's metadata; None where there are none.

    Of a motion in segments, each with its own, the loosest, within which it is as a whole.
    """
    limits = recorded_limits(trajectory)
    return limits if limits is not None and limits.bounded.any() else None


def recorded_limits(trajectory: Trajectory) -> Limits | None:
    """The same with the limits on the power, which may be alone.

    Metadata may come from a file: invalid limits, or limits of another robot, count as none.
    """
    data = trajectory.metadata.get("limits")
    parts = segment_limits(trajectory)
    try:
        if isinstance(data, dict):
            limits = Limits.from_dict(data, trajectory.robot)
        elif parts:
            limits = _loosest(list(parts))
        else:
            return None
    except (InputError, KeyError, TypeError, ValueError):
        return None
    bounded = limits.bounded.any() or limits.conditions
    return limits if bounded and _fit(limits, trajectory) else None


def _fit(limits: Limits, trajectory: Trajectory) -> bool:
    """Whether they are of as many coordinates, and none of a derivative that the motion lacks."""
    fits = limits.lower.shape[1] == trajectory.v.shape[1]
    return fits and not (limits.on_rates and trajectory.grid.order < 3)


def segment_limits(trajectory: Trajectory) -> tuple[Limits, ...]:
    """The recorded limits of each segment; () where all have the same ones.

    Metadata may come from a file: invalid limits, or limits of another robot, count as none.
    """
    data = trajectory.metadata.get("segment_limits")
    if not isinstance(data, list):
        return ()
    try:
        parts = tuple(Limits.from_dict(each, trajectory.robot) for each in data)
    except (InputError, AttributeError, KeyError, TypeError, ValueError):
        return ()
    return parts if all(_fit(each, trajectory) for each in parts) else ()


def _loosest(parts: list[Limits]) -> Limits:
    """The loosest bounds of any segment: none where one segment has none."""
    parts = list(Limits.of_segments(parts, range(1, len(parts))).parts)  # of the same size
    lower = np.min([each.lower for each in parts], axis=0)
    upper = np.max([each.upper for each in parts], axis=0)
    excused = tuple(each for part in parts for each in part.excused)
    tolerance, power = max(each.tolerance for each in parts), parts[0].conditions
    return Limits(lower, upper, tolerance, excused=excused, conditions=power)


def led_back_sentence(trajectory: Trajectory) -> str:
    """What a motion exceeds of its recorded limits from its start on; "" if nothing."""
    limits = imposed_limits(trajectory)
    return "" if limits is None else excused_sentence(limits.excused)


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


def carried_parts(trajectory: Trajectory) -> list[tuple[str, float, float]]:
    """The links of what is carried, from when and until when, in [s]; none where not recorded."""
    clearance, T = imposed_clearance(trajectory), trajectory.duration
    known = () if clearance is None else clearance.during
    return sorted((name, a, min(b, T)) for name, a, b in known if 0.0 <= a < min(b, T))


def kept_distances(trajectory: Trajectory) -> tuple[Clearance, Distances] | None:
    """The recorded clearance and its distances; None where not recorded or not computable."""
    clearance = imposed_clearance(trajectory)
    if clearance is None or not clearance.wanted or trajectory.robot is None:
        return None
    try:
        return clearance, distances_between(trajectory.robot, clearance)
    except HoviError:  # meshes that are missing on this machine
        return None


def drawn_obstacles(trajectory: Trajectory) -> list[tuple[str, Body, Obstacle]]:
    """The drawn bodies of a motion's obstacles, with their names and obstacles."""
    clearance = imposed_clearance(trajectory)
    return [
        (f"obstacle {number} {k}", body, each)
        for number, each in enumerate(() if clearance is None else clearance.obstacles)
        for k, body in enumerate(each.drawn())
    ]


def with_obstacles(visual: pin.GeometryModel, trajectory: Trajectory) -> pin.GeometryModel:
    """The drawn objects of a robot and the obstacles of its motion, as they are at its start."""
    drawn = drawn_obstacles(trajectory)
    if not drawn:
        return visual
    both = visual.copy()
    for name, body, obstacle in drawn:
        path = obstacle.motion
        at = body.placement if path is None else path.pose(0.0) * body.placement
        item = pin.GeometryObject(name, 0, 0, at, body.shape)
        item.meshColor = _OBSTACLE_COLOR
        both.addGeometryObject(item)
    return both


class Drawing(Protocol):
    """What draws a geometry: a visualizer of Pinocchio."""

    visual_model: pin.GeometryModel


@dataclass(frozen=True, eq=False)
class MovingObjects:
    """Names of drawn obstacles, with their placement in the frame of the path that moves them."""

    items: tuple[tuple[str, pin.SE3, ObstaclePath], ...]

    @classmethod
    def of(cls, trajectory: Trajectory) -> MovingObjects:
        """Those of a motion."""
        drawn = drawn_obstacles(trajectory)
        found = ((name, body.placement, obstacle.motion) for name, body, obstacle in drawn)
        return cls(tuple((name, at, path) for name, at, path in found if path is not None))

    def place(self, drawing: Drawing, t: float) -> None:
        """Put the objects where they are at a time, to be displayed."""
        for name, placement, path in self.items:
            visual = drawing.visual_model
            number = visual.getGeometryId(name)
            visual.geometryObjects[number].placement = path.pose(t) * placement
