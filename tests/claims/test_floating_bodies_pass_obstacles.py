"""Floating bodies that turn and pass a ball, whatever limits them, by Coal."""

from __future__ import annotations

from typing import Any

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from samples.floating_arm import BALL, flight, floating

Array = npt.NDArray[np.float64]
MARGIN = 0.01
LIMITS: dict[str, Any] = {"none": "none", "speeds": {"base": "none", "v": 5.0}}


@pytest.mark.parametrize("limits", LIMITS)
def test_a_floating_arm_passes_a_ball(limits: str) -> None:
    """By Coal, at 2,001 samples of the motion, which touches the margin."""
    robot = floating()
    scene, (start, goal) = hovi.Scene(robot, [hovi.effects.Gravity()]), flight(robot)
    given = {"limits": LIMITS[limits], "obstacles": [BALL], "self_collision": False}
    found = hovi.plan(scene, start, goal, 1.5, starts=1, **given)
    assert found.success, found.message
    least = least_distance(robot, found.trajectory.configurations(np.linspace(0.0, 1.5, 2001)))
    assert MARGIN - 1e-6 <= least <= MARGIN + 2e-4


def least_distance(robot: hovi.Robot, q: Array) -> float:
    geometry, data, least = robot.collision, robot.model.createData(), np.inf
    assert geometry is not None
    places = geometry.createData()
    ((body, at),) = BALL.bodies()
    for one in q:
        pin.updateGeometryPlacements(robot.model, data, geometry, places, one)
        for i, shape in enumerate(geometry.geometryObjects):
            here = coal.Transform3s(places.oMg[i].rotation, places.oMg[i].translation)
            result = coal.DistanceResult()
            given = body, at, coal.DistanceRequest(), result
            least = min(least, coal.distance(shape.geometry, here, *given))
    return float(least)
