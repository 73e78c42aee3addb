"""Every kind of joint supports planning, with Pinocchio's torques, by the kernel or CasADi."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from hovi import Solution, plan
from hovi.dynamics.inverse_dynamics_kernel import joints_without_kernel
from hovi.effects import Gravity
from hovi.robot.loading import load_robot
from hovi.robot.space import joint_kinds
from hovi.scene.scene import Scene
from samples.joints import JOINTS
from samples.manifold_robots import chain


def planned(model: pin.Model) -> Solution:
    robot = load_robot(model)
    goal = robot.integrate(robot.neutral(), np.linspace(0.5, -0.4, robot.nv))
    scene = Scene(robot, [Gravity()])
    solution = plan(scene, robot.neutral(), goal, 1.0, intervals=4, limits="none")
    assert solution.success, solution.message
    return solution


def assert_torques_are_pinocchios(solution: Solution) -> None:
    scene = solution.trajectory.scene
    assert scene is not None
    motion = solution.trajectory.sample(np.linspace(0.0, 1.0, 17))
    data = scene.model.createData()
    rows = zip(motion.q, motion.v, motion.a, strict=True)
    expected = np.array([pin.rnea(scene.model, data, *row) for row in rows])
    np.testing.assert_allclose(motion.tau, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("name", JOINTS)
def test_a_planned_motion_has_the_torques_of_rnea(name: str) -> None:
    assert_torques_are_pinocchios(planned(chain([JOINTS["RX"], JOINTS[name], JOINTS["RY"]])))


@pytest.mark.parametrize("name", ["HX", "HelicalUnaligned"])
def test_without_the_kernel_casadi_plans_the_same_motion(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = chain([JOINTS["RX"], JOINTS[name], JOINTS["RY"]])
    assert joints_without_kernel(model) == ()
    by_kernel = planned(model)
    row = joint_kinds.kind_of(model.joints[2])
    monkeypatch.setitem(joint_kinds._BY_NAME, f"JointModel{name}", replace(row, kernel="nowhere"))
    assert joints_without_kernel(model) == ("j1",)
    by_casadi = planned(model)
    assert_torques_are_pinocchios(by_casadi)
    assert by_casadi.cost == pytest.approx(by_kernel.cost, rel=1e-10)
