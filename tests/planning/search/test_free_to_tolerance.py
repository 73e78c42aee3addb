"""A free duration with a tolerance: both are met, and the estimate belongs to the result."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from hovi import Solution, Status, plan
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.measures.motion_error import deviation
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Accuracy, Tolerance
from hovi.planning.refinement.adaptive import refine_to_tolerance
from hovi.planning.refinement.candidate import Candidate
from hovi.planning.search import free_to_tolerance as free_to_tolerance_module
from hovi.planning.search.free_duration import FreeDuration, SolveFor
from hovi.planning.search.free_to_tolerance import free_to_tolerance
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task import Task
from hovi.robot.bundled_models import example
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from oracles.on_grid import solve_on_grid
from samples.paper_arm import HANG, REACH_Q, REACH_V

BOUNDS = 0.5, 6.0
WEIGHT = 50.0


@pytest.fixture(scope="module")
def task() -> Task:
    return load_task(example("ur5_reach.toml"))


@pytest.fixture(scope="module")
def reference(task: Task) -> Solution:
    return freed(task, scheme="galerkin-6", intervals=48)


def freed(task: Task, **options: object) -> Solution:
    fixed = {"time_weight": WEIGHT, "limits": "none", "processes": 1}
    return plan(
        task.scene, task.start, task.goal, BOUNDS, **(fixed | options), self_collision=False
    )  # type: ignore[arg-type]


def accuracy_of(solution: Solution) -> Accuracy:
    assert solution.accuracy is not None
    return solution.accuracy


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6, 1e-8])
def test_cost_and_duration_are_those_of_the_limit(
    task: Task, reference: Solution, tolerance: float
) -> None:
    found = freed(task, tolerance=tolerance)
    accuracy, T = accuracy_of(found), found.trajectory.duration
    assert found.success
    assert accuracy.reached
    motion = reference.cost - WEIGHT * reference.trajectory.duration
    true = abs(found.cost - reference.cost) / motion
    assert true <= tolerance
    assert accuracy.error / 10 <= true <= 10 * accuracy.error
    # the cost is stationary in the duration
    assert reference.trajectory.duration == pytest.approx(T, rel=np.sqrt(accuracy.error))
    assert found.minima == (found.cost,)


def test_the_slope_of_the_cost_vanishes_on_the_final_grid(task: Task) -> None:
    found = freed(task, tolerance=1e-7)
    assert found.duration_derivative == pytest.approx(-WEIGHT, rel=1e-8)
    assert found.problem is not None
    assert found.problem.grid is found.trajectory.grid
    motion = found.problem.ld.action(found.trajectory.path)
    assert found.cost == pytest.approx(motion + WEIGHT * found.trajectory.duration, rel=1e-13)
    assert "The best duration is" in found.message
    assert "estimated error" in found.message


def test_the_tip_is_within_the_tolerance_at_the_returned_duration(task: Task) -> None:
    found = freed(task, tolerance="0.01 mm")
    T = found.trajectory.duration
    ends = task.scene, task.start, task.goal, T
    fine = {"scheme": "galerkin-6", "intervals": 48, "guess": found.trajectory}
    exact = plan(*ends, limits="none", processes=1, **fine, self_collision=False)  # type: ignore[arg-type]
    assert found.problem is not None
    costs = found.problem.ld.action(found.trajectory.path), exact.cost
    error = deviation(found.trajectory, exact.trajectory, costs)
    assert accuracy_of(found).reached
    assert error.largest_tip <= 1e-5
    assert accuracy_of(found).error / 10 <= error.largest_tip <= 10 * accuracy_of(found).error


def test_a_duration_at_its_bound_is_kept(arm_scene: Scene) -> None:
    goal = State(REACH_Q, REACH_V)
    options = {"limits": "none", "time_weight": 1e4, "tolerance": 1e-6, "processes": 1}
    found = plan(arm_scene, HANG, goal, (0.8, 1.6), **options)  # type: ignore[arg-type]
    assert found.trajectory.duration == pytest.approx(0.8, rel=1e-14)
    assert accuracy_of(found).reached
    assert "kept at its bound" in found.message
    fixed = plan(arm_scene, HANG, goal, 0.8, limits="none", tolerance=1e-9)
    assert found.cost - 1e4 * 0.8 == pytest.approx(fixed.cost, rel=1e-6)


def test_no_accuracy_is_claimed_without_a_minimum(arm_scene: Scene) -> None:
    options = {"limits": "none", "max_iterations": 2, "continuation": False, "tolerance": 1e-6}
    found = plan(arm_scene, HANG, -HANG, (2.0, 4.0), processes=1, **options)  # type: ignore[arg-type]
    assert found.status is Status.ITERATION_LIMIT
    assert found.accuracy is None
    assert found.error_estimate is None


def minimum_on(task: Task, grid: Grid, guess: Trajectory | str = "cubic") -> Solution:
    ld = DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    return solve_on_grid(TrajectoryProblem(ld, task.start, task.goal), guess)


def solver_on(task: Task, grid: Grid) -> SolveFor:
    return lambda T, guess: minimum_on(task, grid.stretched(T), guess)


def in_vain(solution: Solution) -> Solution:
    """Refinement whose time is up at the start."""
    return refine_to_tolerance(solution, Tolerance(1e-14), time_limit=0.0)


@pytest.mark.parametrize(
    ("later_steps", "later_refine", "status", "reason"),
    [
        (0, None, Status.UNRESOLVED, "durations cost less by"),
        (None, None, Status.INTERRUPTED, "the search for the best duration was interrupted"),
        (500, in_vain, Status.MINIMUM, "stopped early: the time limit was reached"),
    ],
)
def test_only_a_motion_whose_duration_is_the_best_on_its_grid_is_a_minimum_if_a_later_round_fails(
    task: Task,
    later_steps: int | None,
    later_refine: Callable[[Solution], Solution] | None,
    status: Status,
    reason: str,
) -> None:
    coarse = Grid.uniform(task.duration, 12, galerkin(2))
    refine = partial(refine_to_tolerance, tolerance=Tolerance(1e-7))
    refined: list[Solution] = []

    def on_grid(grid: Grid) -> SolveFor:
        def solve_for(T: float, guess: Trajectory) -> Solution:
            stretched = Grid(grid.steps * (T / grid.duration), grid.schemes)
            ld = DiscreteLagrangian(task.scene.effort_lagrangian(), stretched)
            problem = TrajectoryProblem(ld, task.start, task.goal)
            if refined and later_steps is None:
                raise KeyboardInterrupt
            most = later_steps if refined and later_steps is not None else 500
            return solve_on_grid(problem, guess, max_iterations=most)

        return solve_for

    def each_refine(solution: Solution) -> Solution:
        refined.append((refine if not refined or later_refine is None else later_refine)(solution))
        return refined[-1]

    first = minimum_on(task, coarse)
    found = free_to_tolerance(FreeDuration(*BOUNDS, WEIGHT), on_grid, each_refine, first)
    assert accuracy_of(refined[0]).reached
    assert found.success == (status is Status.MINIMUM)
    assert found.status is status
    assert reason in found.message
    slope = abs(found.duration_derivative + WEIGHT)
    assert found.success == (slope <= 1e-7 * WEIGHT)
    # the last motion within the tolerance, unless only the later one has its best duration
    assert found.trajectory is refined[-1 if found.success else 0].trajectory
    assert accuracy_of(found).reached != found.success


def test_limits_hold_in_the_best_duration(arm_scene: Scene) -> None:
    options = {"limits": {"base": "none", "v": 4.0}, "tolerance": 1e-3, "processes": 1}
    goal = State(REACH_Q)
    found = plan(arm_scene, HANG, goal, (0.5, 3.0), time_weight=200.0, **options)  # type: ignore[arg-type]
    assert found.success
    assert accuracy_of(found).reached
    t = np.linspace(0.0, found.trajectory.duration, 1001)
    assert np.abs(found.trajectory.sample(t).v).max() <= 4.0 * (1 + 1e-5)


def test_a_tolerance_that_is_not_reached_ends_the_search(task: Task) -> None:
    """No further grid is tried, and no motion refined twice."""
    first = minimum_on(task, Grid.uniform(1.0, 12, galerkin(2)))
    refined: list[Solution] = []

    def refine(solution: Solution) -> Solution:
        refined.append(in_vain(solution))
        return refined[-1]

    found = free_to_tolerance(
        FreeDuration(0.9, 1.1, WEIGHT), partial(solver_on, task), refine, first
    )
    assert len(refined) == 1
    assert not accuracy_of(found).reached
    assert accuracy_of(found).rounds == accuracy_of(refined[0]).rounds


def test_a_duration_that_is_far_from_the_best_is_not_called_the_best(arm_scene: Scene) -> None:
    """A joint solve that leaves the duration where it is, on a grid that needs no refinement."""
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid.uniform(1.0, 24, galerkin(4)))
    first = solve_on_grid(TrajectoryProblem(ld, State(HANG), State(REACH_Q)))

    def on_grid(grid: Grid) -> SolveFor:
        raise AssertionError("the grid is kept")

    def refine(solution: Solution) -> Solution:
        return refine_to_tolerance(solution, Tolerance(1e-2))

    def kept(solution: Solution) -> Solution:
        return solution

    rate = first.duration_derivative
    for share, status in (
        (0.5, Status.UNRESOLVED),
        (0.999, Status.UNRESOLVED),
        (1, Status.MINIMUM),
    ):
        free = FreeDuration(0.5, 6.0, share * abs(rate))
        found = free_to_tolerance(free, lambda grid: partial(on_grid, grid), refine, first, kept)
        assert found.status is status, found.message
        assert found.success == (status is Status.MINIMUM)
        assert ("longer durations cost less by" in found.message) != found.success


@pytest.mark.parametrize("tolerance", [1e-7, 1e-13])
def test_after_the_last_grid_the_duration_is_the_best_and_the_error_is_that_of_the_motion(
    task: Task, monkeypatch: pytest.MonkeyPatch, tolerance: float
) -> None:
    """Also where the tolerance was not reached."""
    monkeypatch.setattr(free_to_tolerance_module, "MAX_GRIDS", 1)
    refined: list[Solution] = []

    def refine(solution: Solution) -> Solution:
        refined.append(refine_to_tolerance(solution, Tolerance(tolerance)))
        return refined[-1]

    first = minimum_on(task, Grid.uniform(1.0, 6, galerkin(2)))
    found = free_to_tolerance(
        FreeDuration(*BOUNDS, WEIGHT), partial(solver_on, task), refine, first
    )
    assert len(refined) == 1
    assert abs(refined[0].duration_derivative + WEIGHT) > 1e-7 * WEIGHT
    assert found.success, found.message
    assert abs(found.duration_derivative + WEIGHT) <= 1e-7 * WEIGHT
    accuracy, T = accuracy_of(found), found.trajectory.duration
    measured = Candidate.of(
        dataclasses.replace(found, cost=found.cost - WEIGHT * T), Tolerance(tolerance)
    )
    assert accuracy.error == pytest.approx(measured.error, rel=0.1)
    assert accuracy.reached == measured.within_tolerance
    assert accuracy.reached == (accuracy.reason == "") != ("stopped early" in found.message)
