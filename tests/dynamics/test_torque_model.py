"""Torques and their derivatives agree between CasADi and the analytic kernel."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.dynamics.inverse_dynamics_kernel import InverseDynamicsKernel
from hovi.dynamics.moving_base_torque import inverse_dynamics
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.dynamics.torque_model import AnalyticTorque, CasadiTorque, SummedTorque, TorqueModel
from hovi.effects import Gravity, MovingBase
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.scene import Scene
from oracles.finite_differences import derivative_per_point

Array = npt.NDArray[np.float64]
Columns = tuple[ca.SX, ca.SX, ca.SX, ca.SX]

POINTS = 7
ROBOTS = ["two_link", "ur5", "panda"]


@pytest.fixture(scope="module", params=ROBOTS)
def scene(request: pytest.FixtureRequest) -> Scene:
    return Scene(request.getfixturevalue(request.param), [Gravity()])


def columns(n: int) -> Columns:
    return ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("a", n), ca.SX.sym("t")


def drag(symbols: Columns) -> ca.SX:
    """A nonlinear torque that couples all variables and time."""
    q, v, a, t = symbols
    return ca.sin(2 * q) * v**2 + ca.cos(t) * a * q + 0.3 * v * ca.sum1(q * a) + t**2


def models(
    scene: Scene, added: Callable[[Columns], ca.SX] | None
) -> tuple[TorqueModel, TorqueModel]:
    """The analytic model, and the same model in CasADi."""
    symbols = columns(scene.robot.nv)
    tau = casadi_functions(scene.model).inverse_dynamics(*symbols[:3])
    main = AnalyticTorque(InverseDynamicsKernel(scene.model))
    if added is None:
        return main, CasadiTorque(symbols, tau)
    more = added(symbols)
    return SummedTorque(main, CasadiTorque(symbols, more)), CasadiTorque(symbols, tau + more)


def jets(n: int, seed: int = 0) -> tuple[Array, Array, Array, Array]:
    random = np.random.default_rng(seed)
    q, v, a = random.normal(size=(3, POINTS, n))
    return q, v, a, random.uniform(0.0, 2.0, POINTS)


def assert_close(found: Array, expected: Array, tolerance: float = 1e-11) -> None:
    assert found.shape == expected.shape
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * np.abs(expected).max())


@pytest.mark.parametrize("added", [None, drag], ids=["RNEA alone", "with an added torque"])
def test_analytic_and_casadi_derivatives_agree(
    scene: Scene, added: Callable[[Columns], ca.SX] | None
) -> None:
    analytic, casadi = models(scene, added)
    n = scene.robot.nv
    q, v, a, t = jets(n)
    R = np.random.default_rng(1).uniform(0.5, 2.0, n)
    multiplier = np.random.default_rng(2).normal(size=(POINTS, n))
    assert_close(analytic.torque(q, v, a, t), casadi.torque(q, v, a, t))
    for found, expected in zip(
        analytic.linearize(q, v, a, t), casadi.linearize(q, v, a, t), strict=True
    ):
        assert_close(found, expected)
    for curvature in (None, multiplier):
        results = analytic.expand(q, v, a, t, R, curvature)
        for found, expected in zip(results, casadi.expand(q, v, a, t, R, curvature), strict=True):
            assert_close(found, expected)


def test_the_kernel_matches_casadi_for_continuous_joints_on_a_moving_base() -> None:
    moved = MovingBase((0.0, "0.1*t**2", "sin(t)"), ("0.3*sin(t)", "-0.2*t", 0.5))
    scene = Scene(load_robot("kinova"), [Gravity(), moved])
    assert scene.analytic
    symbols, space = scene.terms.symbols, scene.robot.space
    tau = inverse_dynamics(scene.model, symbols.base, *symbols.columns())
    n = scene.robot.nv
    d, v, a, t = jets(n)
    jet = scene.robot.integrate(scene.robot.neutral(), d), v, a, t, np.arange(1.0, n + 1), None
    expected = CasadiTorque(symbols.columns(), tau, space=space).expand(*jet)
    for found, wanted in zip(scene.torques.expand(*jet), expected, strict=True):
        assert_close(found, wanted)


@pytest.mark.parametrize("added", [None, drag], ids=["RNEA alone", "with an added torque"])
def test_derivatives_match_finite_differences(
    scene: Scene, added: Callable[[Columns], ca.SX] | None
) -> None:
    n = scene.robot.nv
    *jet, t = jets(n, seed=3)
    x = np.concatenate(jet, axis=1)
    R, multiplier = np.arange(1.0, n + 1), np.random.default_rng(4).normal(size=(POINTS, n))
    for model in models(scene, added):

        def torque(x: Array, model: TorqueModel = model) -> Array:
            return model.torque(*np.split(x, 3, axis=1), t)

        def pulled_back(x: Array, model: TorqueModel = model) -> Array:
            J = model.linearize(*np.split(x, 3, axis=1), t)[1]
            return np.einsum("pi,pij->pj", multiplier, J)

        _, J, H = model.expand(*jet, t, R, multiplier)
        gauss_newton = np.einsum("pik,i,pil->pkl", J, R, J)
        assert_close(J, derivative_per_point(torque, x), 1e-9)
        assert_close(H, gauss_newton + derivative_per_point(pulled_back, x), 1e-9)


def test_without_multipliers_the_hessian_is_of_the_effort(scene: Scene) -> None:
    n = scene.robot.nv
    *jet, t = jets(n, seed=5)
    R = np.arange(1.0, n + 1)
    for added in (None, drag):
        for model in models(scene, added):
            effort = EffortLagrangian(model, scene, R)

            def gradient(x: Array, effort: EffortLagrangian = effort) -> Array:
                value = effort.evaluate(*np.split(x, 3, axis=1), t=t)[1]
                return value.reshape(len(x), -1)

            H = model.expand(*jet, t, R, None)[2]
            assert_close(H, derivative_per_point(gradient, np.concatenate(jet, axis=1)), 1e-9)


@pytest.mark.parametrize("added", [None, drag], ids=["RNEA alone", "with an added torque"])
def test_weights_can_differ_per_point(
    scene: Scene, added: Callable[[Columns], ca.SX] | None
) -> None:
    n = scene.robot.nv
    q, v, a, t = jets(n)
    R = np.random.default_rng(6).uniform(0.0, 2.0, (POINTS, n))
    multiplier = np.random.default_rng(7).normal(size=(POINTS, n))
    for model in models(scene, added):
        for curvature in (None, multiplier):
            whole = model.expand(q, v, a, t, R, curvature)
            for k in range(POINTS):
                one = slice(k, k + 1)
                weight = None if curvature is None else curvature[one]
                alone = model.expand(q[one], v[one], a[one], t[one], R[k], weight)
                for found, expected in zip(whole, alone, strict=True):
                    assert_close(found[one], expected, 1e-13)


def test_hessians_are_symmetric(scene: Scene) -> None:
    n = scene.robot.nv
    for model in models(scene, drag):
        H = model.expand(*jets(n), np.ones(n), None)[2]
        np.testing.assert_allclose(H, H.transpose(0, 2, 1), rtol=0, atol=1e-13 * np.abs(H).max())


def test_time_defaults_to_zero(scene: Scene) -> None:
    q, v, a, _ = jets(scene.robot.nv)
    for model in models(scene, drag):
        zero = model.torque(q, v, a, np.zeros(POINTS))
        np.testing.assert_array_equal(model.torque(q, v, a), zero)


def test_a_single_joint_is_supported(pendulum: Robot) -> None:
    scene = Scene(pendulum, [Gravity()])
    for added in (None, drag):
        analytic, casadi = models(scene, added)
        q, v, a, t = jets(1)
        results = analytic.expand(q, v, a, t, np.ones(1), None)
        expected = casadi.expand(q, v, a, t, np.ones(1), None)
        for found, wanted in zip(results, expected, strict=True):
            assert_close(found, wanted)
