"""Positions of joint coordinates, for joints with nq = nv."""

from __future__ import annotations

from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.errors import SceneError

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


def positions(robot: Robot, q: ca.SX) -> ca.SX:
    """The position of every coordinate, shape (nv,); zero for joints with nq != nv."""
    entries = [q[index] if index >= 0 else ca.SX(0) for index in _position_indices(robot)]
    return ca.vertcat(*entries)


def positioned(robot: Robot) -> list[int]:
    """The coordinates that have a position."""
    return [i for i, index in enumerate(_position_indices(robot)) if index >= 0]


def require_positions(robot: Robot, what: str, coordinates: npt.NDArray[np.intp]) -> None:
    """Raise SceneError for a coordinate of a joint with nq != nv. what: start of the message."""
    indices = _position_indices(robot)
    for i in coordinates:
        if indices[i] < 0:
            raise SceneError(
                f"{what}: {robot.coordinate_names[i]!r} has no single position (its joint has nq "
                "different from nv); name the other joints only."
            )


def _position_indices(robot: Robot) -> list[int]:
    """Index in q of every velocity coordinate, -1 for joints with nq != nv."""
    indices = [-1] * robot.nv
    for joint in list(robot.model.joints)[1:]:
        if joint.nq == joint.nv:
            for k in range(joint.nv):
                indices[joint.idx_v + k] = joint.idx_q + k
    return indices
