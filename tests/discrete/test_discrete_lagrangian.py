"""L_d and its derivatives: closed forms, finite differences, independence of batches."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.interval_batch import CHUNK
from hovi.effects import Gravity, JointLimitPotential
from hovi.robot.robot import Robot
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.schemes import CLASSIC, by_name
from oracles.finite_differences import derivative
from samples.paper_arm import effort
from samples.random_paths import nodal_columns, path_of_nodal, path_of_regular, random_path

Array = npt.NDArray[np.float64]
ToPath = Callable[[float, Array], DiscretePath]

SCHEMES = [*CLASSIC, "galerkin-0", "galerkin-1", "galerkin-2", "galerkin-4"]
MIXED = ["galerkin-2", "taylor-midpoint", "galerkin-0", "galerkin-2", "hermite-simpson"]
STEPS = np.array([0.1, 0.25, 0.02, 0.3, 0.15])


def spline(n: int) -> CasadiLagrangian:
    """L = 1/2 |a|^2."""
    q, v, a = (ca.SX.sym(name, n) for name in "qva")
    return CasadiLagrangian([q, v, a], ca.sumsqr(a) / 2)


def mixed_grid() -> Grid:
    return Grid(STEPS, tuple(by_name(name) for name in MIXED))


def single(grid: Grid, i: int) -> Grid:
    return Grid(grid.steps[i : i + 1], (grid.schemes[i],))


def part(grid: Grid, path: DiscretePath, i: int) -> DiscretePath:
    """Interval i alone."""
    r = grid.schemes[i].inner_modes
    one = slice(i, i + 1)
    return DiscretePath(path.q[i : i + 2], path.v[i : i + 2], path.z[one], path.inner[one, :r])


def assert_close(found: Array, expected: Array, tolerance: float) -> None:
    assert found.shape == expected.shape
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * np.abs(expected).max())


# Values


@pytest.mark.parametrize("n", [1, 3])
@pytest.mark.parametrize("h", [1e-3, 0.1, 1.0, 10.0])
@pytest.mark.parametrize("name", ["galerkin-0", "galerkin-3", "hermite-simpson"])
def test_l_d_of_the_spline_equals_the_exact_discrete_lagrangian(
    name: str, n: int, h: float
) -> None:
    grid = Grid.uniform(6 * h, 6, by_name(name))
    path = random_path(grid, n)
    path = DiscretePath(path.q, path.v, path.z, 0 * path.inner)
    # 6/h^3 (q0 - q1)^2 + ... of the paper, in z: it loses no digits to q1 - q0
    z0, z1 = path.z[:, 0], path.z[:, 1]
    exact = h * (6 * z0**2 - 6 * z0 * z1 + 2 * z1**2).sum(axis=1)
    values = DiscreteLagrangian(spline(n), grid).values(path)
    np.testing.assert_allclose(values, exact, rtol=1e-13)
    if h >= 0.1:
        (q0, q1), (v0, v1) = ((x[:-1], x[1:]) for x in (path.q, path.v))
        d = q0 - q1
        printed = 6 / h**3 * d**2 + 6 / h**2 * d * (v0 + v1) + 2 / h * (v0**2 + v0 * v1 + v1**2)
        np.testing.assert_allclose(values, printed.sum(axis=1), rtol=1e-9)


@pytest.mark.parametrize("name", SCHEMES)
def test_l_d_is_the_weighted_sum_of_l_at_the_quadrature_points(arm_scene: Scene, name: str) -> None:
    scheme = by_name(name)
    grid = Grid(STEPS, (scheme,) * len(STEPS))
    path = random_path(grid, 2)
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    expected = []
    for h, columns in zip(STEPS, nodal_columns(grid, path), strict=True):
        points = np.einsum("qdm,mn->qdn", scheme.nodal_table, columns)
        jets = points * h ** -np.arange(3.0)[:, None]
        expected.append(h * sum(w * effort(*x) for w, x in zip(scheme.weights, jets, strict=True)))
    np.testing.assert_allclose(ld.values(path), expected, rtol=1e-12)
    assert ld.action(path) == pytest.approx(sum(expected), rel=1e-12)


class Clock(Lagrangian):
    """L = t^2: a Lagrangian that depends on time only."""

    order = 2
    nq = nv = 1

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        assert t is not None
        return t.reshape(-1) ** 2

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        P = len(jet[0])
        return self.value(*jet, t=t), np.zeros((P, 3, 1)), np.zeros((P, 3, 1, 3, 1))


@pytest.mark.parametrize("name", ["hermite-simpson", "galerkin-0", "galerkin-2"])
def test_every_point_is_evaluated_at_its_own_time(name: str) -> None:
    grid = Grid(STEPS, (by_name(name),) * len(STEPS))
    ld = DiscreteLagrangian(Clock(), grid)
    path = random_path(grid, 1)
    exact = np.diff(grid.t**3) / 3
    np.testing.assert_allclose(ld.values(path), exact, rtol=1e-13)
    np.testing.assert_allclose(ld.expand(path).values, exact, rtol=1e-13)


# Derivatives


@pytest.mark.parametrize("coordinates", ["nodal", "regular"])
@pytest.mark.parametrize("name", SCHEMES)
def test_expansions_match_finite_differences_in_all_columns(
    arm_scene: Scene, name: str, coordinates: str
) -> None:
    h = 0.3
    grid = Grid.uniform(h, 1, by_name(name))
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian([1.0, 2.0]), grid)
    to_path: ToPath = path_of_nodal if coordinates == "nodal" else path_of_regular
    x = np.random.default_rng(7).normal(size=(4 + grid.inner_modes, 2)) * 0.3

    def value(x: Array) -> Array:
        return ld.values(to_path(h, x))[0]

    def gradient(x: Array) -> Array:
        return ld.expand(to_path(h, x), coordinates).gradient[0]

    expansion = ld.expand(to_path(h, x), coordinates)
    assert expansion.action == pytest.approx(float(value(x)), rel=1e-13)
    assert_close(expansion.gradient[0], derivative(value, x), 1e-8)
    hessian = expansion.hessian[0].transpose(0, 2, 1, 3)  # (m, n, m, n)
    assert_close(hessian, derivative(gradient, x), 1e-8)


@pytest.mark.parametrize("effects", ["gravity", "potential"])
def test_expansions_match_finite_differences_on_a_real_robot(ur5: Robot, effects: str) -> None:
    more = [JointLimitPotential({"elbow_joint": (-0.1, 0.1)}, 50.0, 0.5)]
    scene = Scene(ur5, [Gravity(), *(more if effects == "potential" else [])])
    h, grid = 0.2, Grid.uniform(0.2, 1, by_name("galerkin-1"))
    ld = DiscreteLagrangian(scene.effort_lagrangian(), grid)
    x = np.random.default_rng(8).normal(size=(5, 6)) * 0.2

    def value(x: Array) -> Array:
        return ld.values(path_of_nodal(h, x))[0]

    def gradient(x: Array) -> Array:
        return ld.expand(path_of_nodal(h, x)).gradient[0]

    expansion = ld.expand(path_of_nodal(h, x))
    assert_close(expansion.gradient[0], derivative(value, x), 1e-8)
    assert_close(expansion.hessian[0].transpose(0, 2, 1, 3), derivative(gradient, x), 1e-8)


@pytest.mark.parametrize("name", SCHEMES)
def test_d1_to_d4_match_finite_differences(arm_scene: Scene, name: str) -> None:
    h = 0.3
    grid = Grid.uniform(h, 1, by_name(name))
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    x = np.random.default_rng(9).normal(size=(4 + grid.inner_modes, 2)) * 0.3
    scale = np.array([1, h, 1, h])[:, None]

    def value(ends: Array) -> Array:
        return ld.values(path_of_nodal(h, np.concatenate([ends * scale, x[4:]])))[0]

    D = ld.derivatives(path_of_nodal(h, x))
    assert_close(D[0], derivative(value, x[:4] / scale), 1e-8)


def test_d1_to_d4_are_the_nodal_gradients_without_h(arm_scene: Scene) -> None:
    grid = mixed_grid()
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    path = random_path(grid, 2)
    nodal = ld.expand(path, "nodal").gradient[:, :4]
    nodal[:, 1::2] *= STEPS[:, None, None]
    assert_close(ld.derivatives(path), nodal, 1e-12)


def test_momenta_are_the_legendre_transforms_of_both_ends(arm_scene: Scene) -> None:
    grid = mixed_grid()
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    path = random_path(grid, 2)
    D, momenta = ld.derivatives(path), ld.momenta(path)
    assert momenta.shape == (6, 2, 2)
    np.testing.assert_array_equal(momenta[:-1], -D[:, :2])
    np.testing.assert_array_equal(momenta[-1], D[-1, 2:])


@pytest.mark.parametrize("name", ["galerkin-0", "galerkin-2", "hermite-simpson"])
def test_momenta_of_a_spline_are_its_jerk_and_its_acceleration(name: str) -> None:
    # p = dL/dv - d/dt dL/da = -jerk and p~ = dL/da = a, on the exact solution
    c = np.random.default_rng(10).normal(size=(4, 3))
    grid = Grid(STEPS, (by_name(name),) * len(STEPS))
    t, h = grid.t[:, None], STEPS[:, None]
    q, v = c[0] + c[1] * t + c[2] * t**2 + c[3] * t**3, c[1] + 2 * c[2] * t + 3 * c[3] * t**2
    a = 2 * c[2] + 6 * c[3] * t
    z = np.stack([a[:-1] / 2 + c[3] * h, a[:-1] + 3 * c[3] * h], axis=1)
    path = DiscretePath(q, v, z, np.zeros((len(h), grid.inner_modes, 3)))
    momenta = DiscreteLagrangian(spline(3), grid).momenta(path)
    np.testing.assert_allclose(momenta[:, 0], np.broadcast_to(-6 * c[3], a.shape), rtol=1e-10)
    np.testing.assert_allclose(momenta[:, 1], a, rtol=0, atol=1e-13)


@pytest.mark.parametrize("coordinates", ["nodal", "regular"])
def test_multipliers_predict_the_torque_after_a_step(arm_scene: Scene, coordinates: str) -> None:
    grid, R = mixed_grid(), np.array([1.0, 3.0])
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(R), grid)
    path = random_path(grid, 2)
    m = 4 + grid.inner_modes
    step = np.random.default_rng(11).normal(size=(len(STEPS), m, 2))
    for i, scheme in enumerate(grid.schemes):
        step[i, 4 + scheme.inner_modes :] = 0.0
    expansion = ld.expand(path, coordinates)
    found = ld.predict(expansion, step, coordinates)
    assert found is not None
    to_path: ToPath = path_of_nodal if coordinates == "nodal" else path_of_regular
    h, columns = grid.steps, nodal_columns(grid, path)
    if coordinates == "regular":
        columns[:, 2:4] = h[:, None, None] ** 2 * path.z
    for (scheme, index), multiplier in zip(grid.groups, found, strict=True):
        shape = (len(index), len(scheme.points), 2)
        for i, predicted in zip(index, multiplier.reshape(shape), strict=True):
            k = 4 + scheme.inner_modes
            one = DiscreteLagrangian(ld.lagrangian, single(grid, i))

            def torque(e: Array, i: int = i, k: int = k, one: DiscreteLagrangian = one) -> Array:
                moved = to_path(h[i], columns[i, :k] + e[0] * step[i, :k])
                return one.expand(moved).outputs[0][0]

            origin = np.zeros(1)
            slope = derivative(torque, origin, step=1e-4)[..., 0]
            assert_close(predicted, R * (torque(origin) + slope), 1e-7)


def test_multipliers_change_only_the_hessian(arm_scene: Scene) -> None:
    grid = mixed_grid()
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    path = random_path(grid, 2)
    plain = ld.expand(path)
    same = ld.expand(path, multipliers=[tau for tau, _ in plain.outputs])
    other = ld.expand(path, multipliers=[0 * tau for tau, _ in plain.outputs])
    assert_close(same.hessian, plain.hessian, 1e-14)
    assert np.abs(other.hessian - plain.hessian).max() > 1e-3
    for expansion in (same, other):
        np.testing.assert_array_equal(expansion.values, plain.values)
        np.testing.assert_array_equal(expansion.gradient, plain.gradient)


def test_a_lagrangian_without_outputs_has_no_predictions() -> None:
    grid = mixed_grid()
    ld, path = DiscreteLagrangian(spline(2), grid), random_path(mixed_grid(), 2)
    expansion = ld.expand(path)
    predicted = ld.predict(expansion, np.zeros_like(expansion.gradient), "nodal")
    assert [slope.shape[1] for slope in predicted] == [0] * len(expansion.outputs)


# Batches


@pytest.mark.parametrize("coordinates", ["nodal", "regular"])
def test_intervals_together_equal_single_intervals(arm_scene: Scene, coordinates: str) -> None:
    grid = mixed_grid()
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    path = random_path(grid, 2)
    whole, D = ld.expand(path, coordinates), ld.derivatives(path)
    np.testing.assert_allclose(whole.values, ld.values(path), rtol=1e-14)
    for i, scheme in enumerate(grid.schemes):
        k = 4 + scheme.inner_modes
        alone = DiscreteLagrangian(ld.lagrangian, single(grid, i))
        one = alone.expand(part(grid, path, i), coordinates)
        np.testing.assert_allclose(whole.values[i], one.values[0], rtol=1e-14)
        assert_close(whole.gradient[i, :k], one.gradient[0], 1e-13)
        assert_close(whole.hessian[i, :k, :k], one.hessian[0], 1e-13)
        assert_close(D[i], alone.derivatives(part(grid, path, i))[0], 1e-13)
        assert not whole.gradient[i, k:].any()
        assert not whole.hessian[i, k:].any()
        assert not whole.hessian[i, :, k:].any()


@pytest.mark.parametrize("mixed", [False, True])
def test_more_intervals_than_one_batch_are_supported(mixed: bool) -> None:
    N = CHUNK + 3
    names = ["galerkin-0", "hermite-simpson" if mixed else "galerkin-0"]
    grid = Grid(np.full(N, 0.1), tuple(by_name(names[i % 7 == 0]) for i in range(N)))
    path = random_path(grid, 1)
    ld = DiscreteLagrangian(spline(1), grid)
    z0, z1 = path.z[:, 0, 0], path.z[:, 1, 0]
    exact = 0.1 * (6 * z0**2 - 6 * z0 * z1 + 2 * z1**2)
    np.testing.assert_allclose(ld.values(path), exact, rtol=1e-13)
    expansion = ld.expand(path, "regular")
    np.testing.assert_allclose(expansion.values, exact, rtol=1e-13)
    slope = np.stack([12 * z0 - 6 * z1, 4 * z1 - 6 * z0], axis=1) / 0.1
    np.testing.assert_allclose(expansion.gradient[:, 2:4, 0], slope, rtol=0, atol=1e-11)


def test_expansions_of_different_paths_are_independent(arm_scene: Scene) -> None:
    grid = mixed_grid()
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    one, other = random_path(grid, 2, seed=1), random_path(grid, 2, seed=2)
    first = ld.expand(one)
    kept = first.hessian.copy()
    ld.expand(other)
    np.testing.assert_array_equal(first.hessian, kept)
