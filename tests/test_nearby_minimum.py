"""A minimum nearby is found with few Hessians, and it is the optimiser's."""

from __future__ import annotations

import numpy as np
import pytest

from hovi.certificate import momentum_jump
from hovi.discrete_lagrangian import DiscreteLagrangian
from hovi.effects import Gravity
from hovi.finer_solution import finer_grid, prolonged
from hovi.grid import Grid
from hovi.guess import moved
from hovi.nearby_minimum import CORRECTIONS, nearby_minimum
from hovi.problem import TrajectoryProblem
from hovi.relaxed_modes import relaxed
from hovi.robot import load_robot
from hovi.scene import Scene
from hovi.schemes import galerkin
from hovi.solver import Solution, Status, solve
from hovi.state import State
from hovi.trajectory_objective import ActionObjective
from paper_arm import HANG, REACH_Q, REACH_V

UR5_START = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1]
UR5_GOAL = [1.2, -0.6, 0.4, 0.7, -0.8, 1.0]


@pytest.fixture(scope="module")
def ur5() -> Solution:
    scene = Scene(load_robot("ur5"), effects=[Gravity()])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.5, 12, galerkin(4)))
    solution = solve(TrajectoryProblem(ld, State(UR5_START), State(UR5_GOAL)))
    assert solution.success
    return solution


def finer(solution: Solution) -> TrajectoryProblem:
    assert solution.problem is not None
    return solution.problem.on(finer_grid(solution.problem.grid))


# Newton's method


def test_it_is_the_optimisers_minimum(ur5: Solution) -> None:
    problem = finer(ur5)
    start = prolonged(ur5.trajectory.path, problem.grid)
    found = nearby_minimum(ActionObjective(problem), relaxed(problem.ld, start).path)
    assert found is not None
    solution, exact = found.solution(), solve(problem, start)
    assert solution is not None
    assert (solution.success, solution.status, solution.n_neg) == (True, Status.MINIMUM, 0)
    assert solution.cost == pytest.approx(exact.cost, rel=1e-13)
    np.testing.assert_allclose(solution.trajectory.q, exact.trajectory.q, atol=1e-10)
    p = exact.trajectory.momenta
    np.testing.assert_allclose(solution.trajectory.momenta, p, atol=1e-8 * np.abs(p).max())
    assert momentum_jump(problem, solution.trajectory) < 1e-9
    assert solution.cost == problem.ld.action(solution.trajectory.path)
    assert solution.nit >= found.steps


def test_its_value_is_the_action_that_is_left(ur5: Solution) -> None:
    problem = finer(ur5)
    start = prolonged(ur5.trajectory.path, problem.grid)
    found = nearby_minimum(ActionObjective(problem), relaxed(problem.ld, start).path)
    assert found is not None
    left = problem.ld.action(start) - solve(problem, start).cost
    assert problem.ld.action(start) - found.value == pytest.approx(left, rel=1e-3)


def test_a_hessian_is_renewed_where_the_way_is_long(arm_scene: Scene) -> None:
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid.uniform(1.0, 8, galerkin(3)))
    there = solve(TrajectoryProblem(ld, State(HANG), State(REACH_Q, REACH_V)))
    other = solve(TrajectoryProblem(ld, State(HANG), State(np.add(REACH_Q, 0.2), REACH_V)))
    assert there.problem is not None
    problem = there.problem
    start = moved(other.trajectory.path, problem.grid, problem.boundary, problem.robot)
    found = nearby_minimum(ActionObjective(problem), start)
    assert found is not None
    assert found.steps > CORRECTIONS
    solution = found.solution()
    assert solution is not None
    np.testing.assert_allclose(solution.trajectory.q, there.trajectory.q, atol=1e-10)


def test_far_from_a_minimum_nothing_is_found(arm_scene: Scene) -> None:
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid.uniform(3.0, 16, galerkin(2)))
    problem = TrajectoryProblem(ld, State(HANG), State(-HANG))
    start = relaxed(ld, solve(problem, max_iterations=1).trajectory.path).path
    assert nearby_minimum(ActionObjective(problem), start) is None


# Inner modes


def test_relaxed_modes_make_every_interval_extremal(ur5: Solution) -> None:
    problem = finer(ur5)
    start = prolonged(ur5.trajectory.path, problem.grid)
    after = relaxed(problem.ld, start)
    for name in ("q", "v", "z"):
        np.testing.assert_array_equal(getattr(after.path, name), getattr(start, name))
    forces = [np.abs(problem.ld.gradient(x)[:, 4:]).max() for x in (start, after.path)]
    assert forces[1] < 1e-2 * forces[0]
    fallen = problem.ld.values(start) - problem.ld.values(after.path)
    foreseen = problem.ld.values(start) - after.values
    np.testing.assert_allclose(foreseen, fallen, rtol=0.05, atol=1e-3 * fallen.max())


def test_intervals_of_different_degree_are_relaxed_together(arm_scene: Scene) -> None:
    grid = Grid(np.full(6, 1 / 6), tuple(galerkin(r) for r in (0, 1, 4, 2, 3, 0)))
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    problem = TrajectoryProblem(ld, State(HANG), State(REACH_Q, REACH_V))
    path = problem.path(solve(problem).trajectory.jet)
    after = relaxed(ld, path).path
    assert not after.inner[[0, 5]].any()
    assert not after.inner[1, 1:].any()
    assert np.abs(ld.gradient(after)[:, 4:]).max() < 1e-6 * np.abs(ld.gradient(path)).max()
