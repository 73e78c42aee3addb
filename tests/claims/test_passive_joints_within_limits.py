"""Robots with a passive joint swing up within limits that hold them back, by Pinocchio alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi

SAMPLES = 4001
POLE = "cart_pole.urdf", "hinge", [0.0, -np.pi], [0.0, 0.0]
ACROBOT = "two_link.urdf", "shoulder", [-np.pi / 2, 0.0], [np.pi / 2, 0.0]
PENDUBOT = "two_link.urdf", "elbow", [-np.pi / 2, 0.0], [np.pi / 2, 0.0]
SWINGS: list[tuple[tuple[str, str, list[float], list[float]], float, dict[str, Any]]] = [
    (POLE, 1.5, {"q": [[-0.5, 0.5], [-7.0, 7.0]]}),
    (POLE, 2.0, {"tau": [9.0, 1e9]}),
    (POLE, 3.0, {"q": [[-0.4, 0.6], [-7.0, 7.0]], "v": 20.0}),
    (ACROBOT, 5.0, {"v": 12.0}),
    (ACROBOT, 6.0, {"v": 10.0}),
    (PENDUBOT, 2.0, {"v": 7.0}),
    (PENDUBOT, 2.0, {"tau": 12.0}),
    (PENDUBOT, 4.0, {"v": 7.0}),
]


@pytest.mark.parametrize(("swing", "duration", "limits"), SWINGS)
def test_a_swing_up_keeps_its_limits_without_torque_at_the_passive_joint(
    swing: tuple[str, str, list[float], list[float]], duration: float, limits: dict[str, Any]
) -> None:
    file, passive, start, goal = swing
    robot = hovi.load_robot(hovi.example(file))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()], passive=[passive])
    found = hovi.plan(scene, start, goal, duration, limits={"base": "none", **limits}, starts=1)
    assert found.success, found.message
    at = found.trajectory.sample(np.linspace(0.0, duration, SAMPLES))
    model, data = robot.model, robot.model.createData()
    tau = np.array([pin.rnea(model, data, *x) for x in zip(at.q, at.v, at.a, strict=True)])
    assert np.abs(tau[:, robot.joint_names.index(passive)]).max() < 2e-2 * np.abs(tau).max()
    for values, limit in ((at.q, "q"), (at.v, "v"), (tau, "tau")):
        if limit in limits:
            bounds = np.array(limits[limit])
            low, high = bounds.T if bounds.ndim == 2 else (-bounds, bounds)
            room = 2e-6 * (high - low)
            assert np.all((values > low - room) & (values < high + room))


@pytest.mark.parametrize("limits", [{"q": [[-0.6, 0.6], [-7.0, 7.0]]}, {"v": 12.0}])
def test_limits_that_hardly_bind_take_hardly_more_steps(limits: dict[str, Any]) -> None:
    """The equations of the passive joint are satisfied by the steps themselves."""
    file, passive, start, goal = POLE
    scene = hovi.Scene(
        hovi.load_robot(hovi.example(file)), [hovi.effects.Gravity()], passive=[passive]
    )
    asked: dict[str, Any] = {"limits": {"base": "none", **limits}, "starts": 1}
    free = hovi.plan(scene, start, goal, 1.5, limits="none", starts=1)
    held = hovi.plan(scene, start, goal, 1.5, **asked)
    assert free.success, free.message
    assert held.success, held.message
    assert held.cost == pytest.approx(free.cost, rel=1e-4)
    assert held.nit <= 2 * free.nit
