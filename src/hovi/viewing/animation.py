"""The keyframes of a motion: where each drawn object is at each time."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.viewing.carried_objects import CarriedObjects
from hovi.viewing.highlights import node_name
from hovi.viewing.recorded_limits import MovingObjects

with warnings.catch_warnings():
    # meshcat imports a deprecated module of ZeroMQ that hovi does not use.
    warnings.simplefilter("ignore", DeprecationWarning)
    import meshcat
    import meshcat.animation
    from pinocchio.visualize import MeshcatVisualizer

Array = npt.NDArray[np.float64]

_FRAME_RATE = 60.0
_MAX_FRAMES = 20_000


def placements_at(
    visualizer: MeshcatVisualizer, trajectory: Trajectory, times: Array
) -> list[list[pin.SE3]]:
    """Placement of every drawn object at each time (M,)."""
    model, visual = visualizer.model, visualizer.visual_model
    data, visual_data = model.createData(), visual.createData()
    moving, placements = MovingObjects.of(trajectory), []
    for t, configuration in zip(times, trajectory.configurations(times), strict=True):
        moving.place(visualizer, float(t))
        pin.updateGeometryPlacements(model, data, visual, visual_data, configuration)
        placements.append([placement.copy() for placement in visual_data.oMg])
    carried = CarriedObjects.of(trajectory)
    for number, poses in _resting(visualizer, trajectory, carried, times).items():
        for at_time, pose in zip(placements, poses, strict=True):
            at_time[number] = pose
    return placements


def display_at(
    visualizer: MeshcatVisualizer, trajectory: Trajectory, carried: CarriedObjects, t: float
) -> None:
    """Show the robot at a time, and what it carries where it lies then."""
    visualizer.display(trajectory.configurations(t)[0])
    for number, (pose,) in _resting(visualizer, trajectory, carried, np.array([t])).items():
        item = visualizer.visual_model.geometryObjects[number]
        visualizer.viewer[node_name(visualizer, item)].set_transform(pose.homogeneous)


def _resting(
    visualizer: MeshcatVisualizer, trajectory: Trajectory, carried: CarriedObjects, times: Array
) -> dict[int, list[pin.SE3]]:
    """Placements of what is carried in parts of the motion, by number: elsewhere it lies still."""
    found = dict[int, list[pin.SE3]]()
    if not carried.parts:
        return found
    model, visual = visualizer.model, visualizer.visual_model
    data = model.createData()
    for number, link in carried.drawn(model, visual).items():
        item, poses = visual.geometryObjects[number], []
        for q in trajectory.configurations(carried.rest(link, times)):
            pin.forwardKinematics(model, data, q)
            poses.append(data.oMi[item.parentJoint] * item.placement)
        found[number] = poses
    return found


def frame_times(trajectory: Trajectory) -> Array:
    """Times of the animation's frames, both ends included, in [s]."""
    frames = int(min(_MAX_FRAMES, math.ceil(trajectory.duration * _FRAME_RATE))) + 1
    return np.linspace(0.0, trajectory.duration, max(frames, 2))


def animation_of(
    motions: Sequence[tuple[Trajectory, MeshcatVisualizer]],
    loop: bool,
    visible: Mapping[str, tuple[Array, npt.NDArray[np.bool_]]],
) -> dict[str, object]:
    """The message that makes a page play motions: keyframe tracks by drawn object, in [s].

    visible: times and flags of the objects that are not always shown, by node name.
    """
    animation = meshcat.animation.Animation()
    for trajectory, visualizer in motions:
        times = frame_times(trajectory)
        placements = placements_at(visualizer, trajectory, times)
        for number, item in enumerate(visualizer.visual_model.geometryObjects):
            poses = [frame[number] for frame in placements]
            rotations = [pin.Quaternion(pose.rotation).coeffs() for pose in poses]
            tracks = {
                "position": _track("position", "vector3", times, [p.translation for p in poses]),
                "quaternion": _track("quaternion", "quaternion", times, rotations),
            }
            name = node_name(visualizer, item)
            if name in visible:
                keys, flags = visible[name]
                tracks["visible"] = _track("visible", "bool", keys, list(flags))
            node = visualizer.viewer[name]
            animation.clips[node.path] = meshcat.animation.AnimationClip(tracks, fps=1)
    repetitions = math.inf if loop else 1
    command = meshcat.commands.SetAnimation(animation, play=True, repetitions=repetitions)
    message: dict[str, object] = command.lower()
    return message


def _track(
    name: str, kind: str, times: Array, values: list[Array]
) -> meshcat.animation.AnimationTrack:
    return meshcat.animation.AnimationTrack(
        name, kind, times.tolist(), [value.tolist() for value in values]
    )
