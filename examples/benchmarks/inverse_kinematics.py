"""Inverse kinematics of random reachable poses, and of poses out of reach, on five arms.

Poses are those of random configurations within the limits of the URDFs, and within a turn. All
configurations found are compared with Pinocchio's forward kinematics. Poses out of reach are the
same ones, moved away from the arm to 1.02 times the largest distance of all. Times are those of the
processor, for all configurations of a pose.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

import hovi
from hovi.errors import UnreachableError

Array = npt.NDArray[np.float64]

ARMS = {"ur5": "tool0", "panda": "panda_hand_tcp", "kinova": "j2s6s200_end_effector"}
ARMS |= {"xarm7": "link_eef", "z1": "link06"}
POSES, OUT_OF_REACH = 1000, 100
AWAY = 1.02


@dataclass
class Results:
    """Of one arm: times in [s], and the largest errors in [m] and [rad]."""

    times: list[float]
    refusals: list[float]
    counts: list[int]
    errors: Array
    solved: int = 0


def random_configurations(robot: hovi.Robot, count: int) -> Array:
    """Within the limits and within a turn, shape (count, nq)."""
    limits, random = hovi.as_limits(robot, "urdf"), np.random.default_rng(1)
    low, high = np.maximum(limits.lower[0], -np.pi), np.minimum(limits.upper[0], np.pi)
    angles = low + (high - low) * random.random((count, robot.nv))
    return robot.integrate(np.tile(robot.neutral(), (count, 1)), angles)


def timed(function: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
    """What a function returns, None if there is no configuration, and its time in [s]."""
    began = time.process_time()
    try:
        result = function(*arguments)
    except UnreachableError:
        result = None
    return result, time.process_time() - began


def errors(robot: hovi.Robot, frame: str, found: Array, pose: Array) -> Array:
    """The largest distance and angle from a pose, by Pinocchio."""
    data, index = robot.model.createData(), robot.model.getFrameId(frame)
    largest = np.zeros(2)
    for q in found:
        pin.forwardKinematics(robot.model, data, q)
        place = pin.updateFramePlacement(robot.model, data, index)
        angle = np.linalg.norm(pin.log3(place.rotation.T @ pose[:3, :3]))
        miss = [np.linalg.norm(place.translation - pose[:3, 3]), angle]
        largest = np.maximum(largest, miss)
    return largest


def measured(name: str, poses: int) -> Results:
    """The results of one arm."""
    robot, frame = hovi.load_robot(name), ARMS[name]
    targets = robot.frame_pose(frame, random_configurations(robot, poses))
    results = Results([], [], [], np.zeros(2))
    for pose in targets:
        found, seconds = timed(hovi.inverse_kinematics, robot, hovi.FrameGoal(frame, pose))
        results.times.append(seconds)
        if found is None:
            continue
        results.solved += 1
        results.counts.append(len(found))
        results.errors = np.maximum(results.errors, errors(robot, frame, found, pose))
    distance = np.linalg.norm(targets[:, :3, 3], axis=1)
    for pose, away in zip(targets[:OUT_OF_REACH], distance, strict=False):
        pose[:3, 3] *= AWAY * distance.max() / away
        found, seconds = timed(hovi.inverse_kinematics, robot, hovi.FrameGoal(frame, pose))
        assert found is None, name
        results.refusals.append(seconds)
    return results


def main(poses: int) -> None:
    """Print the table."""
    print("| arm | joints | solved | largest error | configurations | time | refused in |")
    print("|---|---:|---:|---:|---:|---:|---:|")
    for name, frame in ARMS.items():
        robot = hovi.load_robot(name)
        found = measured(name, poses)
        ms, refused = 1e3 * np.array(found.times), 1e3 * np.array(found.refusals)
        low, middle, high = np.quantile(found.counts, [0, 0.5, 1]).astype(int)
        joints = int(np.count_nonzero(moved(robot, frame)))
        print(
            f"| {name} | {joints} | {100 * found.solved / poses:.1f} % | {found.errors[0]:.0e} m, "
            f"{found.errors[1]:.0e} rad | {low} to {high}, median {middle} | median "
            f"{np.median(ms):.2f} ms, 99 % below {np.quantile(ms, 0.99):.1f} ms | median "
            f"{np.median(refused):.1f} ms, at most {refused.max():.1f} ms |",
            flush=True,
        )


def moved(robot: hovi.Robot, frame: str) -> Array:
    """Which joints move a frame: by its Jacobian somewhere."""
    q = random_configurations(robot, 1)[0]
    data = robot.model.createData()
    J = pin.computeFrameJacobian(robot.model, data, q, robot.model.getFrameId(frame))
    return np.asarray(np.abs(J).max(axis=0))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else POSES)
