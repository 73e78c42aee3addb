"""Links highlighted in a replay while their joints are at a limit."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.problem.limit_conditions import at_limit
from hovi.planning.problem.limits import KINDS
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass
from hovi.viewing.recorded_limits import imposed_limits

if TYPE_CHECKING:
    from pinocchio.visualize import MeshcatVisualizer

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

AT_LIMIT_NOTE = "A yellow link: its joint is at a limit."
_HIGHLIGHT_COLOR = np.array([1.0, 0.85, 0.0, 1.0])  # yellow: light next to blue, orange and grey
_COPY_SUFFIX = " at its limit"
_BRIDGED_FRAMES = 4
"""Gaps of at most twice this number of frames are closed."""


@dataclass(frozen=True, eq=False)
class Highlights:
    """Which links are highlighted when: those of joints at a position, velocity or torque limit.

    A link that is ever highlighted is drawn twice, plain and yellow, and one of the two is hidden
    at any time; so its own material need not be known to restore it.

    times: (M,), in [s].
    flags: (M, joints), by joint index in the model; all False at the end of the motion.
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
        except InputError:  # the joints have no velocities between the nodes
            return None
        by_kind = at_limit(limits, motion, robot)[:, [KINDS.index(k) for k in ("q", "v", "tau")]]
        by_coordinate = _without_short_gaps(np.asarray(np.any(by_kind, axis=1)))  # (M, nv)
        by_coordinate[-1] = False
        flags = np.zeros((len(times), robot.model.njoints), dtype=bool)
        for joint in list(robot.model.joints)[1:]:
            # A mimic joint has its leader's columns.
            own = slice(joint.idx_v, joint.idx_v + joint.nvExtended)
            flags[:, joint.id] = by_coordinate[:, own].any(axis=1)
        return cls(times, flags) if flags.any() else None

    def at(self, t: float) -> Mask:
        """Flags by joint at time t, shape (joints,)."""
        index = int(np.searchsorted(self.times, t, side="right")) - 1
        return np.asarray(self.flags[max(index, 0)])

    def with_highlighted_copies(
        self, visual: pin.GeometryModel, left_out: Collection[int] = ()
    ) -> pin.GeometryModel:
        """The drawn objects, with a yellow copy of each that is ever highlighted.

        left_out: frames whose objects have none.
        """
        both = visual.copy()
        for item in list(visual.geometryObjects):
            if self.flags[:, item.parentJoint].any() and item.parentFrame not in left_out:
                yellow = item.copy()
                yellow.name = item.name + _COPY_SUFFIX
                yellow.meshColor, yellow.overrideMaterial = _HIGHLIGHT_COLOR, True
                both.addGeometryObject(yellow)
        return both

    def show(self, visualizer: MeshcatVisualizer, t: float) -> None:
        """Show or hide the copies on the page as at time t."""
        flags = self.at(t)
        for plain, yellow, joint in _pairs(visualizer):
            for node, visible in ((plain, not flags[joint]), (yellow, bool(flags[joint]))):
                visualizer.viewer[node].set_property("visible", visible)

    def changes(self, visualizer: MeshcatVisualizer) -> dict[str, tuple[Array, Mask]]:
        """Visibility changes of each object that is drawn twice, by node name.

        Per object: the times, the first frame included, and whether it is visible from then on,
        shape (K,) each.
        """
        changes = {}
        for plain, yellow, joint in _pairs(visualizer):
            flag = self.flags[:, joint]
            keys = np.flatnonzero(np.concatenate([[True], flag[1:] != flag[:-1]]))
            changes[plain] = self.times[keys], ~flag[keys]
            changes[yellow] = self.times[keys], flag[keys]
        return changes


def node_name(visualizer: MeshcatVisualizer, item: pin.GeometryObject) -> str:
    """The meshcat node name of a drawn object."""
    return str(visualizer.getViewerNodeName(item, pin.GeometryType.VISUAL))


def _without_short_gaps(flags: Mask) -> Mask:
    """Flags (M, n) with short gaps closed, which would appear as flicker."""
    k, ends = _BRIDGED_FRAMES, ((_BRIDGED_FRAMES,) * 2, (0, 0))
    windows = np.lib.stride_tricks.sliding_window_view
    wide = windows(np.pad(flags, ends), 2 * k + 1, axis=0).any(axis=-1)
    closed = windows(np.pad(wide, ends), 2 * k + 1, axis=0).all(axis=-1)
    return np.asarray(flags | closed)


def _pairs(visualizer: MeshcatVisualizer) -> list[tuple[str, str, int]]:
    """Nodes of each object and of its yellow copy, and their parent joint."""
    items = list(visualizer.visual_model.geometryObjects)
    node = {item.name: node_name(visualizer, item) for item in items}
    return [
        (node[item.name], node[item.name + _COPY_SUFFIX], item.parentJoint)
        for item in items
        if item.name + _COPY_SUFFIX in node
    ]
