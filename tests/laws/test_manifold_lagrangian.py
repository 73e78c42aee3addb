"""L_d on manifolds: finite differences, symmetries, equivalent robots."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import regularized
from hovi.effects import Gravity
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import by_name
from oracles.finite_differences import derivative
from samples.manifold_robots import BASES, configurations, with_arm

Array = npt.NDArray[np.float64]

STEPS = np.array([0.4, 0.25])


def random_path(robot: Robot, grid: Grid, turn: float = 1.0, seed: int = 0) -> DiscretePath:
    """Random nodes, `turn` apart in the rotation of the base."""
    random = np.random.default_rng(seed)
    N, n = grid.intervals, robot.nv
    q = [configurations(robot, 1, seed)[0]]
    for _ in range(N):
        d = 0.5 * random.normal(size=n)
        for factor in robot.space.curved:
            places = [factor.v.start + i for i in factor.group.angular]
            d[places] *= turn / np.linalg.norm(d[places])
        q.append(robot.integrate(q[-1], d))
    v = random.normal(size=(N + 1, n))
    inner = random.normal(size=(N, grid.inner_modes, n))
    return DiscretePath(np.array(q), v, regularized(robot, grid, np.array(q), v), inner)


def moved(robot: Robot, grid: Grid, path: DiscretePath, columns: Array) -> DiscretePath:
    """The path whose first interval moves by (q0, h v0, q1, h v1, c) in the tangent space."""
    h = grid.steps[0]
    dq, dv = np.zeros_like(path.v), np.zeros_like(path.v)
    dq[:2], dv[:2] = columns[[0, 2]], columns[[1, 3]] / h
    q, v, inner = robot.integrate(path.q, dq), path.v + dv, path.inner.copy()
    inner[0] += columns[4:] / h**2
    return DiscretePath(q, v, regularized(robot, grid, q, v), inner)


@pytest.mark.parametrize("turn", [1e-9, 1.0, 3.0])
@pytest.mark.parametrize("base", BASES)
def test_gradient_and_hessian_match_finite_differences(base: str, turn: float) -> None:
    robot = load_robot(with_arm(base))
    grid = Grid(STEPS, (by_name("galerkin-1"), by_name("galerkin-2")))
    ld = DiscreteLagrangian(Scene(robot, [Gravity()]).effort_lagrangian(), grid)
    path = random_path(robot, grid, turn)
    expansion = ld.expand(path)
    m, n = 5, robot.nv
    random = np.random.default_rng(4)
    for _ in range(6):
        d = random.normal(size=(m, n))
        d /= np.linalg.norm(d)

        def along(x: Array, d: Array = d) -> Array:
            full = np.concatenate([x[0] * d, np.zeros((1, n))])
            return ld.values(moved(robot, grid, path, full))[0]

        first = derivative(along, np.zeros(1), 1e-4)[0]
        second = derivative(lambda x, f=along: derivative(f, x, 1e-3), np.zeros(1), 1e-3).item()
        g, H = expansion.gradient[0, :m], expansion.hessian[0, :m, :m]
        assert np.vdot(g, d) == pytest.approx(first, rel=1e-8, abs=1e-9 * np.abs(g).max())
        assert np.einsum("ijab,ia,jb", H, d, d) == pytest.approx(
            second, rel=1e-5, abs=1e-7 * np.abs(H).max()
        )
    np.testing.assert_allclose(ld.gradient(path), expansion.gradient, rtol=1e-11, atol=1e-9)


@pytest.mark.parametrize("base", ["free-flyer", "planar", "continuous"])
def test_d1_to_d4_match_the_nodal_gradient(base: str) -> None:
    robot = load_robot(with_arm(base))
    grid = Grid.uniform(0.8, 3, by_name("galerkin-2"))
    ld = DiscreteLagrangian(Scene(robot).effort_lagrangian(), grid)
    path = random_path(robot, grid)
    columns = ld.gradient(path)[:, :4]
    h = grid.steps[0]
    expected = columns * np.array([1.0, h, 1.0, h])[:, None]
    np.testing.assert_allclose(ld.derivatives(path), expected, rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("base", ["free-flyer", "continuous"])
def test_point_steps_match_finite_differences(base: str) -> None:
    robot = load_robot(with_arm(base))
    grid = Grid.uniform(0.5, 1, by_name("galerkin-2"))
    ld = DiscreteLagrangian(Scene(robot).effort_lagrangian(), grid)
    path = random_path(robot, grid)
    step, e = np.random.default_rng(5).normal(size=(1, 6, robot.nv)), 1e-5
    (found,) = ld.point_steps(step, "nodal", ld.expand(path))
    here = ld.jets(path)[0]
    there, back = (ld.jets(moved(robot, grid, path, s * e * step[0]))[0] for s in (1, -1))
    dq = robot.difference(here[0], there[0]) - robot.difference(here[0], back[0])
    expected = np.concatenate([dq, there[1] - back[1], there[2] - back[2]], axis=1) / (2 * e)
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize("base", ["free-flyer", "spherical", "planar"])
def test_l_d_is_invariant_under_rigid_motions_of_the_world(base: str) -> None:
    robot = load_robot(with_arm(base))
    grid = Grid.uniform(1.2, 3, by_name("galerkin-2"))
    ld = DiscreteLagrangian(Scene(robot).effort_lagrangian(), grid)
    path = random_path(robot, grid, 2.0)
    model = pin.Model()
    model.addJoint(0, BASES[base](), pin.SE3.Identity(), "j")
    (factor,) = robot.space.curved
    g = pin.integrate(model, pin.neutral(model), np.linspace(1.0, 2.0, model.nv))
    q = path.q.copy()
    # g q: the base moved from the left, by Pinocchio's difference from neutral
    for row in q:
        d = pin.difference(model, pin.neutral(model), row[factor.q])
        row[factor.q] = pin.integrate(model, g, d)
    elsewhere = DiscretePath(q, path.v, path.z, path.inner)
    np.testing.assert_allclose(ld.values(elsewhere), ld.values(path), rtol=1e-12)
    np.testing.assert_allclose(
        ld.expand(elsewhere).gradient, ld.expand(path).gradient, rtol=0, atol=1e-9
    )


@pytest.mark.parametrize("base", BASES)
def test_intervals_of_other_schemes_do_not_matter(base: str) -> None:
    """Values, derivatives and gradients of an interval are those of the interval alone."""
    robot = load_robot(with_arm(base))
    names = ("galerkin-2", "taylor-midpoint", "galerkin-0", "galerkin-2", "galerkin-1")
    grid = Grid(np.array([0.4, 0.25, 0.3, 0.2, 0.35]), tuple(by_name(name) for name in names))
    L = Scene(robot, [Gravity()]).effort_lagrangian()
    path, ld = random_path(robot, grid), DiscreteLagrangian(L, grid)
    values, derivatives, gradient = ld.values(path), ld.derivatives(path), ld.gradient(path)
    for k, scheme in enumerate(grid.schemes):
        r = scheme.inner_modes
        alone = DiscreteLagrangian(L, Grid(grid.steps[k : k + 1], (scheme,)))
        part = DiscretePath(
            path.q[k : k + 2], path.v[k : k + 2], path.z[k : k + 1], path.inner[k : k + 1, :r]
        )
        np.testing.assert_allclose(values[k], alone.values(part)[0], rtol=1e-12)
        scale = np.abs(derivatives[k]).max()
        np.testing.assert_allclose(derivatives[k], alone.derivatives(part)[0], atol=1e-11 * scale)
        own = alone.gradient(part)[0]
        np.testing.assert_allclose(gradient[k, : 4 + r], own, atol=1e-11 * np.abs(own).max())
        assert not gradient[k, 4 + r :].any()
