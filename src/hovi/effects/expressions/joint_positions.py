"""Positions of joint coordinates, where a joint has one number of q per number of v."""

from __future__ import annotations

from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.errors import SceneError

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


def positions(robot: Robot, q: ca.SX) -> ca.SX:
    """The position of every coordinate, shape (nv,); zero where a joint has nq != nv."""
    places = [q[place] if place >= 0 else ca.SX(0) for place in _places(robot)]
    return ca.vertcat(*places)


def positioned(robot: Robot) -> list[int]:
    """The coordinates that have a position."""
    return [i for i, place in enumerate(_places(robot)) if place >= 0]


def require_positions(robot: Robot, what: str, coordinates: npt.NDArray[np.intp]) -> None:
    """Raise SceneError for a coordinate of a joint with nq != nv. what: begins the sentence."""
    places = _places(robot)
    for i in coordinates:
        if places[i] < 0:
            raise SceneError(
                f"{what}: {robot.coordinate_names[i]!r} has no single position (its joint has nq "
                "different from nv); name the other joints only."
            )


def _places(robot: Robot) -> list[int]:
    """Place in q of every velocity coordinate, -1 where there is none."""
    places = [-1] * robot.nv
    for joint in list(robot.model.joints)[1:]:
        if joint.nq == joint.nv:
            for k in range(joint.nv):
                places[joint.idx_v + k] = joint.idx_q + k
    return places
