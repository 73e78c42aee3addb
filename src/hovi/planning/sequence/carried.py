"""What segments of a sequence carry: objects that come and go with their mass and their shape.

The shape is a link of the robot in the whole sequence, without mass, whose distances are bounded in
the segments that carry it. The mass is a payload of these segments.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from hovi.effects import Payload
from hovi.errors import InputError
from hovi.planning.obstacles.grasped import Grasped, as_grasped, scene_holding
from hovi.planning.sequence.segment import Segment, names_of
from hovi.robot.model import frame_named
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene


def carried_objects(segments: Sequence[Segment]) -> tuple[Grasped, ...]:
    """The objects that any segment carries; those of one name are one.

    Raises InputError for two different ones of one name.
    """
    found = dict[str, Grasped]()
    for name, segment in zip(names_of(segments), segments, strict=True):
        for each in as_grasped(segment.grasped):
            known = found.setdefault(each.name, each)
            if known.to_dict() != each.to_dict():
                raise InputError(
                    f"{name!r} carries another {each.name!r} than a segment before it: give one of "
                    "them another name, or write the same object in both."
                )
    return as_grasped(tuple(found.values()))


def scene_carrying(scene: Scene, segments: Sequence[Segment]) -> Scene:
    """The scene whose robot has the links of what segments carry, without mass.

    Raises InputError as `holding` does.
    """
    return scene_holding(scene, carried_objects(segments), massless=True)


def parts_of_carried(
    segments: Sequence[Segment], ends: Sequence[float]
) -> list[tuple[str, float, float]]:
    """The name of each object with the times from which and until which it is carried, in [s].

    Segments that follow each other are one part. ends: of the segments, in [s].
    """
    found = list[tuple[str, float, float]]()
    for each in carried_objects(segments):
        begin = 0.0
        for segment, end in zip(segments, ends, strict=True):
            if each.name in [other.name for other in as_grasped(segment.grasped)]:
                if found and found[-1][0] == each.name and found[-1][2] == begin:
                    begin = found.pop()[1]
                found.append((each.name, begin, end))
            begin = end
    return found


def with_payloads(scene: Scene, segments: Sequence[Segment]) -> tuple[Segment, ...]:
    """The segments with the mass of what they carry, besides the payload that acts there.

    Raises InputError for objects, and a payload, that different joints carry in one segment.
    """
    known = [each for each in scene.effects if isinstance(each, Payload)]
    return tuple(
        _with_payload(scene.robot, each, name, known)
        for name, each in zip(names_of(segments), segments, strict=True)
    )


def _with_payload(robot: Robot, segment: Segment, name: str, known: Sequence[Payload]) -> Segment:
    if not segment.grasped:
        return segment
    own = [each for each in segment.effects if isinstance(each, Payload)]
    others = [each for each in segment.effects if not isinstance(each, Payload)]
    bodies = [*(each.payload() for each in as_grasped(segment.grasped)), *(own or known)]
    payload = _together(robot, bodies, name)
    return dataclasses.replace(segment, effects=(*others, payload))


def _together(robot: Robot, payloads: Sequence[Payload], name: str) -> Payload:
    """Payloads at frames of one joint as one. name: of the segment. Raises InputError."""
    if len(payloads) == 1:
        return payloads[0]
    frames = [frame_named(robot.model, each.frame) for each in payloads]
    if len({frame.parentJoint for frame in frames}) > 1:
        named = ", ".join(repr(each.frame) for each in payloads)
        raise InputError(
            f"{name!r} carries bodies at {named}, which different joints move: in one segment, let "
            "links of one joint carry them, or give the others to `grasped` of the whole plan."
        )
    total = pin.Inertia.Zero()
    for frame, each in zip(frames, payloads, strict=True):
        total += (frames[0].placement.inverse() * frame.placement).act(each.body)
    parts = np.asarray(total.inertia)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    center = tuple(total.lever.tolist())
    return Payload(payloads[0].frame, float(total.mass), center, inertia=tuple(parts.tolist()))
