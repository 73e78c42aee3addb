"""Symmetries: known generators, invariance, and conservation along discrete motions."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.effects import Gravity
from hovi.errors import SceneError
from hovi.flows.legendre_transforms import legendre
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.flows.stepper import flow
from hovi.flows.symmetry import Symmetry, base_rotation, base_translation
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.scene.standard_lagrangians import mechanics, riemannian_cubic
from hovi.schemes import galerkin
from oracles.finite_differences import derivative
from samples.slider import SLIDER

Array = npt.NDArray[np.float64]


@pytest.fixture(scope="module")
def cart(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    path = tmp_path_factory.mktemp("slider") / "slider.urdf"
    path.write_text(SLIDER)
    return load_robot(path)


def turn(q: ca.SX) -> ca.SX:
    """Rotation of the plane about the origin: xi = (-y, x)."""
    return ca.vertcat(-q[1], q[0])


def central(k: int) -> CasadiLagrangian:
    """A rotationally invariant Lagrangian of order k in the plane."""
    jet = [ca.SX.sym(f"q{j}", 2) for j in range(k + 1)]
    radius = ca.sumsqr(jet[0])
    L = ca.sumsqr(jet[-1]) / 2 * (1 + radius) - ca.sqrt(1 + radius)
    return CasadiLagrangian(jet, L + ca.dot(jet[0], jet[-1]) * ca.sumsqr(jet[1]) / 8)


@pytest.mark.parametrize("k", [1, 2, 3])
@pytest.mark.parametrize("r", [0, 2])
def test_noether_user_defined_symmetries_are_conserved(k: int, r: int) -> None:
    symmetry, L = Symmetry(turn, 2), central(k)
    rng = np.random.default_rng(k)
    x, p = 0.5 * rng.normal(size=(2, k, 2))
    p[-1] += x[-1] if k == 1 else 0
    motion = flow(SchemeLagrangian(L, galerkin(r, k), 0.05), x, p, 40, symmetries={"J": symmetry})
    J = motion.momentum_maps["J"]
    # a rotation mixes the joints, so that only rounding of the solves is left
    np.testing.assert_allclose(J, J[0], rtol=0, atol=1e-12 * np.abs(motion.p).max())
    assert np.ptp(motion.p[:, 0, 0]) > 1e-3  # the momenta themselves are not


@pytest.mark.parametrize("k", [1, 2, 3])
def test_an_invariant_lagrangian_has_no_defect(k: int) -> None:
    jet = np.random.default_rng(1).normal(size=(k + 1, 6, 2))
    np.testing.assert_allclose(Symmetry(turn, 2).defect(central(k), *jet), 0.0, atol=1e-13)
    shift = Symmetry(lambda q: ca.SX.ones(2), 2)
    assert np.abs(shift.defect(central(k), *jet)).max() > 0.1


def test_the_lift_is_the_derivative_of_the_generator_along_a_curve() -> None:
    symmetry = Symmetry(lambda q: ca.vertcat(ca.sin(q[0]) * q[1], q[0] ** 2), 2)
    x = np.random.default_rng(2).normal(size=(1, 3, 2))
    q, v, a = x[0]
    lift = symmetry.lift(x)[0]

    def xi(t: Array) -> Array:
        y = q + v * t + a * t**2 / 2
        return np.array([np.sin(y[0]) * y[1], y[0] ** 2])

    np.testing.assert_allclose(lift[0], xi(np.zeros(1)), rtol=1e-15)
    np.testing.assert_allclose(lift[1], derivative(xi, np.zeros(1))[:, 0], rtol=1e-9)
    slope = derivative(lambda t: derivative(xi, t)[:, 0], np.zeros(1), 1e-2)
    np.testing.assert_allclose(lift[2], slope[:, 0], rtol=1e-6)
    x2 = x[:, :2]
    p = np.random.default_rng(3).normal(size=(1, 2, 2))
    expected = p[0, 0] @ lift[0] + p[0, 1] @ lift[1]  # p.xi + p~.(d xi/dq v)
    assert symmetry.momentum(x2, p)[0] == pytest.approx(expected, rel=1e-14)


def test_rotating_a_robot_about_its_first_axis_moves_the_first_joint(
    panda: Robot, two_link: Robot
) -> None:
    points = np.random.default_rng(0).normal(size=(3, 2, 7))
    lift = base_rotation(Scene(panda, [Gravity()]), [0, 0, 2]).lift(points)
    expected = np.zeros((3, 2, 7))
    expected[:, 0, 0] = 1
    np.testing.assert_allclose(lift, expected, atol=1e-12)
    arm = base_rotation(Scene(two_link), [0, 1, 0]).lift(points[:, :, :2])
    np.testing.assert_allclose(np.abs(arm), np.abs(expected[:, :, :2]), atol=1e-12)


@pytest.mark.parametrize("make", [Scene.effort_lagrangian, mechanics, riemannian_cubic])
def test_the_lagrangians_of_a_robot_are_invariant_under_its_base_motions(
    panda: Robot, cart: Robot, make: Callable[[Scene], Lagrangian]
) -> None:
    heavy, rolling = Scene(panda, [Gravity()]), Scene(cart, [Gravity()])
    motions = [
        (heavy, base_rotation(heavy, [0, 0, 1])),
        (rolling, base_translation(rolling, [1, 0, 0])),
    ]
    for scene, symmetry in motions:
        L = make(scene)
        jet = np.random.default_rng(1).normal(size=(L.order + 1, 4, L.nv))
        scale = np.abs(L.gradient(*jet)).max()
        np.testing.assert_allclose(symmetry.defect(L, *jet) / scale, 0.0, atol=1e-13)


def test_noether_for_a_cart_under_gravity(cart: Robot) -> None:
    scene = Scene(cart, [Gravity()])
    L = scene.effort_lagrangian()
    x, p = legendre(L, [0.1, 0.4], [0.3, -0.2], [0.5, 0.1], [0.2, 0.3])
    push = base_translation(scene, [1, 0, 0])
    motion = flow(SchemeLagrangian(L, galerkin(1), 0.01), x, p, 100, symmetries={"push": push})
    J = motion.momentum_maps["push"]
    np.testing.assert_allclose(J, J[0], rtol=0, atol=1e-12 * np.abs(J).max())


@pytest.mark.parametrize("size", [5e-324, 1e-160, 1e155, 1e308])
def test_a_direction_of_the_world_may_have_any_length(cart: Robot, size: float) -> None:
    x, p = np.random.default_rng(0).normal(size=(2, 3, 2, 2))
    given, usual = (base_translation(Scene(cart), [s, 0, 0]) for s in (size, 1.0))
    np.testing.assert_array_equal(given.momentum(x, p), usual.momentum(x, p))


def test_motions_that_are_no_symmetries_are_refused(panda: Robot, cart: Robot) -> None:
    heavy = Scene(panda, [Gravity()])
    with pytest.raises(SceneError, match="changes under a rotation"):
        base_rotation(heavy, [1, 0, 0])
    with pytest.raises(SceneError, match="does work under a translation"):
        base_translation(heavy, [0, 0, 1])
    with pytest.raises(SceneError, match="cannot move the whole robot"):
        base_translation(heavy, [1, 0, 0])
    with pytest.raises(SceneError, match="cannot move the whole robot"):
        base_rotation(Scene(cart), [0, 1, 0])
