"""An axis of random configurations within the limits of the robot's joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.errors import SceneError
from hovi.robot.robot import Robot
from hovi.study.axes.samplers import samples_in_box
from hovi.study.cells.axis import Axis, Rows
from hovi.study.cells.field_path import FieldPath

Array = npt.NDArray[np.float64]


def configurations(
    fields: Sequence[FieldPath], robot: Robot, share: float, count: int, seed: int, sampler: str
) -> Axis:
    """Random configurations, such as for goal.q.

    A joint with limits is between them, or in the middle `share` of its range; one without, or
    with a range of more than a turn, within half a turn of 0.
    fields: one, that of a configuration. sampler: as for samples_in_box.
    Raises SceneError for several fields and for robots whose base or joints have orientations.
    """
    if len(fields) != 1:
        raise SceneError("the study's random configurations need one field, such as goal.q.")
    angles = robot.space.angles
    plain, plain_v = robot.space.plain
    if len(plain) + len(angles) != robot.nv:
        raise SceneError(
            f"robot {robot.name!r} has joints with orientations, for which the study has no random "
            "configurations: sample the fields of the others by their limits, or give a table."
        )
    lower, upper = np.full(robot.nv, -np.pi), np.full(robot.nv, np.pi)
    low, high = robot.lower[plain], robot.upper[plain]
    bounded = (high - low < 2 * np.pi) & (low <= high)
    middle, half = (low + high) / 2, share * (high - low) / 2
    lower[plain_v] = np.where(bounded, middle - half, -share * np.pi)
    upper[plain_v] = np.where(bounded, middle + half, share * np.pi)
    samples = samples_in_box(sampler, lower, upper, count, seed)
    return Axis(tuple(fields), Rows(_on_robot(robot, samples), _as_list), True)


def _on_robot(robot: Robot, tangents: Array) -> Array:
    """Configurations (M, nq) from coordinates of joints, angles among them, (M, nv)."""
    plain, plain_v = robot.space.plain
    q = np.tile(robot.neutral(), (len(tangents), 1))
    q[:, plain] = tangents[:, plain_v]
    for factor in robot.space.angles:
        angle = tangents[:, factor.v].reshape(len(tangents))
        q[:, factor.q] = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return q


def _as_list(row: list[float]) -> tuple[Any, ...]:
    return (row,)
