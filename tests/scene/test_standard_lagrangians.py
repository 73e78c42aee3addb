"""Standard Lagrangians against Pinocchio and analytic formulas."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.effects import Gravity
from hovi.errors import InputError, ModelError
from hovi.robot.loading import load_robot
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.scene import Scene
from hovi.scene.standard_lagrangians import mechanics, riemannian_cubic, spline
from oracles.finite_differences import derivative, derivative_per_point
from samples.manifold_robots import BASES, configurations, half_turning, with_arm

Array = npt.NDArray[np.float64]


@pytest.fixture(params=["two_link", "ur5"])
def scene(request: pytest.FixtureRequest) -> Scene:
    return Scene(request.getfixturevalue(request.param), [Gravity()])


def test_the_euler_lagrange_equations_of_mechanics_match_rnea(scene: Scene) -> None:
    # d/dt dL/dv - dL/dq = L_vq v + L_vv a - L_q = tau
    n = scene.robot.nv
    q, v, a = np.random.default_rng(0).normal(size=(3, 5, n))
    _, gradient, H = mechanics(scene).evaluate(q, v)
    tau = np.einsum("pij,pj->pi", H[:, 1, :, 0], v) + np.einsum("pij,pj->pi", H[:, 1, :, 1], a)
    tau -= gradient[:, 0]
    expected = scene.inverse_dynamics(q, v, a)
    np.testing.assert_allclose(tau, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_a_riemannian_cubic_squares_the_covariant_acceleration(scene: Scene) -> None:
    q, v, a = np.random.default_rng(1).normal(size=(3, 4, scene.robot.nv))
    values = riemannian_cubic(scene).value(q, v, a)
    model, data = scene.model, scene.model.createData()
    for i in range(4):
        M = pin.crba(model, data, q[i]).copy()
        M = np.triu(M) + np.triu(M, 1).T

        def mass(x: Array) -> Array:
            full = pin.crba(model, data, x).copy()
            return np.triu(full) + np.triu(full, 1).T

        dM = derivative(mass, q[i])  # (n, n, n), the last the direction
        lowered = dM + dM.transpose(0, 2, 1) - dM.transpose(2, 0, 1).transpose(0, 2, 1)
        gamma = np.einsum("kij,i,j->k", lowered, v[i], v[i]) / 2
        covariant = a[i] + np.linalg.solve(M, gamma)
        assert values[i] == pytest.approx(covariant @ M @ covariant / 2, rel=1e-8)


def test_geodesics_have_zero_cost(scene: Scene) -> None:
    free = Scene(scene.robot)
    q, v = np.random.default_rng(2).normal(size=(2, 3, scene.robot.nv))
    zero = np.zeros_like(q)
    bias = free.inverse_dynamics(q, v, zero)
    M = np.stack([free.inverse_dynamics(q, zero, zero + e) for e in np.eye(len(q[0]))], axis=2)
    a = np.linalg.solve(M, -bias[:, :, None])[:, :, 0]
    np.testing.assert_allclose(riemannian_cubic(scene).value(q, v, a), 0.0, atol=1e-12)


@pytest.mark.parametrize("k", [1, 2, 3])
def test_a_spline_is_half_the_square_of_the_last_derivative(k: int) -> None:
    L = spline(3, k)
    jet = np.random.default_rng(k).normal(size=(k + 1, 4, 3))
    assert L.order == k
    np.testing.assert_allclose(L.value(*jet), np.sum(jet[-1] ** 2, axis=1) / 2, rtol=1e-15)


def test_invalid_arguments_are_refused() -> None:
    with pytest.raises(InputError, match="n >= 1 and k >= 1"):
        spline(0)
    halfway = Scene(load_robot(half_turning()))
    for ready_made in (mechanics, riemannian_cubic):
        with pytest.raises(ModelError, match="does not support planning"):
            ready_made(halfway)


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("make", [mechanics, riemannian_cubic])
def test_derivatives_are_along_the_group(
    make: Callable[[Scene], CasadiLagrangian], base: str
) -> None:
    robot = load_robot(with_arm(base))
    L = make(Scene(robot, [Gravity()]))
    k, q = L.order, configurations(robot, 3)
    rates = [*np.random.default_rng(0).normal(size=(k, 3, robot.nv))]
    _, gradient, hessian = L.evaluate(q, *rates)
    zero = np.zeros((3, robot.nv))

    def moved(j: int, x: Array) -> list[Array]:
        jet = [q, *rates]
        jet[j] = robot.integrate(q, x) if j == 0 else jet[j] + x
        return jet

    for j in range(k + 1):
        slope = derivative_per_point(lambda x, j=j: L.value(*moved(j, x)), zero)
        np.testing.assert_allclose(gradient[:, j], slope, rtol=1e-8, atol=1e-8)
        bent = derivative_per_point(lambda x, j=j: L.gradient(*moved(j, x))[:, 1:], zero)
        np.testing.assert_allclose(hessian[:, 1:, :, j], bent, rtol=1e-7, atol=1e-7)


def test_the_cubic_of_a_floating_robot_squares_its_force() -> None:
    robot = load_robot(with_arm("free-flyer"))
    q = configurations(robot, 3)
    v, a = np.random.default_rng(0).normal(size=(2, 3, robot.nv))
    model = robot.model.copy()
    model.gravity.linear = np.zeros(3)
    data = model.createData()
    for one, value in zip(
        zip(q, v, a, strict=True), riemannian_cubic(Scene(robot)).value(q, v, a), strict=True
    ):
        force = pin.rnea(model, data, *one)
        upper = np.triu(pin.crba(model, data, one[0]))
        mass = upper + np.triu(upper, 1).T
        assert value == pytest.approx(force @ np.linalg.solve(mass, force) / 2, rel=1e-12)
