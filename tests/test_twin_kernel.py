"""The kernel of a twin of ordinary joints: Pinocchio's torques, CasADi's derivatives."""

from __future__ import annotations

import pickle

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from hovi.errors import ModelError
from hovi.rigid_body import casadi_functions
from hovi.robot import Robot, load_robot
from hovi.torque_model import CasadiTorque
from hovi.twin_kernel import TwinKernel, joints_without_twin
from manifold_robots import BASES, chain, configurations, with_arm

POINTS = 6


def model_with(base: str) -> pin.Model:
    model = with_arm(base)
    model.gravity.linear = np.array([1.0, 2.0, -9.0])
    armature = np.linspace(0.1, 1.0, model.nv)
    armature[: model.nv - 3] = 0.0
    model.armature = armature
    return model


def casadi_torque(robot: Robot) -> CasadiTorque:
    q, t = ca.SX.sym("q", robot.nq), ca.SX.sym("t")
    v, a = (ca.SX.sym(name, robot.nv) for name in "va")
    tau = casadi_functions(robot.model).inverse_dynamics(q, v, a)
    return CasadiTorque((q, v, a, t), tau, space=robot.space)


@pytest.mark.parametrize("base", BASES)
def test_torques_and_derivatives_are_those_of_rnea_on_the_manifold(base: str) -> None:
    robot = load_robot(model_with(base))
    random = np.random.default_rng(1)
    q = configurations(robot, POINTS)
    v, a, curvature = random.normal(size=(3, POINTS, robot.nv))
    weight = random.uniform(size=robot.nv)
    kernel, reference = TwinKernel(robot.model), casadi_torque(robot)
    data = robot.model.createData()
    rnea = [pin.rnea(robot.model, data, *jet) for jet in zip(q, v, a, strict=True)]
    np.testing.assert_allclose(kernel.torque(q, v, a), rnea, atol=1e-12)
    tau, J, H = kernel.expand(q, v, a, weight, curvature)
    expected = reference.expand(q, v, a, None, weight, curvature)
    np.testing.assert_allclose(tau, rnea, atol=1e-12)
    for found, wanted in ((J, expected[1]), (kernel.linearize(q, v, a)[1], expected[1])):
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-13 * np.abs(wanted).max())
    np.testing.assert_allclose(H, expected[2], rtol=0, atol=1e-13 * np.abs(expected[2]).max())


def test_casadi_torques_bend_along_integrate() -> None:
    robot = load_robot(chain([pin.JointModelRX(), pin.JointModelSpherical(), pin.JointModelRUBX()]))
    reference, n = casadi_torque(robot), robot.nv
    q = configurations(robot, POINTS)
    v, a, weight = np.random.default_rng(2).normal(size=(3, POINTS, n))
    h = 1e-3

    def along(d: np.ndarray) -> np.ndarray:
        tau = reference.torque(robot.integrate(q, d[:n]), v + d[n : 2 * n], a + d[2 * n :])
        return np.sum(weight * tau, axis=1)

    e = h * np.eye(3 * n)
    second = np.array(
        [[along(x + y) - along(x - y) - along(y - x) + along(-x - y) for y in e] for x in e]
    ) / (4 * h * h)
    found = reference.curvature(q, v, a, None, weight)
    np.testing.assert_allclose(found, second.transpose(2, 0, 1), atol=1e-3)


def test_pickled_it_is_the_same() -> None:
    robot = load_robot(model_with("free-flyer"))
    kernel = TwinKernel(robot.model)
    jet = (configurations(robot, 3), *np.ones((2, 3, robot.nv)))
    again = pickle.loads(pickle.dumps(kernel))
    np.testing.assert_array_equal(again.torque(*jet), kernel.torque(*jet))


def test_what_has_no_twin_is_named() -> None:
    model = chain([pin.JointModelRX(), pin.JointModelSpherical()])
    assert joints_without_twin(model) == ("j1",)
    with pytest.raises(ModelError, match="no twin of 'j1'"):
        TwinKernel(model)
    assert joints_without_twin(with_arm("planar")) == ()
