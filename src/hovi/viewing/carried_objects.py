"""Objects that are carried in parts of a motion, on the page: with their link, and at rest.

A copy stands where an object is taken, until then, and one where it is released, from then on:
until it is taken there again, or to the end where another one like it is taken elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass
from hovi.viewing.highlights import node_name
from hovi.viewing.recorded_limits import carried_parts

if TYPE_CHECKING:
    from pinocchio.visualize import MeshcatVisualizer

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Track = tuple[Array, Mask]
"""Times in [s], and whether something is shown from then on, (K,) each."""

SAME_PLACE = 1e-3
"""Largest distance, in [m], at which an object is taken where it was released."""


@dataclass(frozen=True, eq=False)
class _Standing:
    """An object at rest. frame: its link. q: the configuration that put it there, (nq,).

    begin, end: from when until when it stands there, in [s].
    """

    frame: str
    q: Array
    begin: float
    end: float


@dataclass(frozen=True, eq=False)
class CarriedObjects:
    """What is carried in parts of a motion.

    parts: from when until when each object is carried, in [s], by the name of its link.
    standing: where these are otherwise. duration: of the motion, in [s].
    """

    parts: dict[str, list[tuple[float, float]]]
    standing: tuple[_Standing, ...]
    duration: float

    @classmethod
    def of(cls, trajectory: Trajectory, robot: Robot) -> CarriedObjects:
        """Those of a motion."""
        parts = dict[str, list[tuple[float, float]]]()
        for name, begin, end in carried_parts(trajectory):
            if name in robot.frame_names:
                parts.setdefault(name, []).append((begin, end))
        found = (
            x for name, each in parts.items() for x in _standing(trajectory, robot, name, each)
        )
        return cls(parts, tuple(found), trajectory.duration)

    def added_to(self, visual: pin.GeometryModel, robot: Robot) -> pin.GeometryModel:
        """The drawn objects with a copy of each where it stands."""
        if not self.standing:
            return visual
        both, data = visual.copy(), robot.model.createData()
        for number, each in enumerate(self.standing):
            pin.forwardKinematics(robot.model, data, each.q)
            for k, item in enumerate(_shapes_of(visual, robot, each.frame)):
                copy = item.copy()
                copy.name = f"standing {number} {k}"
                copy.placement = data.oMi[item.parentJoint] * item.placement
                copy.parentJoint = copy.parentFrame = 0
                both.addGeometryObject(copy)
        return both

    def changes(self, visualizer: MeshcatVisualizer, robot: Robot) -> dict[str, Track]:
        """When each object, and each copy that stands somewhere, is shown, by node name."""
        visual, found = visualizer.visual_model, dict[str, Track]()
        for name, parts in self.parts.items():
            for item in _shapes_of(visual, robot, name):
                found[node_name(visualizer, item)] = _track(parts)
        for number, each in enumerate(self.standing):
            for item in visual.geometryObjects:
                if item.name.startswith(f"standing {number} "):
                    end = np.inf if each.end >= self.duration else each.end
                    found[node_name(visualizer, item)] = _track([(each.begin, end)])
        return found


def _standing(
    trajectory: Trajectory, robot: Robot, name: str, parts: list[tuple[float, float]]
) -> Iterator[_Standing]:
    """Where an object stands. parts: in which it is carried, in order of time."""
    T, times = trajectory.duration, np.array(parts)
    taken, released = (trajectory.configurations(each) for each in times.T)
    places = [robot.frame_positions((name,), q)[:, 0] for q in (taken, released)]
    for k, (begin, end) in enumerate(parts):
        before = parts[k - 1][1] if k > 0 else 0.0
        moved = k > 0 and np.linalg.norm(places[0][k] - places[1][k - 1]) > SAME_PLACE
        if begin > before and (k == 0 or moved):
            yield _Standing(name, taken[k], before, begin)
        again = k + 1 < len(parts) and (
            np.linalg.norm(places[0][k + 1] - places[1][k]) <= SAME_PLACE
        )
        until = parts[k + 1][0] if again else T
        if until > end:
            yield _Standing(name, released[k], end, until)


def _shapes_of(visual: pin.GeometryModel, robot: Robot, name: str) -> list[pin.GeometryObject]:
    """The drawn shapes of a link."""
    frame = robot.model.getFrameId(name)
    return [each for each in visual.geometryObjects if each.parentFrame == frame]


def _track(parts: list[tuple[float, float]]) -> Track:
    """When something is shown that is so in parts of a motion, in [s]."""
    times, flags = [0.0], [False]
    for begin, end in parts:
        for time, shown in ((begin, True), (end, False)):
            if time == times[-1]:
                flags[-1] = shown
            elif np.isfinite(time):
                times.append(time)
                flags.append(shown)
    return np.array(times), np.array(flags)
