"""Random tasks that keep a condition on the way, with a way and its least time found without hovi.

A way is followed by inverse kinematics from a start that can be held. Its least time within the
limits on velocities and torques, and below a speed of the tool, is that of the largest profile of
the squared rate of the path parameter [PhamPham2018]. Poses and torques are Pinocchio's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from random_arms import HOLDING_FRACTION, rnea, torque_model
from scipy.interpolate import CubicSpline
from scipy.optimize import linprog

import hovi
from hovi.conditions import Keep, OnLine, OnPlane, ToolSpeed, Upright

Array = npt.NDArray[np.float64]

LENGTHS = 0.1, 0.4
"""Range of the distances from start to goal, in [m]."""
LEAST_SLOPE = 0.05
"""Least singular value of what the way keeps in the joints: it keeps away from singularities."""
INSIDE = 0.05
"""Distance of the way from limits on positions, in [rad]."""
RESERVE, SLOWER = 1.25, 1.6
"""Range of the durations, in least times of the way."""
SPEED, ROOM = 0.25, np.deg2rad(5.0)
WAYPOINTS, PROFILE = 81, 120
MAX_TRIES = 4000

KINDS: dict[str, Callable[[str], list[Keep]]] = {
    "line": lambda frame: [OnLine(frame)],
    "plane": lambda frame: [OnPlane(frame)],
    "upright within 5 deg": lambda frame: [Upright(frame, within=float(ROOM))],
    "line at 0.25 m/s": lambda frame: [OnLine(frame), ToolSpeed(frame, SPEED)],
    "line and upright": lambda frame: [OnLine(frame), Upright(frame)],
}
"""What each kind of task keeps."""


@dataclass(frozen=True)
class KeptTask:
    """start: (nq,). place: of the frame at the goal, in [m]. duration, least time: in [s]."""

    start: Array
    place: Array
    duration: float
    least: float


def random_tasks(
    scene: hovi.Scene,
    kind: str,
    count: int,
    seed: int,
    apart: Callable[[Array], bool] = lambda way: True,
) -> list[KeptTask]:
    """Tasks of one kind whose way is within limits.

    apart: whether links are apart along a way, (WAYPOINTS, nq).
    """
    rng, found = np.random.default_rng(seed), []
    for _ in range(MAX_TRIES):
        if len(found) == count:
            break
        task = _random_task(scene, scene.robot.tip_frames[0], kind, rng, apart)
        if task is not None:
            found.append(task)
    return found


def pose(model: pin.Model, frame: str, q: Array) -> Array:
    """Pose of a frame by Pinocchio, (4, 4)."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return np.asarray(data.oMf[model.getFrameId(frame)].homogeneous.copy())


def _random_task(
    scene: hovi.Scene,
    frame: str,
    kind: str,
    rng: np.random.Generator,
    apart: Callable[[Array], bool],
) -> KeptTask | None:
    robot, model = scene.robot, torque_model(scene)
    wide = robot.upper - robot.lower > 2 * np.pi
    low = np.where(wide, np.maximum(robot.lower, -np.pi), robot.lower) + INSIDE
    high = np.where(wide, np.minimum(robot.upper, np.pi), robot.upper) - INSIDE
    q = rng.uniform(low, high)
    aside = rng.normal(size=3)
    aside *= rng.uniform(*LENGTHS) / np.linalg.norm(aside)
    first = pose(model, frame, q)
    if kind == "plane":  # that hovi keeps by default is horizontal
        aside[2] = 0.0
    if not _can_be_held(model, robot, q):
        return None
    way = _way(model, frame, q, aside, (low, high), upright="upright" in kind)
    if way is None or not _can_be_held(model, robot, way[-1]):
        return None
    curve = CubicSpline(np.linspace(0.0, 1.0, len(way)), way)
    least = _least_time(model, robot, curve, frame, SPEED if "m/s" in kind else np.inf)
    if least is None or not apart(way):
        return None
    duration = least * rng.uniform(RESERVE, SLOWER)
    return KeptTask(q, first[:3, 3] + aside, float(duration), least)


