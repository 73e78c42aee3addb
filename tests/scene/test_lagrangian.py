"""Lagrangians at batches of points: analytic values, derivatives by finite differences."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.effects import Effect, Gravity, JointLimitPotential
from hovi.robot.robot import Robot
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from oracles.finite_differences import derivative_per_point
from samples.paper_arm import effort

Array = npt.NDArray[np.float64]

POINTS = 6


def potential(robot: Robot) -> JointLimitPotential:
    """A ramp so wide that every random point is in or near its smooth part."""
    ranges = {joint: (-0.5 - 0.1 * i, 0.4) for i, joint in enumerate(robot.coordinate_names)}
    return JointLimitPotential(ranges, slope=20.0, width=1.5)


SCENES = ["two_link", "two_link, potential", "ur5", "ur5, potential", "panda"]


@pytest.fixture(scope="module", params=SCENES)
def lagrangian(request: pytest.FixtureRequest) -> EffortLagrangian:
    name, *more = request.param.split(", ")
    robot: Robot = request.getfixturevalue(name)
    effects: Sequence[Effect] = [Gravity(), *(potential(robot) for _ in more)]
    return Scene(robot, effects).effort_lagrangian(np.linspace(0.5, 2.0, robot.nv))


def jets(n: int, order: int = 2, points: int = POINTS) -> Array:
    """The jet at P points as rows, (P, (k + 1) n)."""
    return np.random.default_rng(n).normal(size=(points, (order + 1) * n))


def gradient(L: Lagrangian, x: Array) -> Array:
    return L.evaluate(*np.split(x, L.order + 1, axis=1))[1].reshape(len(x), -1)


def assert_consistent(L: Lagrangian, x: Array) -> None:
    """evaluate returns the value and its first and second derivatives."""
    jet = np.split(x, L.order + 1, axis=1)
    value, slope, hessian = L.evaluate(*jet)
    assert slope.shape == (len(x), L.order + 1, L.nv)
    assert hessian.shape == (len(x), L.order + 1, L.nv, L.order + 1, L.nv)
    np.testing.assert_allclose(value, L.value(*jet), rtol=1e-13)
    by_value = derivative_per_point(lambda y: L.value(*np.split(y, L.order + 1, axis=1)), x)
    by_slope = derivative_per_point(lambda y: gradient(L, y), x)
    for found, expected in ((slope, by_value), (hessian, by_slope)):
        expected = expected.reshape(found.shape)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * scale)


def test_the_effort_of_the_arm_matches_the_derivation_by_hand(arm_scene: Scene) -> None:
    jet = np.split(jets(2, points=50), 3, axis=1)
    expected = [effort(*point) for point in zip(*jet, strict=True)]
    L = arm_scene.effort_lagrangian()
    np.testing.assert_allclose(L.value(*jet), expected, rtol=1e-12)
    np.testing.assert_allclose(L.evaluate(*jet)[0], expected, rtol=1e-12)


def test_gradient_and_hessian_of_an_effort_match_finite_differences(
    lagrangian: EffortLagrangian,
) -> None:
    assert_consistent(lagrangian, jets(lagrangian.nv))


def test_the_value_is_the_weighted_square_of_the_torques(lagrangian: EffortLagrangian) -> None:
    jet = np.split(jets(lagrangian.nv), 3, axis=1)
    tau = lagrangian.torques.torque(*jet)
    value = 0.5 * tau**2 @ lagrangian.weight
    if lagrangian.potential is not None:
        value += lagrangian.potential.value(*jet)
    np.testing.assert_allclose(lagrangian.value(*jet), value, rtol=1e-13)


def test_torque_and_hessian_give_the_same_derivatives(lagrangian: EffortLagrangian) -> None:
    n, R = lagrangian.nv, lagrangian.weight
    jet = np.split(jets(n), 3, axis=1)
    tau, J = lagrangian.torque(*jet)
    hessian = lagrangian.hessian(*jet, None, R, R * tau)
    slope = np.einsum("pi,pij->pj", R * tau, J)
    if lagrangian.potential is not None:
        _, dV, ddV = lagrangian.potential.expand(*jet)
        slope, hessian = slope + dV, hessian + ddV
    _, expected_slope, expected = lagrangian.evaluate(*jet)
    np.testing.assert_allclose(slope, expected_slope.reshape(slope.shape), rtol=1e-10, atol=1e-10)
    scale = np.abs(hessian).max()
    np.testing.assert_allclose(hessian, expected.reshape(hessian.shape), atol=1e-13 * scale)


def test_a_multiplier_replaces_the_torque_in_the_curvature_only(
    lagrangian: EffortLagrangian,
) -> None:
    n, R = lagrangian.nv, lagrangian.weight
    jet = np.split(jets(n), 3, axis=1)
    multiplier = np.random.default_rng(9).normal(size=(POINTS, n))
    plain, lifted = lagrangian.expand(*jet), lagrangian.expand(*jet, multiplier=multiplier)
    for k in (0, 1, 3, 4):
        np.testing.assert_array_equal(plain[k], lifted[k])
    tau, zero = plain[3], np.zeros((POINTS, n))
    change = lagrangian.hessian(*jet, None, zero[0], multiplier - R * tau)
    scale = np.abs(plain[2]).max()
    np.testing.assert_allclose(lifted[2], plain[2] + change, rtol=0, atol=1e-12 * scale)


def test_time_has_no_influence_without_time_dependent_effects(
    lagrangian: EffortLagrangian,
) -> None:
    jet = np.split(jets(lagrangian.nv), 3, axis=1)
    later = lagrangian.evaluate(*jet, t=np.arange(POINTS) * 1.0)
    for now, then in zip(lagrangian.evaluate(*jet), later, strict=True):
        np.testing.assert_array_equal(now, then)


def test_dimensions_match_the_robot(lagrangian: EffortLagrangian) -> None:
    robot = lagrangian.scene.robot
    assert (lagrangian.nq, lagrangian.nv, lagrangian.order) == (robot.nq, robot.nv, 2)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_casadi_lagrangian_of_any_order_has_exact_derivatives(order: int) -> None:
    n = 2
    jet = [ca.SX.sym(name, n) for name in "qvaj"[: order + 1]]
    expression = (
        ca.sumsqr(jet[-1]) / 2 + ca.sin(jet[0][0]) * jet[1][1] ** 2 + jet[-1][0] * jet[0][1]
    )
    L = CasadiLagrangian(jet, expression)
    assert (L.nq, L.nv, L.order) == (n, n, order)
    x = jets(n, order)
    assert_consistent(L, x)
    parts = np.split(x, order + 1, axis=1)
    q, v, last = parts[0], parts[1], parts[-1]
    by_hand = (last**2).sum(axis=1) / 2 + np.sin(q[:, 0]) * v[:, 1] ** 2 + last[:, 0] * q[:, 1]
    np.testing.assert_allclose(L.value(*parts), by_hand, rtol=1e-13)


def test_the_spline_lagrangian_has_the_identity_as_its_only_curvature() -> None:
    q, v, a = (ca.SX.sym(name, 3) for name in "qva")
    L = CasadiLagrangian([q, v, a], ca.sumsqr(a) / 2)
    jet = np.split(jets(3), 3, axis=1)
    value, slope, hessian = L.evaluate(*jet)
    np.testing.assert_allclose(value, (jet[2] ** 2).sum(axis=1) / 2, rtol=1e-15)
    np.testing.assert_array_equal(slope[:, :2], 0.0)
    np.testing.assert_array_equal(slope[:, 2], jet[2])
    expected = np.zeros((3, 3, 3, 3))
    expected[2, :, 2] = np.eye(3)
    np.testing.assert_array_equal(hessian, np.broadcast_to(expected, hessian.shape))
