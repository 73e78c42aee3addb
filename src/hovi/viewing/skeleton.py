"""A stick figure for robots without visual models: balls at joints, bars between them."""

from __future__ import annotations

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

Array = npt.NDArray[np.float64]

_BALL = np.array([0.84, 0.37, 0.0, 1.0])
_BAR = np.array([0.0, 0.45, 0.70, 1.0])
_THICKNESS = 0.025


def skeleton(model: pin.Model) -> pin.GeometryModel:
    """Balls at the joints of a model, and bars that connect them.

    Bars lead from each joint to its child joints and body frames. Their thickness is proportional
    to the longest of them.
    """
    bars = [*_to_next_joints(model), *_to_frames(model)]
    longest = max((float(np.linalg.norm(end)) for _, end in bars), default=0.0)
    radius = _THICKNESS * (longest or 1.0)
    geometry = pin.GeometryModel()
    for joint in range(1, model.njoints):
        _add(geometry, joint, pin.SE3.Identity(), coal.Sphere(1.6 * radius), _BALL)
    for joint, end in bars:
        length = float(np.linalg.norm(end))
        if length > radius:
            rotation = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), end).matrix()
            _add(geometry, joint, pin.SE3(rotation, end / 2), coal.Cylinder(radius, length), _BAR)
    return geometry


def _to_next_joints(model: pin.Model) -> list[tuple[int, Array]]:
    """Parent and position in the parent's frame, of every joint but those on the world."""
    joints = range(1, model.njoints)
    bars = [(model.parents[j], model.jointPlacements[j].translation.copy()) for j in joints]
    return [(parent, end) for parent, end in bars if parent != 0]


def _to_frames(model: pin.Model) -> list[tuple[int, Array]]:
    """The farthest body frame of each joint without child joints: a hand, a tip."""
    parents = set(model.parents)
    ends: dict[int, Array] = {}
    for frame in model.frames:
        joint, position = frame.parentJoint, frame.placement.translation.copy()
        if joint in parents or frame.type not in (pin.FrameType.BODY, pin.FrameType.OP_FRAME):
            continue
        if np.linalg.norm(position) > np.linalg.norm(ends.get(joint, np.zeros(3))):
            ends[joint] = position
    for joint in set(range(1, model.njoints)) - parents - set(ends):
        ends[joint] = 2 * model.inertias[joint].lever  # the center of mass taken as the middle
    return sorted(ends.items(), key=lambda item: item[0])


def _add(
    geometry: pin.GeometryModel, joint: int, placement: pin.SE3, shape: coal.ShapeBase, color: Array
) -> None:
    name = f"{type(shape).__name__.lower()}_{geometry.ngeoms}"
    item = pin.GeometryObject(name, joint, placement, shape)
    item.meshColor = color
    geometry.addGeometryObject(item)
