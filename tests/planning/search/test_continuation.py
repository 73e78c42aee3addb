"""Continuation: minima that the direct solve does not find, and limits on time and steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import hovi
from hovi import Solution, Status, plan
from hovi.effects import Gravity
from hovi.planning.problem.limits import as_limits
from hovi.scene.scene import Scene
from hovi.system.interruption import interrupted, interruptible
from samples.paper_arm import HANG, REACH_Q
from samples.stopped_searches import InterruptedEvaluations, LeapingClock
from samples.uneven_chain import uneven_chain

STEPS = 300
"""Too few steps for a direct solve with a light hand, which takes some 500."""

GRID: dict[str, Any] = {"scheme": "galerkin-2", "intervals": 16, "limits": "none"}


@pytest.fixture(scope="module")
def light_hand(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """Two rods, the second with a millionth of the mass of the first."""
    path = tmp_path_factory.mktemp("chain") / "chain.urdf"
    return Scene(uneven_chain([1.0, 1e-6], path), [Gravity(9.8)])


def swung(scene: Scene, **options: Any) -> Solution:
    given = GRID | {"max_iterations": STEPS, "self_collision": False} | options
    return plan(scene, HANG, -HANG, 3.0, **given)


@pytest.fixture(scope="module")
def failed(light_hand: Scene) -> Solution:
    """By the direct solve alone."""
    return swung(light_hand, continuation=False)


class Reports:
    """The lines of text of a plan with their fractions; calls `act` at the first continuation."""

    def __init__(self, act: Callable[[], None] = lambda: None) -> None:
        self.continued: list[tuple[str, float]] = []
        self._act = act

    def __call__(self, text: str, fraction: float) -> None:
        if text.startswith("continuation"):
            self.continued.append((text, fraction))
            if len(self.continued) == 1:
                self._act()


def test_masses_of_a_million_to_one_are_solved_by_more_steps(
    light_hand: Scene, failed: Solution
) -> None:
    """A minimum of the task itself, without rotors, on a grid that does not resolve it."""
    assert failed.status is Status.ITERATION_LIMIT
    reports = Reports()
    found = swung(light_hand, progress=reports)
    assert "the motion is a minimum on 16 intervals" in found.message
    assert found.n_neg == 0
    assert found.cost < failed.cost
    assert found.problem is not None
    assert not found.problem.scene.model.armature.any()
    again = hovi.solve(found.problem, found.trajectory)
    assert again.nit <= 2
    assert again.cost == pytest.approx(found.cost, rel=1e-9)
    texts, shares = zip(*reports.continued, strict=True)
    assert list(shares) == sorted(shares)
    assert 0 <= shares[0] <= shares[-1] <= 1
    assert set(texts) == {"continuation: more steps from the last motion"}


def test_a_plan_without_continuation_is_one_solve(light_hand: Scene, failed: Solution) -> None:
    assert failed.problem is not None
    direct = hovi.solve(failed.problem, max_iterations=STEPS)
    assert (failed.status, failed.cost, failed.message, failed.nit) == (
        direct.status,
        direct.cost,
        direct.message,
        STEPS,
    )


def test_more_steps_lead_to_the_minimum_of_a_solve_with_enough(arm_scene: Scene) -> None:
    stopped = plan(arm_scene, HANG, REACH_Q, 1.0, max_iterations=5, continuation=False, **GRID)
    assert stopped.status is Status.ITERATION_LIMIT
    assert stopped.n_neg == 0
    found = plan(arm_scene, HANG, REACH_Q, 1.0, max_iterations=5, **GRID)
    assert found.status is Status.MINIMUM
    assert "continuation found this minimum by" in found.message
    assert found.cost == pytest.approx(plan(arm_scene, HANG, REACH_Q, 1.0, **GRID).cost, rel=1e-9)


def test_among_obstacles_a_motion_at_its_iteration_limit_gets_more_steps() -> None:
    robot = hovi.load_robot("ur5")
    start, ball = np.array([0.0, -1.2, 1.2, -0.5, 0.3, 0.1]), hovi.Sphere([0.6, 0.3, 0.4], 0.05)
    reports, few = Reports(), {"max_iterations": 2, "self_collision": False, "starts": 1}
    plan(Scene(robot), start, start + 0.6, 1.0, obstacles=[ball], **few, **GRID, progress=reports)
    assert "more steps" in reports.continued[0][0]


# Ends before a minimum


def test_a_deadline_ends_the_continuation_with_the_best_so_far(
    light_hand: Scene, failed: Solution, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A clock that leaps at the first solve."""
    late = LeapingClock(monkeypatch).leap
    found = swung(light_hand, time_limit=1e5, progress=Reports(late))
    assert (found.success, found.status) == (False, Status.TIME_LIMIT)
    assert found.cost == pytest.approx(failed.cost, rel=1e-12)
    assert "Continuation reached the time limit" in found.message


@pytest.mark.parametrize("where", ["within a solve", "between two"])
def test_an_interrupt_ends_the_continuation_with_the_best_so_far(
    light_hand: Scene, failed: Solution, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    evaluations = InterruptedEvaluations(monkeypatch)

    def act() -> None:
        evaluations.restart(30)
        if where == "between two":
            raise KeyboardInterrupt

    found = swung(light_hand, progress=Reports(act))
    assert (found.success, found.status) == (False, Status.INTERRUPTED)
    assert found.cost <= failed.cost
    assert "Continuation was interrupted" in found.message
    assert evaluations.last == 30
    assert evaluations.calls <= 60


def test_an_interrupt_between_two_solves_ends_the_whole_call(light_hand: Scene) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    @interruptible
    def call() -> bool:
        swung(light_hand, progress=Reports(interrupt))
        return interrupted()

    assert call()


def test_a_continuation_that_fails_says_so(light_hand: Scene) -> None:
    failed = swung(light_hand, max_iterations=2, continuation=False)
    found = swung(light_hand, max_iterations=2)
    assert (found.success, found.status) == (False, Status.ITERATION_LIMIT)
    assert found.cost <= failed.cost
    assert found.nit == 2
    assert "Continuation found no minimum" in found.message


def test_problems_that_fail_before_any_step_are_not_continued(arm_scene: Scene) -> None:
    limits, reports = as_limits(arm_scene.robot, {"base": "none", "v": 0.1}), Reports()
    found = plan(arm_scene, HANG, -HANG, 1.0, limits=limits, progress=reports)
    assert (found.status, found.nit) == (Status.INFEASIBLE, 0)
    assert "ontinuation" not in found.message
    assert reports.continued == []
    assert np.isfinite(found.cost)


@pytest.mark.filterwarnings("ignore:invalid value encountered in matmul")
def test_a_guess_of_infinite_cost_is_not_continued(two_link: hovi.Robot) -> None:
    """Nor would more steps lead to a finite cost."""
    steep = hovi.effects.RunningCost({"steep": 'exp(1e3*(q["shoulder"] + 1))'})
    reports, grid = Reports(), GRID | {"intervals": 8}
    scene = Scene(two_link, [Gravity(9.8), steep])
    found = plan(scene, HANG, REACH_Q, 1.0, progress=reports, **grid)
    assert (found.status, found.nit) == (Status.DIVERGED, 0)
    assert "the cost is inf at t =" in found.message
    assert "ontinuation" not in found.message
    assert reports.continued == []
