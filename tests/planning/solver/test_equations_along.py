"""Equations along a motion: their derivatives, their rows at nodes, and the eigenvalues of H."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.conditions.function import Curvature, Points, Slopes
from hovi.discrete.grid import DiscretePath, Grid
from hovi.optimize.banded_model import BandModel
from hovi.optimize.kkt_model import KktModel
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.first_multipliers import first_multipliers
from hovi.robot.loading import load_robot
from hovi.schemes import galerkin
from oracles.finite_differences import derivative
from samples.manifold_robots import with_arm

Array = npt.NDArray[np.float64]
CASES = {
    "level 0": lambda q: ca.vertcat(ca.sin(q[-1]) + q[-2] ** 2, q[0] * q[-1]),
    "level 0, of time": lambda q, t: q[-1] * q[-2] - ca.sin(3 * t) * q[-1],
    "level 1": lambda q, v: v[-1] * ca.cos(q[-2]) + v[-3] ** 2,
    "level 1, of time": lambda q, v, t: ca.vertcat(t**2 * v[-1] * q[-1], v[0]),
    "level 2": lambda q, v, a: a[-1] * ca.cos(q[-1]) + v[-2] ** 2 + q[-3],
}


class Product(hovi.Function):
    """q_0 q_1 + sin(t) q_1, without CasADi."""

    needs = frozenset({"q", "t"})
    size = 1

    def values(self, at: Points) -> Array:
        return (at.q[:, 0] * at.q[:, 1] + np.sin(at.t) * at.q[:, 1])[:, None]

    def slopes(self, at: Points) -> Slopes:
        J = np.zeros((len(at.q), 1, at.v.shape[1]))
        J[:, 0, 0], J[:, 0, 1] = at.q[:, 1], at.q[:, 0] + np.sin(at.t)
        return {"q": J}

    def curvature(self, at: Points, weights: Array) -> Curvature:
        H = np.zeros((len(at.q), at.v.shape[1], at.v.shape[1]))
        H[:, 0, 1] = H[:, 1, 0] = weights[:, 0]
        return {("q", "q"): H}


def problem_of(robot: hovi.Robot, *functions: object, r: int = 2) -> TrajectoryProblem:
    """A motion between free ends, so that no row is left out."""
    steps = np.array([0.2, 0.35, 0.25])
    grid = Grid(steps, [galerkin(r), galerkin(r), galerkin(r + 1)])
    ld = hovi.DiscreteLagrangian(
        hovi.Scene(robot, [hovi.effects.Gravity()]).effort_lagrangian(), grid
    )
    free = hovi.State(robot.neutral(), free=robot.joint_names)
    asked = [hovi.Condition(y, hovi.Equal(0.3), name=f"y{i}") for i, y in enumerate(functions)]
    return TrajectoryProblem(ld, free, free, conditions=asked)


def random_path(problem: TrajectoryProblem) -> DiscretePath:
    random, n = np.random.default_rng(4), problem.coordinates.nv
    action, path = ActionObjective(problem, "band"), problem.guess("cubic")
    columns = random.uniform(-0.4, 0.4, (problem.grid.intervals, problem.ld.columns, n))
    model = action.model(path, None, None)
    return action.retract(path, model.scatter(columns), model)


@pytest.fixture(params=["planar", "free-flyer", "continuous"])
def robot(request: pytest.FixtureRequest) -> hovi.Robot:
    return load_robot(with_arm(request.param))


@pytest.mark.parametrize("case", CASES)
def test_derivatives_are_those_of_the_equations(robot: hovi.Robot, case: str) -> None:
    require_exact_derivatives(problem_of(robot, CASES[case]))


def test_derivatives_of_a_function_without_casadi(two_link: hovi.Robot) -> None:
    require_exact_derivatives(problem_of(two_link, Product()))


def lagrangian(problem: TrajectoryProblem, x: DiscretePath) -> ActionObjective:
    """The action with multipliers of the equations, which are zero."""
    return ActionObjective(problem, "band", multipliers=first_multipliers(problem, x))


def kkt(action: ActionObjective, x: DiscretePath) -> KktModel:
    model = action.model(x, None, None)
    assert isinstance(model, BandModel)
    return action.kkt(x, model)


def require_exact_derivatives(problem: TrajectoryProblem) -> None:
    x, random = random_path(problem), np.random.default_rng(1)
    action = lagrangian(problem, x)
    action.hold(random.uniform(-1, 1, len(action.residual(x))))
    model = kkt(action, x)
    step = random.uniform(-0.1, 0.1, len(model.gradient))

    def along(t: Array) -> Array:
        there = action.retract(x, t[0] * step, model.plain)
        return np.append(action.residual(there), action.value(there))

    def slope(t: Array) -> Array:
        return derivative(lambda s: along(t + s), np.zeros(1))[-1]

    first = derivative(along, np.zeros(1))[:, 0]
    size = np.abs(first).max()
    np.testing.assert_allclose(model.jacobian_product(step), first[:-1], atol=1e-8 * size)
    assert model.gradient @ step == pytest.approx(first[-1], abs=1e-8 * size)
    second = float(derivative(slope, np.zeros(1))[0, 0])
    assert model.curvature(step) == pytest.approx(second, rel=1e-5)


@pytest.mark.parametrize("twice", [False, True])
@pytest.mark.parametrize("case", CASES)
def test_n_neg_is_that_of_the_reduced_hessian(case: str, twice: bool) -> None:
    """Also where rows are written twice, which depend on each other."""
    functions = [CASES[case]] * (1 + twice)
    problem = problem_of(load_robot(with_arm("planar")), *functions)
    x, found = random_path(problem), []
    for seed, size in ((0, 1.0), (1, 30.0), (2, 1e3)):
        action = lagrangian(problem, x)
        c = action.residual(x)
        action.hold(size * np.random.default_rng(seed).uniform(-1, 1, len(c)))
        model = kkt(action, x)
        unit = np.eye(len(model.gradient))
        A = np.stack([model.jacobian_product(e) for e in unit], axis=1)
        square = np.array([model.curvature(e) for e in unit])
        H = np.diag(square)
        for i, j in zip(*np.triu_indices(len(unit), 1), strict=True):
            both = model.curvature(unit[i] + unit[j])
            H[i, j] = H[j, i] = 0.5 * (both - square[i] - square[j])
        _, size_of, rows = np.linalg.svd(A)
        rank = int((size_of > 1e-9 * size_of[0]).sum())
        tangent = rows[rank:].T
        eigenvalues = np.linalg.eigvalsh(tangent.T @ H @ tangent)
        assert np.abs(eigenvalues).min() > 1e-9 * np.abs(eigenvalues).max()
        found.append((model.negative_eigenvalues(), int((eigenvalues < 0).sum())))
    assert all(ours in (dense, -1) for ours, dense in found), found
    assert any(dense > 0 for _, dense in found)
    assert any(ours >= 0 for ours, _ in found)
    assert twice or all(ours == dense for ours, dense in found), found
