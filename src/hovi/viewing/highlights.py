"""Links that stand out in a replay while their joints are at a limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.problem.limit_violation import at_limit
from hovi.planning.problem.limits import KINDS
from hovi.robot.robot import Robot
from hovi.viewing.recorded_limits import imposed_limits

if TYPE_CHECKING:
    from pinocchio.visualize import MeshcatVisualizer

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

AT_LIMIT_NOTE = "a yellow link: its joint is at a limit"
_COLOR = np.array([1.0, 0.85, 0.0, 1.0])  # yellow: light beside blue, orange and grey
_NAME = " at its limit"
_BRIDGED_FRAMES = 4


@dataclass(frozen=True, eq=False)
class Highlights:
    """Which links stand out when: those of joints at a limit of position, velocity or torque.

    A link that ever stands out is drawn twice, and one of the two is hidden at any time: its own
    look comes back whatever it is.

    times: (M,), in [s].
    flags: (M, joints), by number of the joint in the model; none at the end of the motion.
    """

    times: Array
    flags: Mask

    @classmethod
    def of(cls, trajectory: Trajectory, robot: Robot, times: Array) -> Highlights | None:
        """The highlights of a motion at given times; None where no joint is ever at a limit."""
        limits = imposed_limits(trajectory)
        if limits is None:
            return None
        try:
            motion = trajectory.sample(times)
        except InputError:  # joints for which there are no velocities between the nodes
            return None
        by_kind = at_limit(limits, motion, robot)[:, [KINDS.index(k) for k in ("q", "v", "tau")]]
        by_coordinate = _bridged(np.asarray(np.any(by_kind, axis=1)))  # (M, nv)
        by_coordinate[-1] = False
        flags = np.zeros((len(times), robot.model.njoints), dtype=bool)
        for joint in list(robot.model.joints)[1:]:
            own = slice(joint.idx_v, joint.idx_v + joint.nvExtended)  # its leader's if it mimics
            flags[:, joint.id] = by_coordinate[:, own].any(axis=1)
        return cls(times, flags) if flags.any() else None

    def at(self, t: float) -> Mask:
        """Flags by joint at a time, shape (joints,)."""
        index = int(np.searchsorted(self.times, t, side="right")) - 1
        return np.asarray(self.flags[max(index, 0)])

    def with_bright_copies(self, visual: pin.GeometryModel) -> pin.GeometryModel:
        """The drawn objects, and a yellow copy of those that ever stand out."""
        both = visual.copy()
        for item in list(visual.geometryObjects):
            if self.flags[:, item.parentJoint].any():
                bright = item.copy()
                bright.name = item.name + _NAME
                bright.meshColor, bright.overrideMaterial = _COLOR, True
                bright.meshPath = ""  # its triangles alone take less room than its file
                both.addGeometryObject(bright)
        return both

    def show(self, visualizer: MeshcatVisualizer, t: float) -> None:
        """Make the page show the links as they are at a time."""
        flags = self.at(t)
        for plain, bright, joint in _pairs(visualizer):
            for node, visible in ((plain, not flags[joint]), (bright, bool(flags[joint]))):
                visualizer.viewer[node].set_property("visible", visible)

    def changes(self, visualizer: MeshcatVisualizer) -> dict[str, tuple[Array, Mask]]:
        """When each object that is drawn twice appears and vanishes, by its node's name.

        Times, the first of all included, and whether it is visible from then on, (K,) each.
        """
        changes = {}
        for plain, bright, joint in _pairs(visualizer):
            flag = self.flags[:, joint]
            keys = np.flatnonzero(np.concatenate([[True], flag[1:] != flag[:-1]]))
            changes[plain] = self.times[keys], ~flag[keys]
            changes[bright] = self.times[keys], flag[keys]
        return changes


def node_name(visualizer: MeshcatVisualizer, item: pin.GeometryObject) -> str:
    """What meshcat calls a drawn object."""
    return str(visualizer.getViewerNodeName(item, pin.GeometryType.VISUAL))


def _bridged(flags: Mask) -> Mask:
    """Flags (M, n) without gaps that are too short to be seen as more than a flicker."""
    k, ends = _BRIDGED_FRAMES, ((_BRIDGED_FRAMES,) * 2, (0, 0))
    windows = np.lib.stride_tricks.sliding_window_view
    wide = windows(np.pad(flags, ends), 2 * k + 1, axis=0).any(axis=-1)
    closed = windows(np.pad(wide, ends), 2 * k + 1, axis=0).all(axis=-1)
    return np.asarray(flags | closed)


def _pairs(visualizer: MeshcatVisualizer) -> list[tuple[str, str, int]]:
    """Nodes of an object and of its bright copy, and the joint that carries them."""
    items = list(visualizer.visual_model.geometryObjects)
    node = {item.name: node_name(visualizer, item) for item in items}
    return [
        (node[item.name], node[item.name + _NAME], item.parentJoint)
        for item in items
        if item.name + _NAME in node
    ]
