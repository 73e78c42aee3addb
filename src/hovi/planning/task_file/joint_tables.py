"""Configurations and velocities from tables of joint names."""

from __future__ import annotations

import math
from typing import Any

from hovi.errors import HoviError
from hovi.planning.task_file.messages import Keys, TomlText, spelled
from hovi.robot.robot import Robot


def read_configuration(
    given: list[float] | dict[str, Any] | str, end: Keys, robot: Robot, toml: TomlText
) -> list[float]:
    """A configuration (nq,) from a list, the name of a pose, or a table of all joints.

    In a table the angle of a continuous joint is one number, in [rad].
    """
    if isinstance(given, str):
        try:
            return [float(each) for each in robot.pose(given)]
        except HoviError as unknown:
            raise toml.error((*end, "q"), str(unknown)) from None
    return given if isinstance(given, list) else _by_joint(given, end, robot, toml)


def _by_joint(by_joint: dict[str, Any], end: Keys, robot: Robot, toml: TomlText) -> list[float]:
    left_out = [joint for joint in robot.joint_names if joint not in by_joint]
    _check_joints(by_joint, (*end, "q"), robot, toml)
    if left_out:
        raise toml.error(
            (*end, "q"),
            f"`{spelled(end)}.q` leaves out joint {left_out[0]!r}; it needs every joint",
        )
    q: list[float] = []
    for joint in robot.joint_names:
        joint_model = robot.model.joints[robot.model.getJointId(joint)]
        given = by_joint[joint]
        if (joint_model.nq, joint_model.nv) == (2, 1) and not isinstance(given, list):
            q += [math.cos(given), math.sin(given)]
        else:
            q += _numbers(given, joint_model.nq, (*end, "q", joint), toml)
    return q


def read_rates(by_joint: dict[str, Any], keys: Keys, robot: Robot, toml: TomlText) -> list[float]:
    """A velocity or acceleration (nv,) from a table of joints; of those left out it is zero."""
    _check_joints(by_joint, keys, robot, toml)
    v: list[float] = []
    for joint in robot.joint_names:
        size = robot.model.joints[robot.model.getJointId(joint)].nv
        v += _numbers(by_joint.get(joint, [0.0] * size), size, (*keys, joint), toml)
    return v


def _check_joints(by_joint: dict[str, Any], keys: Keys, robot: Robot, toml: TomlText) -> None:
    for joint in by_joint:
        if joint not in robot.joint_names:
            sentence = f"`{spelled(keys)}` names joint {joint!r}, which the robot does not have; "
            raise toml.error((*keys, joint), sentence + robot.hint(joint))


def _numbers(value: Any, size: int, keys: Keys, toml: TomlText) -> list[float]:
    numbers = [float(each) for each in value] if isinstance(value, list) else [float(value)]
    if len(numbers) != size:
        expected = "one number" if size == 1 else f"{size} numbers"
        raise toml.error(keys, f"`{spelled(keys)}` must be {expected}, but it has {len(numbers)}")
    return numbers
