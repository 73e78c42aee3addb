"""A nearby minimum is found with few Hessians and agrees with the optimiser's."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hovi import Solution, Status
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.path_on_grid import moved
from hovi.discrete.state import State
from hovi.effects import Gravity
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.certificate import momentum_jump
from hovi.planning.refinement.error_estimate import prolonged
from hovi.planning.refinement.interpolated_outputs import interpolated_slopes
from hovi.planning.refinement.nearby_minimum import (
    MAX_REUSE_DISTANCE,
    NearbyMinimum,
    nearby_minimum,
)
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.task_file.reading import load_task
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from oracles.on_grid import solve_on_grid
from samples.paper_arm import HANG, REACH_Q, REACH_V

UR5_START = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1]
UR5_GOAL = [1.2, -0.6, 0.4, 0.7, -0.8, 1.0]


@pytest.fixture(scope="module")
def ur5() -> Solution:
    scene = Scene(load_robot("ur5"), effects=[Gravity()])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.5, 12, galerkin(4)))
    solution = solve_on_grid(TrajectoryProblem(ld, State(UR5_START), State(UR5_GOAL)))
    assert solution.success
    return solution


def finer(solution: Solution) -> TrajectoryProblem:
    assert solution.problem is not None
    return solution.problem.finer


def approached(solution: Solution, problem: TrajectoryProblem) -> NearbyMinimum | None:
    """The nearby minimum on the finer grid, from the solution's own curve."""
    assert solution.problem is not None
    path = solution.trajectory.path
    objective, start = ActionObjective(problem), prolonged(path, problem.grid)
    efforts = interpolated_slopes(solution.problem.ld, path, problem.ld)
    model = objective.model_with(start, efforts, None)
    return nearby_minimum(objective, start, model, known=solution.cost)


# Newton's method


def test_it_is_the_optimisers_minimum(ur5: Solution) -> None:
    problem = finer(ur5)
    found = approached(ur5, problem)
    assert found is not None
    solution = found.solution()
    exact = solve_on_grid(problem, prolonged(ur5.trajectory.path, problem.grid))
    assert solution is not None
    assert (solution.success, solution.status, solution.n_neg) == (True, Status.MINIMUM, 0)
    assert solution.cost == pytest.approx(exact.cost, rel=1e-13)
    np.testing.assert_allclose(solution.trajectory.q, exact.trajectory.q, atol=1e-10)
    p = exact.trajectory.momenta
    np.testing.assert_allclose(solution.trajectory.momenta, p, atol=1e-8 * np.abs(p).max())
    assert momentum_jump(problem, solution.trajectory) < 1e-9
    assert solution.cost == problem.ld.action(solution.trajectory.path)
    assert solution.nit >= found.steps


def test_its_value_gives_the_difference_of_costs(ur5: Solution) -> None:
    problem = finer(ur5)
    found = approached(ur5, problem)
    assert found is not None
    exact = solve_on_grid(problem, prolonged(ur5.trajectory.path, problem.grid)).cost
    assert ur5.cost - found.value == pytest.approx(ur5.cost - exact, rel=0.02)


def test_a_minimum_some_way_off_takes_several_hessians(arm_scene: Scene) -> None:
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid.uniform(1.0, 8, galerkin(3)))
    there = solve_on_grid(TrajectoryProblem(ld, State(HANG), State(REACH_Q, REACH_V)))
    other = solve_on_grid(TrajectoryProblem(ld, State(HANG), State(np.add(REACH_Q, 0.2), REACH_V)))
    assert there.problem is not None
    problem, objective = there.problem, ActionObjective(there.problem)
    start = moved(other.trajectory.path, problem.grid, problem.ends, problem.robot)
    first = objective.model(start, None, None)
    found = nearby_minimum(objective, start, first)
    assert found is not None
    assert found.model is not first
    farther = dataclasses.replace(found, distance=2 * MAX_REUSE_DISTANCE)
    for end in (found, farther):  # with the last Hessian, and with a new one
        solution = end.solution()
        assert solution is not None
        assert solution.n_neg == 0
        np.testing.assert_allclose(solution.trajectory.q, there.trajectory.q, atol=1e-10)


def test_far_from_a_minimum_nothing_is_found(arm_scene: Scene) -> None:
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid.uniform(3.0, 16, galerkin(2)))
    problem = TrajectoryProblem(ld, State(HANG), State(-HANG))
    start = solve_on_grid(problem, max_iterations=1).trajectory.path
    objective = ActionObjective(problem)
    assert nearby_minimum(objective, start, objective.model(start, None, None)) is None


# Interpolated torques


def test_efforts_interpolated_to_the_same_points_are_the_torques_there(ur5: Solution) -> None:
    assert ur5.problem is not None
    ld = ur5.problem.ld
    (interpolated,) = interpolated_slopes(ld, ur5.trajectory.path, ld)
    (tau,) = ActionObjective(ur5.problem).outputs(ur5.trajectory.path)
    np.testing.assert_allclose(interpolated, tau, atol=1e-10 * np.abs(tau).max())


def test_interpolated_slopes_are_nearer_to_the_right_ones(ur5: Solution) -> None:
    problem = finer(ur5)
    assert ur5.problem is not None
    path = prolonged(ur5.trajectory.path, problem.grid)
    objective = ActionObjective(problem)
    (right,) = objective.outputs(solve_on_grid(problem, path).trajectory.path)
    (own,) = objective.outputs(path)
    (interpolated,) = interpolated_slopes(ur5.problem.ld, ur5.trajectory.path, problem.ld)
    assert np.abs(interpolated - right).max() < 0.2 * np.abs(own - right).max()


def test_a_grid_of_other_intervals_and_degrees_sees_the_same_torques(arm_scene: Scene) -> None:
    lagrangian = arm_scene.effort_lagrangian([1.0, 3.0])
    mixed = Grid(np.array([0.3, 0.2, 0.1, 0.4]), tuple(galerkin(r) for r in (6, 5, 5, 8)))
    ld = DiscreteLagrangian(lagrangian, mixed)
    problem = TrajectoryProblem(ld, State(HANG), State(REACH_Q, REACH_V))
    motion = solve_on_grid(problem).trajectory
    other = DiscreteLagrangian(lagrangian, Grid(np.full(5, 0.2), (galerkin(2),) * 5))
    (interpolated,) = interpolated_slopes(ld, motion.path, other)
    tau = motion.sample(other.point_times[0]).tau
    scale = np.abs(tau).max()
    np.testing.assert_allclose(interpolated, np.array([1.0, 3.0]) * tau, atol=0.01 * scale)


def test_a_hessian_weighted_so_stays_definite_beside_a_minimum() -> None:
    task = load_task(example("panda_reach.toml"))
    grid = Grid.uniform(task.duration, 10, galerkin(4))
    ld = DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    assert isinstance(task.goal, State)
    solution = solve_on_grid(TrajectoryProblem(ld, task.start, task.goal))
    problem = finer(solution)
    start, objective = prolonged(solution.trajectory.path, problem.grid), ActionObjective(problem)
    efforts = interpolated_slopes(ld, solution.trajectory.path, problem.ld)
    assert objective.model(start, None, None).factor(0.0) is None
    assert objective.model_with(start, efforts, None).factor(0.0) is not None
    found = approached(solution, problem)
    assert found is not None
    minimum = found.solution()
    assert minimum is not None
    assert ActionObjective(problem).model(minimum.trajectory.path, None, None).factor(0.0)
    assert found.steps < 0.5 * solve_on_grid(problem, start).nit
