"""Continuation: minima that the direct solve does not find, and limits on time and steps."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import hovi
from hovi import PlanOptions, Solution, Status, plan
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.state import State
from hovi.effects import Gravity
from hovi.planning.problem.limits import as_limits
from hovi.planning.search.continuation import may_help, solve_by_continuation
from hovi.planning.search.job import Job
from hovi.planning.solver.action_objective import ActionObjective
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from hovi.system.deadline import Deadline
from hovi.system.interruption import interrupted, interruptible
from oracles.on_grid import solve_on_grid
from samples.paper_arm import HANG, REACH_Q
from samples.uneven_chain import uneven_chain

STEPS = 300
"""Too few steps for a direct solve with a light hand, which takes some 500; enough per stage."""

GRID: dict[str, Any] = {"scheme": "galerkin-2", "intervals": 16, "limits": "none"}


@pytest.fixture(scope="module")
def light_hand(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """Two rods, the second with a millionth of the mass of the first."""
    path = tmp_path_factory.mktemp("chain") / "chain.urdf"
    return Scene(uneven_chain([1.0, 1e-6], path), [Gravity(9.8)])


@pytest.fixture(scope="module")
def job(light_hand: Scene) -> Job:
    grid = Grid.uniform(3.0, 16, galerkin(2))
    return Job(
        light_hand,
        grid,
        State(HANG),
        State(-HANG),
        PlanOptions(max_iterations=STEPS, limits="none"),
    )


@pytest.fixture(scope="module")
def failed(job: Job) -> Solution:
    return solve_on_grid(job.problem(), max_iterations=STEPS)


def test_masses_of_a_million_to_one_are_solved_with_decreasing_rotor_inertia(
    job: Job, failed: Solution
) -> None:
    assert failed.status is Status.ITERATION_LIMIT
    found = solve_by_continuation(job, failed)
    assert found.status is Status.MINIMUM
    assert found.n_neg == 0
    assert found.minima == (found.cost,)
    assert (
        "The direct solve ended in iteration_limit; continuation in inertia found" in found.message
    )
    assert not job.scene.model.armature.any()
    again = solve_on_grid(job.problem(), found.trajectory)
    assert again.nit <= 2
    assert again.cost == pytest.approx(found.cost, rel=1e-9)
    assert again.n_neg == 0


def test_a_plan_without_continuation_is_one_solve(light_hand: Scene, failed: Solution) -> None:
    found = plan(
        light_hand,
        HANG,
        -HANG,
        3.0,
        continuation=False,
        max_iterations=STEPS,
        **GRID,
        self_collision=False,
    )
    assert (found.status, found.cost, found.message) == (
        failed.status,
        failed.cost,
        failed.message,
    )


def test_a_valley_of_positive_curvature_gets_more_steps(arm_scene: Scene) -> None:
    stopped = plan(arm_scene, HANG, REACH_Q, 1.0, max_iterations=5, continuation=False, **GRID)
    assert stopped.status is Status.ITERATION_LIMIT
    assert stopped.n_neg == 0
    found = plan(arm_scene, HANG, REACH_Q, 1.0, max_iterations=5, **GRID)
    assert found.status is Status.MINIMUM
    assert "continuation in steps found this minimum in 1 stage and" in found.message


@pytest.mark.parametrize("status", [Status.ITERATION_LIMIT, Status.DIVERGED])
def test_among_obstacles_a_motion_at_its_iteration_limit_gets_more_steps_first(
    status: Status,
) -> None:
    robot = hovi.load_robot("ur5")
    start, ball = robot.neutral(), hovi.Sphere([5.0, 0.0, 0.0], 0.1, name="ball")
    ends = State(start), State(start + 0.5)
    options = PlanOptions(limits="none", obstacles=(ball,))
    beside = Job(Scene(robot, []), Grid.uniform(1.0, 4, galerkin(2)), *ends, options)
    ended = dataclasses.replace(solve_on_grid(beside.problem()), status=status, n_neg=-1)
    first = list[str]()

    def report(text: str, share: float) -> None:
        first.append(text)
        raise KeyboardInterrupt

    solve_by_continuation(beside, ended, progress=report)
    assert ("more steps" in first[0]) == (status is Status.ITERATION_LIMIT)


def test_every_stage_is_reported_with_increasing_progress(job: Job, failed: Solution) -> None:
    reports: list[tuple[str, float]] = []
    found = solve_by_continuation(
        job, failed, progress=lambda text, share: reports.append((text, share))
    )
    assert found.success
    shares = [share for _, share in reports]
    assert shares == sorted(shares)
    assert 0 <= shares[0] <= shares[-1] <= 1
    assert "continuation in inertia: rotors of" in reports[0][0]
    assert reports[-1][0].endswith("the task itself")


def test_a_deadline_ends_the_continuation_with_the_best_so_far(job: Job, failed: Solution) -> None:
    late = solve_by_continuation(job, failed, deadline=Deadline(0.0))
    assert (late.success, late.status) == (False, Status.TIME_LIMIT)
    assert late.cost == failed.cost
    assert "Continuation in inertia reached the time limit" in late.message


@pytest.mark.parametrize("where", ["within a stage", "between two"])
def test_an_interrupt_ends_the_continuation_with_the_best_so_far(
    job: Job, failed: Solution, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    value, calls = ActionObjective.value, 0

    def interrupted(self: ActionObjective, x: DiscretePath) -> float:
        nonlocal calls
        calls += 1
        if calls == 30:
            raise KeyboardInterrupt
        return value(self, x)

    def interrupt(text: str, share: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(ActionObjective, "value", interrupted)
    found = solve_by_continuation(
        job, failed, progress=interrupt if where == "between two" else None
    )
    assert (found.success, found.status) == (False, Status.INTERRUPTED)
    assert found.cost == failed.cost
    assert "was interrupted" in found.message
    assert calls <= 31


def test_an_interrupt_between_two_stages_ends_the_whole_call(job: Job, failed: Solution) -> None:
    def interrupt(text: str, share: float) -> None:
        raise KeyboardInterrupt

    @interruptible
    def call() -> bool:
        solve_by_continuation(job, failed, progress=interrupt)
        return interrupted()

    assert call()


def test_a_continuation_that_fails_names_what_was_tried(job: Job) -> None:
    hurried = job.with_options(max_iterations=2)
    failed = solve_on_grid(hurried.problem(), max_iterations=2)
    found = solve_by_continuation(hurried, failed)
    assert (found.success, found.status) == (False, Status.ITERATION_LIMIT)
    assert found.cost <= failed.cost
    assert found.nit == 2
    ways = "inertia, the intervals, gravity, the duration, steps"
    assert f"Continuation in {ways} found no minimum" in found.message


def test_problems_that_fail_before_any_step_are_not_continued(arm_scene: Scene) -> None:
    limits = as_limits(arm_scene.robot, {"base": "none", "v": 0.1})
    grid = Grid.uniform(1.0, 8, galerkin(2))
    job = Job(
        arm_scene, grid, State(HANG), State(-HANG), PlanOptions(max_iterations=50, limits=limits)
    )
    contradiction = solve_on_grid(job.problem())
    assert contradiction.status is Status.INFEASIBLE
    assert not may_help(contradiction)
    found = plan(arm_scene, HANG, -HANG, 1.0, limits=limits)
    assert "ontinuation" not in found.message
    assert np.isfinite(found.cost)