def _can_be_held(model: pin.Model, robot: hovi.Robot, q: Array) -> bool:
    zero = np.zeros((1, robot.nv))
    holding = np.abs(rnea(model, q[None], zero, zero)[0])
    return bool((holding <= HOLDING_FRACTION * robot.effort_limit).all())


def _way(
    model: pin.Model, frame: str, q: Array, aside: Array, bounds: tuple[Array, Array], upright: bool
) -> Array | None:
    """Configurations along a straight way of a frame, (WAYPOINTS, nq); None where it ends early.

    upright: whether the axis that points up at first keeps doing so.
    """
    data, number = model.createData(), model.getFrameId(frame)
    first = pose(model, frame, q)
    axis, way = first[:3, :3].T @ [0.0, 0.0, 1.0], [q]
    for s in np.linspace(0.0, 1.0, WAYPOINTS)[1:]:
        for _ in range(8):
            pin.framesForwardKinematics(model, data, q)
            at, world = data.oMf[number], pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            J = pin.computeFrameJacobian(model, data, q, number, world)
            missed, rows = at.translation - first[:3, 3] - s * aside, J[:3]
            if upright:
                up = at.rotation @ axis
                missed = np.append(missed, up[:2])
                rows = np.vstack([rows, (-pin.skew(up) @ J[3:])[:2]])
            if np.abs(missed).max() < 1e-10:
                break
            if np.linalg.svd(rows, compute_uv=False)[-1] < LEAST_SLOPE:
                return None
            step = -np.linalg.pinv(rows) @ missed
            if np.abs(step).max() > 0.3:
                return None
            q = q + step
        else:
            return None
        if (q < bounds[0]).any() or (q > bounds[1]).any():
            return None
        way.append(q)
    return np.array(way)


def _least_time(
    model: pin.Model, robot: hovi.Robot, curve: CubicSpline, frame: str, speed: float
) -> float | None:
    """The least time of a path from rest to rest, in [s]; None where it cannot be held.

    Limits are linear in u = s'' and x = s'^2: see [PhamPham2018].
    """
    s, ds = np.linspace(0.0, 1.0, PROFILE, retstep=True)
    q, first, second = curve(s), curve(s, 1), curve(s, 2)
    zero = np.zeros_like(q)
    gravity = rnea(model, q, zero, zero)
    a = rnea(model, q, zero, first) - gravity
    b = rnea(model, q, first, second) - gravity
    x_max = np.min((robot.velocity_limit / np.maximum(np.abs(first), 1e-9)) ** 2, axis=1)
    if np.isfinite(speed):
        places = np.array([pose(model, frame, each)[:3, 3] for each in q])
        x_max = np.minimum(
            x_max, (speed / np.linalg.norm(np.gradient(places, s, axis=0), axis=1)) ** 2
        )
    room = robot.effort_limit
    if (np.abs(gravity) >= room).any():
        return None
    # the largest x from which the path can be left at rest, from its end
    reach = np.zeros(PROFILE)
    for i in range(PROFILE - 2, -1, -1):
        rows = np.concatenate([np.stack([a[i], b[i]], 1), -np.stack([a[i], b[i]], 1)])
        most = np.concatenate([room - gravity[i], room + gravity[i]])
        nxt = np.array([[2 * ds, 1.0], [-2 * ds, -1.0]])
        found = linprog(
            [0.0, -1.0],
            np.vstack([rows, nxt]),
            np.append(most, [reach[i + 1], 0.0]),
            bounds=[(None, None), (0.0, x_max[i])],
        )
        if not found.success:
            return None
        reach[i] = found.x[1]
    x = np.zeros(PROFILE)
    for i in range(PROFILE - 1):
        rest = np.concatenate([room - gravity[i] - b[i] * x[i], room + gravity[i] + b[i] * x[i]])
        slope = np.concatenate([a[i], -a[i]])
        up = slope > 1e-12
        u = np.min(rest[up] / slope[up], initial=np.inf)
        x[i + 1] = min(reach[i + 1], max(x[i] + 2 * ds * u, 0.0))
    rates = np.sqrt(x)
    total = rates[1:] + rates[:-1]
    return None if (total <= 0.0).any() else float(np.sum(2 * ds / total))
