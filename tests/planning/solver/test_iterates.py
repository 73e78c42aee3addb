"""A plan that is watched shows the motions that it passes through, and ends when cancelled."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import CancelledError, InputError
from samples.asked_features import FEATURES, AskedFeatures, planned_with

pytestmark = pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
HANG, REACH = np.array([-np.pi / 2, 0.0]), np.array([0.3, 0.7])
SEARCHES: dict[str, dict[str, Any]] = {
    "without limits": {"limits": "none"},
    "within limits": {"limits": {"base": "none", "tau": 12.0}},
    "past an obstacle": {"obstacles": [hovi.Sphere([0.7, 0.0, -1.65], 0.15)]},
    "to a frame": {"goal": hovi.FrameGoal("tip", position=[1.2, 0.0, 1.0])},
    "several starts": {"starts": 3, "processes": 1},
    "of free duration": {"duration": (0.5, 20.0), "time_weight": 3.0, "limits": {"tau": 60.0}},
    "of free duration, without limits": {
        "duration": (0.5, 20.0),
        "time_weight": 3.0,
        "limits": "none",
    },
    "of least duration": {"duration": (0.1, 20.0), "objective": "time", "limits": {"tau": 30.0}},
}


def searched(scene: hovi.Scene, search: str, **more: Any) -> hovi.Solution:
    given = {"goal": REACH, "duration": 1.0} | SEARCHES[search] | more
    return hovi.plan(scene, HANG, given.pop("goal"), given.pop("duration"), **given)


def effort(motion: hovi.Trajectory) -> float:
    """1/2 integral |tau|^2 by Pinocchio's own torques."""
    at = motion.sample(np.linspace(0.0, motion.duration, 4001))
    model = motion.scene.robot.model.copy()  # type: ignore[union-attr]
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    data = model.createData()
    rows = zip(at.q, at.v, at.a, strict=True)
    tau = np.array([pin.rnea(model, data, *each) for each in rows])
    return float(np.trapezoid(0.5 * (tau**2).sum(axis=1), dx=motion.duration / 4000))


GRAVITY = 9.8


@pytest.mark.parametrize(
    "search",
    [
        *("without limits", "within limits"),
        *("of free duration", "of free duration, without limits"),
    ],
)
def test_iterates_are_motions_of_their_costs_that_approach_the_minimum(
    search: str, arm_scene: hovi.Scene
) -> None:
    seen: list[hovi.Iterate] = []
    found = searched(arm_scene, search, intervals=24, on_iterate=seen.append)
    price = found.problem.time_weight  # type: ignore[union-attr]
    assert found.success
    assert [each.number for each in seen] == list(range(len(seen)))
    assert len(seen) > 5
    for each in (seen[0], seen[len(seen) // 2], seen[-1]):
        motion = each.solution.trajectory
        assert each.solution.cost == pytest.approx(
            effort(motion) + price * motion.duration, rel=0.02
        )
        assert each.solution.status is hovi.Status.INTERRUPTED
    assert seen[0].solution.cost > 1.05 * found.cost
    assert seen[-1].solution.cost == pytest.approx(found.cost, rel=1e-3)
    last = seen[-1].solution.trajectory
    np.testing.assert_allclose(last.duration, found.trajectory.duration, rtol=1e-3)


@pytest.mark.parametrize("feature", FEATURES)
def test_iterates_of_every_kind_of_problem_join_its_ends(feature: str) -> None:
    asked = AskedFeatures.of(feature)
    seen: list[hovi.Iterate] = []

    class Watched(AskedFeatures):
        @property
        def options(self) -> dict[str, Any]:
            return super().options | {"on_iterate": seen.append}

    planned_with(Watched(asked.case, asked.features))
    assert seen
    for each in seen[:: max(1, len(seen) // 5)]:
        motion = each.solution.trajectory
        np.testing.assert_allclose(motion.q[0], asked.q0, atol=1e-9)
        assert np.isfinite(each.solution.cost)


@pytest.mark.parametrize("asks", [1, 12, 60, 150])
@pytest.mark.parametrize("search", SEARCHES)
def test_a_plan_that_is_cancelled_asks_no_more_and_is_no_success(
    search: str, asks: int, arm_scene: hovi.Scene
) -> None:
    """Wherever it is seen first; before there is a motion by an error."""
    asked = 0

    def cancel() -> bool:
        nonlocal asked
        asked += 1
        return asked >= asks

    try:
        found = searched(arm_scene, search, cancel=cancel)
    except CancelledError:  # while a goal's configurations are compared, or at the first ask
        assert asks == 1 or search == "to a frame"
        return
    if asked < asks:  # it was done before
        assert found.status is not hovi.Status.INTERRUPTED
        return
    assert asked == asks
    assert found.status is hovi.Status.INTERRUPTED or "interrupted" in found.message
    assert not found.success or "interrupted" in found.message


def test_another_thread_cancels_a_plan(arm_scene: hovi.Scene) -> None:
    ended, begun = threading.Event(), threading.Event()
    found: list[hovi.Solution] = []
    steps = 0

    def slow(iterate: hovi.Iterate) -> None:
        nonlocal steps
        steps += 1
        begun.set()
        assert ended.wait(60.0)

    def work() -> None:
        found.append(searched(arm_scene, "without limits", on_iterate=slow, cancel=ended.is_set))

    thread = threading.Thread(target=work)
    thread.start()
    assert begun.wait(60.0)
    ended.set()
    thread.join(60.0)
    assert found[0].status is hovi.Status.INTERRUPTED
    assert steps == 1
    assert found[0].trajectory.q.shape[1] == 2


def test_cancelling_ends_worker_processes_too(arm_scene: hovi.Scene) -> None:
    asked = 0

    def cancel() -> bool:
        nonlocal asked
        asked += 1
        return asked > 40

    options: dict[str, Any] = {"limits": "none", "starts": 400, "processes": 2}
    found = hovi.plan(arm_scene, HANG, REACH, 1.0, cancel=cancel, **options)
    assert "The search ended after" in found.message
    assert found.status is hovi.Status.INTERRUPTED


@pytest.mark.parametrize("name", ["on_iterate", "cancel"])
@pytest.mark.parametrize("error", [ZeroDivisionError, np.linalg.LinAlgError, RuntimeError])
def test_errors_of_the_functions_leave_the_plan_as_they_are(
    name: str, error: type[Exception], arm_scene: hovi.Scene
) -> None:
    """A solve ends as diverged after an arithmetic error of its own."""

    def failing(*_: hovi.Iterate) -> bool:
        raise error("mine")

    functions: dict[str, Any] = {name: failing}
    with pytest.raises(error, match="mine"):
        searched(arm_scene, "within limits", **functions)


def test_a_plan_that_a_watcher_makes_is_not_watched(arm_scene: hovi.Scene) -> None:
    numbers: list[int] = []

    def planning(iterate: hovi.Iterate) -> None:
        numbers.append(iterate.number)
        if len(numbers) == 1:
            assert hovi.plan(arm_scene, HANG, REACH, 2.0, limits="none").success

    assert searched(arm_scene, "without limits", on_iterate=planning).success
    assert numbers == list(range(len(numbers)))


def test_an_event_is_refused_with_its_method(arm_scene: hovi.Scene) -> None:
    wrong: Any = threading.Event()
    with pytest.raises(InputError, match="cancel must be a function or None, got an Event"):
        searched(arm_scene, "without limits", cancel=wrong)
