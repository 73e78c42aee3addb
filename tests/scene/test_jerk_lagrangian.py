"""The Lagrangian of order 3 of a scene with a cost on the jerk, and the rate of its torques."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.dynamics.torque_rate import TorqueRate
from hovi.effects import Gravity, JerkCost, Payload, ViscousFriction, Wrench
from hovi.errors import InputError, SceneError
from hovi.robot.robot import Robot
from hovi.scene.jerk_lagrangian import JerkLagrangian
from hovi.scene.lagrangian import PointTerms
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]


@pytest.fixture(scope="module", params=["two_link", "ur5"])
def scene(request: pytest.FixtureRequest, two_link: Robot) -> Scene:
    robot = two_link if request.param == "two_link" else hovi.load_robot("ur5")
    weight = tuple(0.1 + 0.2 * i for i in range(robot.nv))
    effects = [Gravity(), Payload(robot.tip_frame, 1.5), ViscousFriction(0.7), JerkCost(weight)]
    return Scene(robot, effects)


def points(n: int, count: int = 5) -> tuple[Array, Array, Array, Array]:
    q, v, a, j = (
        np.random.default_rng(n).normal(size=(4, count, n))
        * np.array([1.0, 2.0, 5.0, 30.0])[:, None, None]
    )
    return q, v, a, j


def lagrangian_of(scene: Scene) -> JerkLagrangian:
    lagrangian = scene.effort_lagrangian()
    assert isinstance(lagrangian, JerkLagrangian)
    return lagrangian


def random_terms(lagrangian: JerkLagrangian, count: int) -> PointTerms:
    """Linear terms in the jet and in the outputs."""
    random, n = np.random.default_rng(3), lagrangian.nv
    m = len(lagrangian.output_weight)
    zeros = np.zeros((count, 4 * n)), np.zeros((count, m))
    jet, outputs = random.normal(size=(count, 4 * n)), random.normal(size=(count, m))
    return PointTerms(jet, zeros[0], outputs, zeros[1])


def test_the_order_of_a_scene_is_that_of_its_highest_derivative(scene: Scene) -> None:
    assert scene.order == scene.effort_lagrangian().order == 3
    bare = scene.without("jerk_cost")
    assert bare.order == bare.effort_lagrangian().order == 2


def test_the_value_is_the_effort_plus_the_weighted_square_of_the_jerk(scene: Scene) -> None:
    q, v, a, j = points(scene.robot.nv)
    tau = np.array(
        [pin.rnea(scene.model, scene.model.createData(), *row) for row in zip(q, v, a, strict=True)]
    )
    tau += 0.7 * v
    weight = 0.1 + 0.2 * np.arange(scene.robot.nv)
    expected = 0.5 * (tau**2).sum(axis=1) + 0.5 * (weight * j**2).sum(axis=1)
    lagrangian = lagrangian_of(scene)
    np.testing.assert_allclose(lagrangian.value(q, v, a, j), expected, rtol=1e-12)
    np.testing.assert_allclose(lagrangian.evaluate(q, v, a, j)[0], expected, rtol=1e-12)
    outputs = lagrangian.output(q, v, a, j)
    total = lagrangian.integral(outputs, (q, v, a, j), None, np.arange(1.0, 6.0))
    assert total == pytest.approx(float(np.arange(1.0, 6.0) @ expected), rel=1e-12)


def test_the_torque_rate_is_the_derivative_of_the_torque_along_the_motion(scene: Scene) -> None:
    """Along q + v t + a t^2/2 + j t^3/6 and its rates, by differences of the fourth order."""
    q, v, a, j = points(scene.robot.nv)

    def tau(t: float) -> Array:
        return scene.inverse_dynamics(
            q + v * t + a * t**2 / 2 + j * t**3 / 6, v + a * t + j * t**2 / 2, a + j * t
        )

    h = 1e-4
    expected = (8 * (tau(h) - tau(-h)) - (tau(2 * h) - tau(-2 * h))) / (12 * h)
    found = TorqueRate(scene.torques, q, v, a, j).value()
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("rates", [False, True])
def test_derivatives_match_finite_differences(scene: Scene, rates: bool) -> None:
    """With forces on the jet, on the torques and on their rates."""
    lagrangian = lagrangian_of(scene)
    lagrangian = lagrangian.with_torque_rates() if rates else lagrangian
    jet = points(scene.robot.nv)
    n, count = scene.robot.nv, len(jet[0])
    terms = random_terms(lagrangian, count)
    force = lagrangian.output_slope(lagrangian.output(*jet)) + terms.output_gradient
    found = lagrangian.expand(*jet, multiplier=force, terms=terms)
    size = np.abs(found.hessian).max()

    def total(*moved: Array) -> Array:
        x = np.concatenate(moved, axis=1)
        linear = np.vecdot(terms.jet_gradient, x)
        linear += np.vecdot(terms.output_gradient, lagrangian.output(*moved))
        return lagrangian.value(*moved) + linear

    for i in range(4 * n):
        e = (1e-5 if i < 2 * n else 1e-4) * np.eye(4 * n)[i].reshape(4, n)
        up, down = ([x + s * d for x, d in zip(jet, e, strict=True)] for s in (1, -1))
        h = 2 * e.max()
        slope = (total(*up) - total(*down)) / h
        scale = np.abs(found.gradient).max()
        np.testing.assert_allclose(found.gradient[:, i], slope, atol=3e-7 * scale)
        rows = (lagrangian.output(*up) - lagrangian.output(*down)) / h
        np.testing.assert_allclose(
            found.jacobian[:, :, i], rows, atol=1e-6 * np.abs(found.jacobian).max()
        )
        bend = lagrangian.gradient(*up, terms=terms) - lagrangian.gradient(*down, terms=terms)
        bend = bend.reshape(count, -1) / h
        np.testing.assert_allclose(found.hessian[:, i], bend, atol=1e-6 * size)
    np.testing.assert_allclose(
        lagrangian.gradient(*jet, terms=terms).reshape(count, -1), found.gradient, rtol=1e-10
    )


def test_weights_of_rows_are_squares_of_their_jacobian(scene: Scene) -> None:
    lagrangian = lagrangian_of(scene).with_torque_rates()
    jet, n = points(scene.robot.nv), scene.robot.nv
    random = np.random.default_rng(4)
    jet_weight, output_weight = random.uniform(size=(5, 4 * n)), random.uniform(size=(5, 2 * n))
    terms = dataclasses.replace(
        random_terms(lagrangian, 5), jet_weight=jet_weight, output_weight=output_weight
    )
    none = dataclasses.replace(
        terms, jet_weight=np.zeros_like(jet_weight), output_weight=np.zeros_like(output_weight)
    )
    force = lagrangian.output_slope(lagrangian.output(*jet))
    one, other = (lagrangian.expand(*jet, multiplier=force, terms=each) for each in (terms, none))
    J = one.jacobian
    expected = np.einsum("poi,po,poj->pij", J, output_weight, J)
    expected += np.eye(4 * n) * jet_weight[:, None]
    difference = one.hessian - other.hessian
    np.testing.assert_allclose(difference, expected, atol=1e-9 * np.abs(one.hessian).max())


def test_torque_rates_of_torques_that_depend_on_time_are_refused(two_link: Robot) -> None:
    scene = Scene(two_link, [Wrench("tip", ("sin(t)", 0.0, 0.0)), JerkCost(1.0)])
    with pytest.raises(InputError, match="torques that do not depend on time"):
        lagrangian_of(scene).with_torque_rates()


@pytest.mark.parametrize("weight", [0.0, {"shoulder": 1.0}, (1.0, 0.0)])
def test_a_joint_without_a_weight_is_refused_by_name(two_link: Robot, weight: object) -> None:
    with pytest.raises(SceneError, match=r"weight of joint '.*' must be positive"):
        Scene(two_link, [JerkCost(weight)])  # type: ignore[arg-type]
