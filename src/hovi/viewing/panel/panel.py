"""The numbers that a replay page shows next to its scene, as JSON.

Curves of all coordinates over time, their limits, and where joints are; times in [s], positions in
[m], angles in [rad].
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import field
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.problem.limits import KINDS, Limits
from hovi.robot.model import frame_id
from hovi.robot.robot import Robot
from hovi.robot.space.unwrapped_angles import shown_names
from hovi.system.dataclass import dataclass
from hovi.viewing.curves.colors import curve_style
from hovi.viewing.curves.scheme_torque import scheme_torque

Array = npt.NDArray[np.float64]

_CURVE_TIMES = 361
_JOINT_TIMES = 121
_MAX_JOINTS = 40
_DIGITS = 6
_HEADINGS = {
    True: "Joints between their limits",
    False: "Joints, and limits of the URDF (not imposed)",
}


@dataclass(frozen=True)
class Curves:
    """Curves of a motion at evenly spaced times, each array of shape (nv, M).

    q: unwrapped angles, positions and rotation vectors. v, tau: as in `Trajectory.sample`.
    """

    duration: float
    q: Array
    v: Array
    tau: Array

    @classmethod
    def of(cls, trajectory: Trajectory) -> Curves | None:
        """Those of a motion; None where it has no velocities or torques between the nodes."""
        t = np.linspace(0.0, trajectory.duration, _CURVE_TIMES)
        try:
            motion = trajectory.sample(t)
        except InputError:
            return None
        q, torque = trajectory.positions(t), scheme_torque(trajectory, t)
        tau = motion.tau if torque is None else torque
        return cls(trajectory.duration, q.T, motion.v.T, tau.T)

    def to_dict(self) -> dict[str, Any]:
        """The curves, rounded to what a page can show."""
        curves = {"q": _rounded(self.q), "v": _rounded(self.v), "tau": _rounded(self.tau)}
        return {"duration": self.duration, **curves}


@dataclass(frozen=True)
class View:
    """Where the camera looks, and what the scene is about, in the frame of the page's center.

    half: half extents of the box that the motion sweeps, (3,). direction: of the camera, (3,).
    floor: a point on the floor. shift: from the world's origin to the center.
    """

    half: tuple[float, ...] = (1.0, 1.0, 1.0)
    direction: tuple[float, ...] = (1.0, -1.0, 0.4)
    floor: tuple[float, ...] = (0.0, 0.0, -1.0)
    shift: tuple[float, ...] = (0.0, 0.0, 0.0)

    @property
    def size(self) -> float:
        """Half the diagonal of the box, in [m]."""
        return float(np.linalg.norm(self.half))


@dataclass(frozen=True)
class Panel:
    """What a page shows: curves, limits, joints, and the motions that are compared.

    imposed: whether the motion was planned within the limits.
    labels: of the first motion and the others, with their colors; empty for one motion.
    """

    duration: float = 1.0
    speed: float = 1.0
    view: View = field(default_factory=View)
    names: tuple[str, ...] = ()
    angular: tuple[bool, ...] = ()
    curves: Curves | None = None
    others: tuple[Curves, ...] = ()
    limits: Limits | None = None
    imposed: bool = True
    joints: tuple[dict[str, Any], ...] = ()
    labels: tuple[tuple[str, str], ...] = ()
    trace: bool = False

    def to_json(self) -> str:
        """As text that is safe inside a script element."""
        own = None if self.curves is None else self.curves.to_dict()
        names = () if own is None else self.names
        styles = [curve_style(i) for i in range(len(names))]
        data = {
            "duration": self.duration,
            "speed": self.speed,
            "half": _rounded(np.array(self.view.half)),
            "size": round(self.view.size, _DIGITS),
            "view": _rounded(np.array(self.view.direction)),
            "floor": _rounded(np.array(self.view.floor)),
            "shift": _rounded(np.array(self.view.shift)),
            "mark": round(0.13 * self.view.size, _DIGITS),
            "names": names,
            "angular": self.angular,
            "colors": [each.color for each in styles],
            "dashes": [each.dashes for each in styles],
            **({"q": [], "v": [], "tau": []} if own is None else own),
            "others": [each.to_dict() for each in self.others],
            "limits": {kind: self._bounds(kind, len(names)) for kind in ("q", "v", "tau")},
            "heading": _HEADINGS[self.imposed] if self.limits else "Joints",
            "joints": self.joints if names else (),
            "motions": [{"label": label, "color": color} for label, color in self.labels],
            "trace": self.trace,
        }
        text = json.dumps(data, separators=(",", ":"), allow_nan=False)
        return text.replace("<", "\\u003c").replace("\u2028", " ").replace("\u2029", " ")

    def _bounds(self, kind: str, count: int) -> list[list[float | None]]:
        """Lower and upper bound of each coordinate; None where there is none."""
        if self.limits is None:
            return [[None, None]] * count
        row = KINDS.index(kind)
        pairs = zip(self.limits.lower[row], self.limits.upper[row], strict=True)
        return [[float(x) if np.isfinite(x) else None for x in pair] for pair in pairs]


def names_of(trajectory: Trajectory) -> tuple[str, ...]:
    """Names of the coordinates, as they are plotted, shape (nv,)."""
    names, space = trajectory.coordinate_names, trajectory.space
    return tuple(names) if space is None else tuple(shown_names(space, names))


def joints_of(
    trajectory: Trajectory, robot: Robot, limits: Limits | None
) -> tuple[dict[str, Any], ...]:
    """Where each moving joint and tip is over time, and the range of those that turn."""
    model = robot.model
    times = np.linspace(0.0, trajectory.duration, _JOINT_TIMES)
    data, poses = model.createData(), []
    tips = [frame_id(model, name) for name in robot.tip_frames]
    for configuration in trajectory.configurations(times):
        pin.framesForwardKinematics(model, data, configuration)
        poses.append([_pose(data.oMi[j]) for j in range(1, model.njoints)])
        poses[-1] += [_pose(data.oMf[tip]) for tip in tips]
    tracks = np.swapaxes(np.array(poses), 0, 1)  # (joints + tips, M, 7)
    described = [_joint(model, j, robot, limits) for j in range(1, model.njoints)]
    described += [{"name": name, "axis": None, "tip": True} for name in robot.tip_frames]
    pairs = list(zip(described, tracks, strict=True))
    return tuple({**each, "at": _rounded(track)} for each, track in pairs[:_MAX_JOINTS])


def _joint(model: pin.Model, j: int, robot: Robot, limits: Limits | None) -> dict[str, Any]:
    joint = model.joints[j]
    name = {"name": str(model.names[j]), "axis": None}
    if joint.nv != 1 or robot.sliding[joint.idx_v] or joint.nvExtended != 1:
        return name
    data = joint.createData()
    joint.calc(data, pin.neutral(model))
    row = KINDS.index("q")
    low, high = -np.pi, np.pi
    if limits is not None:
        low, high = (float(x[row, joint.idx_v]) for x in (limits.lower, limits.upper))
        low, high = (low, high) if np.isfinite([low, high]).all() else (-np.pi, np.pi)
    axis = [round(float(x), _DIGITS) for x in np.asarray(data.S).reshape(6, -1)[3:, 0]]
    return {**name, "axis": axis, "range": [low, high], "index": int(joint.idx_v)}


def _pose(placement: pin.SE3) -> list[float]:
    return [*placement.translation, *pin.Quaternion(placement.rotation).coeffs()]


def _rounded(values: Array) -> Any:
    """Numbers to a relative 1e-6 of the largest, as nested lists."""
    largest = float(np.abs(values).max(initial=0.0))
    if not np.isfinite(largest) or largest == 0.0:
        return np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0).tolist()
    decimals = _DIGITS - 1 - int(np.floor(np.log10(largest)))
    return np.round(values, max(decimals, 0)).tolist()


def labels_of(trajectories: Sequence[Trajectory]) -> tuple[str, ...]:
    """A short name for each of several motions: what distinguishes them."""
    shown = []
    for k, each in enumerate(trajectories):
        data = each.metadata
        parts = [f"{each.duration:.3g} s", str(data.get("scheme", ""))]
        cost = data.get("cost")
        parts += [f"cost {cost:.4g}"] if isinstance(cost, float) else []
        shown.append(f"{k + 1}: " + ", ".join(part for part in parts if part))
    return tuple(shown)
