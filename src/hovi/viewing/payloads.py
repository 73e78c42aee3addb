"""Payloads of a scene as balls on the page: where they are fixed, and in which segments."""

from __future__ import annotations

from typing import TYPE_CHECKING

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.measures.motion_segments import motion_segments
from hovi.discrete.trajectory import Trajectory
from hovi.robot.model import frame_named
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass
from hovi.viewing.carried_objects import CarriedObjects

if TYPE_CHECKING:
    from pinocchio.visualize import MeshcatVisualizer

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

_COLOR = np.array([0.0, 0.62, 0.45, 1.0])
_DENSITY = 500.0  # [kg/m^3], of wood: large enough to be seen next to a hand
_Key = tuple[str, float, tuple[float, ...]]


@dataclass(frozen=True, eq=False)
class Payloads:
    """The payloads of a motion: frame, mass and center of each, and when it is carried.

    items: distinct payloads. carried: (K,) pairs of times and flags for each, as keyframes.
    """

    items: tuple[_Key, ...] = ()
    carried: tuple[tuple[Array, Mask], ...] = ()

    @classmethod
    def of(cls, trajectory: Trajectory) -> Payloads:
        """Those of the scene, or of the scenes of all segments.

        In a segment that carries objects, which are drawn, those of the one before it.
        """
        parts = trajectory.segments
        scenes = [trajectory.scene] if parts is None else list(parts.scenes)
        carried = [_payloads(scene) for scene in scenes if scene is not None]
        begins = np.zeros(1)
        if parts:
            segments = motion_segments(trajectory)
            begins, ends = np.array([each[1:3] for each in segments]).T
            carried = _besides(carried, CarriedObjects.of(trajectory).acting(begins, ends))
        items = tuple(dict.fromkeys(item for each in carried for item in each))
        flags = [np.array([item in each for each in carried]) for item in items]
        return cls(items, tuple((begins, each) for each in flags))

    def added_to(self, visual: pin.GeometryModel, robot: Robot) -> pin.GeometryModel:
        """The drawn objects with a ball for each payload, as large as its mass."""
        if not self.items:
            return visual
        both = visual.copy()
        for k, (name, mass, center) in enumerate(self.items):
            frame = frame_named(robot.model, name)
            at = frame.placement * pin.SE3(np.eye(3), np.array(center, dtype=float))
            radius = (3.0 * max(mass, 1e-6) / (4.0 * np.pi * _DENSITY)) ** (1.0 / 3.0)
            item = pin.GeometryObject(_name(k), frame.parentJoint, at, coal.Sphere(radius))
            item.meshColor = _COLOR
            both.addGeometryObject(item)
        return both

    def changes(self, visualizer: MeshcatVisualizer) -> dict[str, tuple[Array, Mask]]:
        """Visibility of the payloads that are not carried all the time, by node name."""
        found = {}
        for k, (times, flags) in enumerate(self.carried):
            if not flags.all():
                number = visualizer.visual_model.getGeometryId(_name(k))
                item = visualizer.visual_model.geometryObjects[number]
                node = str(visualizer.getViewerNodeName(item, pin.GeometryType.VISUAL))
                found[node] = times, flags
        return found


def _name(k: int) -> str:
    return f"payload {k}"


def _besides(carried: list[tuple[_Key, ...]], objects: Mask) -> list[tuple[_Key, ...]]:
    """Payloads by segment, without the mass of objects. objects: whether it carries any, (S,)."""
    alone = [each for each, also in zip(carried, objects, strict=True) if not also]
    last, found = alone[0] if alone else (), list[tuple[_Key, ...]]()
    for each, also in zip(carried, objects, strict=True):
        last = last if also else each
        found.append(last)
    return found


def _payloads(scene: Scene) -> tuple[_Key, ...]:
    """Frame, mass and center of the payloads of a scene that weigh something."""
    found = [each for each in scene.effects if each.key == "payload"]
    keys = [(each.frame, each.mass, tuple(each.center)) for each in found]  # type: ignore[attr-defined]
    return tuple(key for key in keys if key[1] > 0)
