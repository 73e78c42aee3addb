"""The discrete action as an objective: band and tree give the same model on every grid."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import regularized
from hovi.discrete.state import State
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.hessian_structure import ActionStructure
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import (
    MAX_CHART_TURN,
    ActionObjective,
    LinearAlgebra,
)
from hovi.planning.solver.multipliers import Multipliers
from hovi.planning.solver.solver import guess_path
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task import Task
from hovi.robot.bundled_models import example
from hovi.scene.scene import Scene
from hovi.schemes import by_name
from oracles.finite_differences import derivative
from samples.random_paths import random_path

Array = npt.NDArray[np.float64]

ALGEBRAS: list[LinearAlgebra] = ["band", "tree"]
GRIDS = {
    "one interval": Grid.uniform(0.4, 1, by_name("galerkin-2")),
    "uniform": Grid.uniform(1.0, 6, by_name("galerkin-1")),
    "other steps": Grid(np.array([0.1, 0.3, 0.05, 0.2, 0.35]), (by_name("galerkin-1"),) * 5),
    "other schemes": Grid(
        np.full(5, 0.2),
        tuple(
            by_name(f"{name}")
            for name in ("galerkin-2", "taylor-midpoint", "galerkin-0", "galerkin-3", "galerkin-2")
        ),
    ),
    "other steps and schemes": Grid(
        np.array([0.1, 0.3, 0.05]),
        tuple(by_name(name) for name in ("galerkin-0", "galerkin-2", "hermite-simpson")),
    ),
}


@pytest.fixture(params=GRIDS)
def grid(request: pytest.FixtureRequest) -> Grid:
    return GRIDS[request.param]


def objective(
    scene: Scene, grid: Grid, path: DiscretePath, algebra: LinearAlgebra
) -> ActionObjective:
    ends = State(path.q[0], path.v[0]), State(path.q[-1], path.v[-1])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), grid)
    return ActionObjective(TrajectoryProblem(ld, *ends), algebra)


def coordinates(path: DiscretePath) -> Array:
    """The unknowns: inner nodes and inner modes."""
    return np.concatenate([path.q[1:-1].ravel(), path.v[1:-1].ravel(), path.inner.ravel()])


def path_at(grid: Grid, scene: Scene, origin: DiscretePath, x: Array) -> DiscretePath:
    """The path with other coordinates, z computed from the nodes."""
    q, v = origin.q.copy(), origin.v.copy()
    nodes = q[1:-1].size
    q[1:-1], v[1:-1] = (x[i * nodes : (i + 1) * nodes].reshape(-1, 2) for i in (0, 1))
    inner = x[2 * nodes :].reshape(origin.inner.shape)
    return DiscretePath(q, v, regularized(scene.robot, grid, q, v), inner)


def assert_consistent(scene: Scene, grid: Grid, path: DiscretePath) -> None:
    z = regularized(scene.robot, grid, path.q, path.v)
    np.testing.assert_allclose(path.z, z, rtol=0, atol=1e-9 * np.abs(z).max())
    for k, scheme in enumerate(grid.schemes):
        assert not path.inner[k, scheme.inner_modes :].any()


def definite_shift(model: object) -> float:
    """A shift for which H + shift D is positive definite."""
    shift = 0.0
    while model.factor(shift) is None:  # type: ignore[attr-defined]
        shift = max(10 * shift, 1e-6)
    return shift


@pytest.mark.parametrize("algebra", ALGEBRAS)
def test_the_gradient_and_the_hessian_are_those_of_the_action_along_every_step(
    arm_scene: Scene, grid: Grid, algebra: LinearAlgebra
) -> None:
    path = random_path(grid, 2, seed=1)
    action = objective(arm_scene, grid, path, algebra)
    model = action.model(path, None, None)
    for seed in range(4):
        s = model.random_vector(seed)
        s /= np.sqrt(np.vdot(s, model.metric_product(s)))
        if not model.gather(s).any():  # a tree's slot of a mode that does not exist
            continue
        e = 1e-4

        def value(e: float, s: Array = s) -> float:
            return action.value(action.retract(path, e * s, model))

        slope = (8 * (value(e) - value(-e)) - value(2 * e) + value(-2 * e)) / (12 * e)
        bend = (16 * (value(e) + value(-e)) - value(2 * e) - value(-2 * e) - 30 * value(0)) / (
            12 * e**2
        )
        local = model.gather(s)
        exact = np.einsum("kia,kijab,kjb->", local, model.intervals.hessian, local)
        size = abs(action.value(path))
        assert np.vdot(model.gradient, s) == pytest.approx(slope, rel=1e-7, abs=1e-8 * size)
        assert exact == pytest.approx(bend, rel=1e-4, abs=1e-4 * size)


@pytest.mark.parametrize("algebra", ALGEBRAS)
def test_a_step_leads_to_a_path_whose_parts_fit_together(
    arm_scene: Scene, grid: Grid, algebra: LinearAlgebra
) -> None:
    path = random_path(grid, 2, seed=2)
    action = objective(arm_scene, grid, path, algebra)
    model = action.model(path, None, None)
    moved = action.retract(path, 1e-2 * model.random_vector(0), model)
    assert_consistent(arm_scene, grid, moved)
    for found, expected in ((moved.q, path.q), (moved.v, path.v)):
        np.testing.assert_array_equal(found[[0, -1]], expected[[0, -1]])
    assert np.abs(coordinates(moved) - coordinates(path)).max() > 1e-6


def test_band_and_tree_take_the_same_steps(arm_scene: Scene, grid: Grid) -> None:
    path = random_path(grid, 2, seed=3)
    actions = [objective(arm_scene, grid, path, algebra) for algebra in ALGEBRAS]
    models = [action.model(path, None, None) for action in actions]
    least = max(definite_shift(model) for model in models)
    for shift in (least, 10 * least + 1.0):
        steps = []
        for action, model in zip(actions, models, strict=True):
            factor = model.factor(shift)
            assert factor is not None
            moved = action.retract(path, factor.solve(-model.gradient), model)
            steps.append(coordinates(moved) - coordinates(path))
        scale = np.abs(steps[0]).max()
        np.testing.assert_allclose(steps[0], steps[1], rtol=0, atol=1e-8 * scale)


def test_the_metric_is_the_square_of_the_change_of_the_acceleration(
    arm_scene: Scene, grid: Grid
) -> None:
    path = random_path(grid, 2, seed=4)
    for algebra in ALGEBRAS:
        action = objective(arm_scene, grid, path, algebra)
        model = action.model(path, None, None)
        s = model.random_vector(0)
        moved = action.retract(path, s, model)
        total = 0.0
        for k, (h, scheme) in enumerate(zip(grid.steps, grid.schemes, strict=True)):
            before, after = (
                np.concatenate([h * x.v[k : k + 1], h**2 * x.z[k], h**2 * x.inner[k]])
                for x in (path, moved)
            )
            r = scheme.inner_modes
            da = scheme.table[:, 2] @ (after - before)[: 3 + r] / h**2
            total += h * float(scheme.weights @ (da**2).sum(axis=1))
        expected = grid.duration**3 * total
        assert np.vdot(s, model.metric_product(s)) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("algebra", ALGEBRAS)
def test_multipliers_of_the_last_step_keep_value_and_gradient(
    arm_scene: Scene, grid: Grid, algebra: LinearAlgebra
) -> None:
    path = random_path(grid, 2, seed=5)
    action = objective(arm_scene, grid, path, algebra)
    model = action.model(path, None, None)
    step = 1e-3 * model.random_vector(0)
    moved = action.retract(path, step, model)
    lifted = action.model(moved, model, step)
    fresh = objective(arm_scene, grid, path, algebra).model(moved, None, None)
    np.testing.assert_allclose(lifted.gradient, fresh.gradient, rtol=1e-12, atol=1e-12)
    difference = np.abs(lifted.intervals.hessian - fresh.intervals.hessian).max()
    assert 0 < difference < 1e-2 * np.abs(fresh.intervals.hessian).max()


# With equality constraints: passive joints, at points and as moments, and conditions at nodes


CONDITIONS = "conditions at nodes"
CONSTRAINED = {
    CONDITIONS: ("ur5_reach", ("galerkin-1",) * 4),
    "arm": ("pendubot_swing_up", ("galerkin-1x5",) * 4),
    "arm, at points": ("pendubot_swing_up", ("galerkin-1",) * 4),
    "floating base": ("spacecraft_reorients", ("galerkin-1x5",) * 4),
    "several schemes": (
        "spacecraft_reorients",
        ("galerkin-2x6", "hermite-simpson", "galerkin-1", "galerkin-0x4"),
    ),
}


def conditions(task: Task) -> dict[str, Any]:
    """A position to be reached in space, and a configuration to be passed on the way."""
    q = np.stack([np.asarray(each.q, dtype=float) for each in (task.start, task.goal)])
    there = task.scene.robot.frame_position("tool0", q[1:])[0]
    via = (Via(0.5, State(q.mean(axis=0))),)
    return {"goal": FrameGoal("tool0", position=there), "via": via}


@pytest.fixture(params=CONSTRAINED)
def penalized(request: pytest.FixtureRequest) -> tuple[ActionObjective, DiscretePath]:
    """An augmented Lagrangian with random multipliers, and a random path."""
    name, schemes = CONSTRAINED[request.param]
    task, random = load_task(example(name)), np.random.default_rng(9)
    grid = Grid(np.array([0.2, 0.3, 0.25, 0.15]), tuple(by_name(each) for each in schemes))
    ld = DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    more = conditions(task) if request.param == CONDITIONS else {"goal": task.goal}
    problem = TrajectoryProblem(ld, task.start, **more)
    known = Multipliers.zero(problem, 7.0, 1e3)
    nodes = [1e3 * random.normal(size=len(zero)) for zero in known.nodes]
    forces = []
    for zero in known.torque:
        force = zero.copy()
        force[:, problem.passive] = random.normal(size=(len(zero), len(problem.passive)))
        forces.append(force)
    known = dataclasses.replace(known, torque=forces, nodes=nodes)
    action = ActionObjective(problem, multipliers=known)
    path = guess_path(problem, "cubic")
    model = action.model(path, None, None)
    return action, action.retract(path, 0.05 * model.random_vector(0), model)


def test_derivatives_of_the_augmented_lagrangian_are_exact(
    penalized: tuple[ActionObjective, DiscretePath],
) -> None:
    action, path = penalized
    model = action.model(path, None, None)
    for seed in range(3):
        s = model.random_vector(seed)
        s /= np.sqrt(np.vdot(s, model.metric_product(s)))

        def along(e: Array, s: Array = s) -> Array:
            return np.array(action.value(action.retract(path, e[0] * s, model)))

        slope = derivative(along, np.zeros(1), 1e-3)
        bend = derivative(lambda x, f=along: derivative(f, x, 1e-2), np.zeros(1), 1e-2)
        local = model.gather(s)
        exact = np.einsum("kia,kijab,kjb->", local, model.intervals.hessian, local)
        size = abs(action.value(path))
        assert np.vdot(model.gradient, s) == pytest.approx(
            float(slope[0]), rel=1e-6, abs=1e-9 * size
        )
        assert exact == pytest.approx(float(bend[0, 0]), rel=1e-5, abs=1e-6 * size)


def test_predicted_torques_keep_value_and_gradient_of_the_augmented_lagrangian(
    penalized: tuple[ActionObjective, DiscretePath],
) -> None:
    action, path = penalized
    model = action.model(path, None, None)
    step = 1e-3 * model.random_vector(0)
    moved = action.retract(path, step, model)
    lifted = action.model(moved, model, step)
    fresh = ActionObjective(action.problem, multipliers=action.multipliers)
    exact = fresh.model(moved, None, None)
    scale = np.abs(exact.gradient).max()
    np.testing.assert_allclose(lifted.gradient, exact.gradient, rtol=0, atol=1e-12 * scale)
    difference = np.abs(lifted.intervals.hessian - exact.intervals.hessian).max()
    assert 0 < difference < 1e-2 * np.abs(exact.intervals.hessian).max()


def test_relative_size_is_the_largest_change_of_all_that_moves(
    arm_scene: Scene, grid: Grid
) -> None:
    path = random_path(grid, 2, seed=6)
    for algebra in ALGEBRAS:
        action = objective(arm_scene, grid, path, algebra)
        model = action.model(path, None, None)
        step = model.random_vector(0)
        moved = action.retract(path, step, model)
        T, hh = grid.duration, grid.steps[:, None, None] ** 2
        changes = moved.q - path.q, T * (moved.v - path.v), hh * (moved.inner - path.inner)
        change = max(np.abs(x).max() for x in changes)
        size = max(1.0, np.abs(path.q).max(), T * np.abs(path.v).max())
        assert action.relative_size(path, step, model) == pytest.approx(change / size, rel=1e-9)


def test_every_inner_node_and_every_mode_is_one_unknown(grid: Grid) -> None:
    n, N = 2, grid.intervals
    layout = ActionStructure(grid, n).layout
    modes = sum(scheme.inner_modes for scheme in grid.schemes)
    assert layout.size == n * (2 * (N - 1) + modes)
    numbers = layout.unknowns[layout.unknowns >= 0]
    np.testing.assert_array_equal(np.unique(numbers), np.arange(layout.size))


def test_the_exact_model_has_the_same_inertia_in_any_algebra(arm_scene: Scene, grid: Grid) -> None:
    path = random_path(grid, 2, seed=7)
    counts = {
        objective(arm_scene, grid, path, algebra).negative_eigenvalues(path) for algebra in ALGEBRAS
    }
    assert len(counts) == 1


@pytest.mark.parametrize("algebra", ALGEBRAS)
def test_the_size_of_a_step_is_its_largest_change_in_either_direction(
    arm_scene: Scene, algebra: LinearAlgebra
) -> None:
    path = random_path(GRIDS["other steps"], 2, seed=4)
    action = objective(arm_scene, GRIDS["other steps"], path, algebra)
    model = action.model(path, None, None)
    for seed in range(6):
        step = model.random_vector(seed)
        size = action.relative_size(path, step, model)
        assert size > 0
        assert action.relative_size(path, -step, model) == size
        assert action.relative_size(path, -3 * step, model) == pytest.approx(3 * size, rel=1e-12)


@pytest.mark.parametrize("size", [1e2, 1e5, 1e8, 1e100, 1e160, 1e300])
@pytest.mark.parametrize("name", ["galerkin-1x5", "hermite-simpson"])
def test_a_path_far_beyond_its_charts_costs_infinity(name: str, size: float) -> None:
    """There, the charts hold NaN, which is neither below nor above any turn."""
    task = load_task(example("spacecraft_reorients"))
    grid = Grid.uniform(8.0, 4, by_name(name))
    ld = DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    problem = TrajectoryProblem(ld, task.start, task.goal)
    action, path = ActionObjective(problem), guess_path(problem, "cubic")
    model = action.model(path, None, None)
    moved = action.retract(path, size * model.random_vector(0), model)
    turns = ld.turns(moved)
    assert turns.max() > MAX_CHART_TURN
    assert not np.isnan(turns).any()
    assert action.value(moved) == np.inf
