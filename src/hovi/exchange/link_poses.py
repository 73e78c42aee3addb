"""The links of a robot along a motion, each relative to the link that it hangs on."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.robot.robot import Robot
from hovi.robot.urdf.check import checked_urdf
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

WORLD = "world"


@dataclass(frozen=True)
class Link:
    """A link of the tree.

    name: of its frame. parent: name of the link it hangs on, or "world". frame, above: numbers of
    both frames in the model. moving: whether a joint lies between them.
    """

    name: str
    parent: str
    frame: int
    above: int
    moving: bool


def links_of(robot: Robot) -> tuple[Link, ...]:
    """The links of the URDF, without a link "world"; the joints of a robot without a URDF.

    Parents are those of the URDF: frames of a model with locked joints do not have them.
    """
    model, parents = robot.model, _parents(robot)
    kind = pin.FrameType.JOINT if robot.source.urdf is None else pin.FrameType.BODY
    frames = {WORLD: 0}
    for i, frame in enumerate(model.frames):
        if frame.type == kind:
            frames.setdefault(frame.name, i)
    links = []
    for name, i in frames.items():
        if name != WORLD:
            parent = parents.get(name, WORLD)
            above = frames[parent]
            moving = model.frames[i].parentJoint != model.frames[above].parentJoint
            links.append(Link(name, parent, i, above, moving))
    return tuple(links)


def _parents(robot: Robot) -> dict[str, str]:
    """The parent of each link but the root, or of each joint of a robot without a URDF."""
    if robot.source.urdf is None:
        names, parents = robot.model.names, robot.model.parents
        return {names[i]: names[parents[i]] for i in range(1, len(names)) if parents[i]}
    joints = checked_urdf(robot.source.urdf).iter("joint")
    ends = ((joint.find("child"), joint.find("parent")) for joint in joints)
    return {
        child.get("link", ""): parent.get("link", "")
        for child, parent in ends
        if child is not None and parent is not None
    }


def link_poses(robot: Robot, links: tuple[Link, ...], q: Array, in_world: bool = False) -> Array:
    """(x, y, z, qx, qy, qz, qw) of each link, at q (M, nq), shape (M, links, 7).

    in_world: in the world, instead of in the link that it hangs on.
    """
    data, poses = robot.model.createData(), np.empty((len(q), len(links), 7))
    for m, configuration in enumerate(q):
        pin.framesForwardKinematics(robot.model, data, configuration)
        for i, link in enumerate(links):
            pose = data.oMf[link.frame]
            poses[m, i] = pin.SE3ToXYZQUAT(pose if in_world else data.oMf[link.above].actInv(pose))
    return poses
