"""A free duration with a tolerance: both are met, and the estimate belongs to the result."""

from __future__ import annotations

import numpy as np
import pytest

from hovi import Solution, Status, estimate_error, plan, solve
from hovi.discrete.measures.motion_error import deviation
from hovi.discrete.state import State
from hovi.planning.problem.tolerance import Accuracy
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task import Task
from hovi.robot.bundled_models import example
from hovi.scene.scene import Scene
from samples.paper_arm import HANG, REACH_Q, REACH_V
from samples.stopped_searches import InterruptedEvaluations

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


def test_limits_hold_in_the_best_duration(arm_scene: Scene) -> None:
    options = {"limits": {"base": "none", "v": 4.0}, "tolerance": 1e-3, "processes": 1}
    goal = State(REACH_Q)
    found = plan(arm_scene, HANG, goal, (0.5, 3.0), time_weight=200.0, **options)  # type: ignore[arg-type]
    assert found.success
    assert accuracy_of(found).reached
    t = np.linspace(0.0, found.trajectory.duration, 1001)
    assert np.abs(found.trajectory.sample(t).v).max() <= 4.0 * (1 + 1e-5)


@pytest.mark.parametrize("tolerance", [1e-7, 1e-13, 1e-16])
def test_the_duration_is_the_best_on_the_grid_of_the_motion_and_the_error_is_its_own(
    task: Task, tolerance: float
) -> None:
    """Also where rounding allows no error within the tolerance."""
    found = freed(task, tolerance=tolerance)
    assert found.success, found.message
    assert abs(found.duration_derivative + WEIGHT) <= 1e-7 * WEIGHT
    accuracy = accuracy_of(found)
    assert accuracy.reached == (accuracy.reason == "") != ("stopped early" in found.message)
    assert accuracy.reached == (accuracy.error <= tolerance)
    assert found.problem is not None
    fixed = solve(found.problem, found.trajectory)
    error = estimate_error(fixed)
    assert error is not None
    assert accuracy.error == pytest.approx(error.cost, rel=0.1, abs=2e-14)
    assert fixed.cost == pytest.approx(found.cost, rel=1e-9)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_an_interrupt_is_no_success_unless_the_duration_is_the_best(
    task: Task, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the first search, in a refinement, and in the search on a finer grid."""
    evaluations = InterruptedEvaluations(monkeypatch)
    freed(task, tolerance=1e-7, intervals=6)
    evaluations.restart(int(share * evaluations.calls))
    found = freed(task, tolerance=1e-7, intervals=6)
    slope = abs(found.duration_derivative + WEIGHT)
    if found.success:
        assert slope <= 1e-7 * WEIGHT
        assert not accuracy_of(found).reached
    else:
        assert found.status in (Status.INTERRUPTED, Status.UNRESOLVED)
        assert "interrupted" in found.message


@pytest.mark.parametrize("most", [1, 3, 6, 12])
def test_too_few_steps_leave_no_success_with_another_duration(task: Task, most: int) -> None:
    found = freed(task, tolerance=1e-7, max_iterations=most, continuation=False)
    if found.success:
        assert abs(found.duration_derivative + WEIGHT) <= 1e-7 * WEIGHT
    else:
        assert found.minima == ()
        assert found.status in (Status.ITERATION_LIMIT, Status.UNRESOLVED)
