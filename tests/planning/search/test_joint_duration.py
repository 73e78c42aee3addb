"""Plans with a free duration whose motion and duration are found by one solve."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi import Solution, Status
from oracles.on_grid import solve_on_grid
from samples.stopped_searches import InterruptedEvaluations

SCENES = {
    "two_link_reach": (20.0, (0.5, 4.0), "none"),
    "ur5_reach": (50.0, (0.5, 6.0), "none"),
    "ur5_reach_limited": (50.0, (0.5, 6.0), None),
    "panda_reach_limited": (50.0, (0.5, 6.0), None),
}
"""Weight of time, bounds of the duration, and limits; those of the scene if None."""


def ends_of(name: str) -> tuple[tuple[Any, ...], dict[str, Any]]:
    task, limits = hovi.load_task(hovi.example(name)), SCENES[name][2]
    options = {"limits": limits or task.options.limits, "processes": 1}
    return (task.scene, task.start, task.goal), options


@pytest.mark.parametrize(
    ("name", "grid"),
    [
        pytest.param("two_link_reach", {"intervals": 24}, id="two_link_reach-grid"),
        pytest.param("two_link_reach", {"tolerance": 1e-3}, id="two_link_reach-tol"),
        pytest.param("ur5_reach", {"intervals": 24}, id="ur5_reach-grid"),
        pytest.param("ur5_reach", {"tolerance": 1e-3}, id="ur5_reach-tol"),
        pytest.param("ur5_reach_limited", {"intervals": 24}, id="ur5_reach_limited-grid"),
        pytest.param("ur5_reach_limited", {"tolerance": 1e-3}, id="ur5_reach_limited-tol"),
    ],
)
def test_a_free_duration_takes_at_most_three_times_the_steps_of_given_ones(
    name: str, grid: dict[str, Any]
) -> None:
    """In the mean of the duration that was found and two within one per cent of it."""
    weight, bounds, _ = SCENES[name]
    ends, options = ends_of(name)
    free = hovi.plan(*ends, bounds, time_weight=weight, **options, **grid, self_collision=False)
    assert free.success, free.message
    assert abs(free.duration_derivative + weight) <= 1e-7 * weight
    given = options | grid | {"self_collision": False}
    T = free.trajectory.duration
    fixed = [hovi.plan(*ends, fraction * T, **given) for fraction in (0.99, 1.0, 1.01)]
    assert all(each.success for each in fixed)
    assert free.nit <= sum(each.nit for each in fixed)
    assert "The best duration is" in free.message


def test_a_duration_within_torques_between_the_points_takes_few_steps() -> None:
    """Bounds that are tightened in rounds move this duration for 200 steps."""
    ends, options = ends_of("panda_reach_limited")
    options |= {"intervals": 24}
    free = hovi.plan(*ends, (0.5, 6.0), time_weight=50.0, **options, self_collision=False)
    assert free.success, free.message
    assert abs(free.duration_derivative + 50.0) <= 5e-6
    fixed = hovi.plan(*ends, free.trajectory.duration, **options, self_collision=False)
    assert free.nit <= 4 * fixed.nit


@pytest.mark.parametrize("weight", [0.0, 1e-3, 1.0])
def test_a_motion_of_least_cost_has_its_own_duration(weight: float) -> None:
    """Where time has no price, or nearly none: next to a jump of the cost slopes say nothing."""
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    start = np.array([0.0, -0.2, 0.3, -0.2, 0.1, 0.0])  # stretched out: every second costs
    goal = start + np.array([0.8, 0.3, -0.3, 0.2, 0.2, 0.2])
    tip = scene.robot.tip_frames[0]
    point = hovi.FrameGoal(tip, position=scene.robot.frame_position(tip, goal[None])[0])
    asked: dict[str, Any] = {
        "limits": {"base": "none", "v": 3.0, "tau": 300.0},
        "self_collision": False,
        "tolerance": 1e-5,  # costs differ by 3e-5 where durations do by a thousandth
    }
    free = hovi.plan(scene, start, point, (0.2, 4.0), time_weight=weight, **asked)
    assert free.success, free.message
    T = free.trajectory.duration
    assert 0.21 < T < 3.9
    known = hovi.FrameGoal(tip, position=point.position, guess=free.trajectory.q[-1])
    for share in (-1e-2, -1e-3, 1e-3, 1e-2):
        near = hovi.plan(scene, start, known, T * (1 + share), guess=free.trajectory, **asked)
        assert near.success, near.message
        assert near.cost + weight * T * (1 + share) > free.cost, share


def test_durations_near_the_best_one_cost_more_within_limits() -> None:
    weight, bounds, _ = SCENES["panda_reach_limited"]
    ends, options = ends_of("panda_reach_limited")
    free = hovi.plan(
        *ends, bounds, time_weight=weight, intervals=16, **options, self_collision=False
    )
    assert free.success, free.message
    assert abs(free.duration_derivative + weight) <= 1e-7 * weight
    T = free.trajectory.duration
    assert bounds[0] < T < bounds[1]
    assert free.problem is not None
    for near in (0.97 * T, 1.03 * T):
        problem = free.problem.on(free.problem.grid.stretched(near))
        solved = solve_on_grid(problem, free.trajectory)
        assert solved.success, solved.message
        assert solved.cost + weight * near > free.cost


def test_every_start_has_its_own_duration_and_the_cheapest_with_time_is_taken() -> None:
    ends, options = ends_of("two_link_reach")
    options |= {"time_weight": 20.0, "intervals": 16}
    one = hovi.plan(*ends, (0.5, 4.0), **options)
    several = hovi.plan(*ends, (0.5, 4.0), starts=8, **options)
    assert several.success, several.message
    assert len(several.minima) > 1
    assert list(several.minima) == sorted(several.minima)
    assert several.cost == several.minima[0] <= one.cost * (1 + 1e-9)
    assert abs(several.duration_derivative + 20.0) <= 1e-7 * 20.0
    T = several.trajectory.duration
    assert several.problem is not None
    assert several.cost == pytest.approx(
        several.problem.ld.action(several.trajectory.path) + 20.0 * T, rel=1e-12
    )


def test_minima_of_a_coarse_grid_keep_their_durations_on_the_requested_one() -> None:
    ends, options = ends_of("two_link_reach")
    options |= {"time_weight": 20.0}
    coarse = hovi.plan(*ends, (0.5, 4.0), intervals=80, **options)
    fine = hovi.plan(*ends, (0.5, 4.0), intervals=200, **options)
    assert fine.success, fine.message
    assert fine.trajectory.grid.intervals == 200
    assert fine.nit <= 4  # from the motion of the coarse grid, which has the same duration
    assert fine.trajectory.duration == pytest.approx(coarse.trajectory.duration, rel=1e-6)
    assert abs(fine.duration_derivative + 20.0) <= 1e-7 * 20.0


# Ends of the search


def freed(bounds: Any, weight: float = 20.0, **options: Any) -> Solution:
    """The reach of the two-link arm, of which J + 20 T has its minimum at 1.19 s."""
    ends, given = ends_of("two_link_reach")
    return hovi.plan(*ends, bounds, time_weight=weight, **(given | {"intervals": 8} | options))


@pytest.mark.parametrize("weight", [5.0, 20.0, 200.0])
@pytest.mark.parametrize("limits", ["none", {"base": "none", "v": 3.5}])
def test_the_best_duration_is_cheaper_than_those_around_it(weight: float, limits: Any) -> None:
    """By plans for fixed durations, and by the slope of the cost where it is smooth."""
    free = freed((0.5, 4.0), weight, limits=limits)
    assert free.success, free.message
    T = free.trajectory.duration
    ends, given = ends_of("two_link_reach")
    for other in np.clip(T * np.array([0.95, 0.98, 1.02, 1.05]), 0.5, 4.0):
        fixed = hovi.plan(*ends, other, **(given | {"intervals": 8, "limits": limits}))
        if fixed.success and other != T:
            assert fixed.cost + weight * other > free.cost * (1 - 1e-6)
    if 0.5 < T < 4.0:
        assert free.duration_derivative == pytest.approx(-weight, rel=1e-6)


@pytest.mark.parametrize("T", [0.6, 1.19, 2.0])
def test_a_motion_at_a_bound_is_the_best_only_if_shorter_or_longer_ones_are_beyond(
    T: float,
) -> None:
    for bounds in ((T, 2 * T), (T / 2, T)):
        free = freed(bounds)
        assert free.success, free.message
        outward = (T > 1.2) == (bounds[0] == T) and not np.isclose(T, 1.19, atol=0.01)
        kept = free.trajectory.duration == pytest.approx(T, rel=1e-12)
        assert ("kept at its bound" in free.message) == kept
        if not np.isclose(T, 1.19, atol=0.01):
            assert kept == outward
        slope = free.duration_derivative + 20.0
        assert kept or abs(slope) <= 1e-6 * 20.0
        assert not kept or (slope >= 0) == (bounds[0] == T)


def test_ends_beyond_their_limits_have_no_motion_of_any_duration() -> None:
    limits = {"base": "none", "q": [[-0.1, 0.1], [-0.1, 0.1]]}
    found = freed((0.5, 4.0), limits=limits)
    assert (found.success, found.status) == (False, Status.INFEASIBLE)


def test_an_interrupt_is_told_as_no_success(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the first solve, and in those for other durations."""
    evaluations = InterruptedEvaluations(monkeypatch)
    assert freed((0.5, 4.0)).success
    whole = evaluations.calls
    for share in (0.2, 0.5, 0.9):
        evaluations.restart(int(share * whole))
        found = freed((0.5, 4.0))
        assert (found.success, found.status) == (False, Status.INTERRUPTED)
        assert "interrupted" in found.message
        assert 0.5 <= found.trajectory.duration <= 4.0


def test_a_time_limit_is_told_as_no_success() -> None:
    found = freed((0.5, 4.0), time_limit=1e-9)
    assert (found.success, found.status) == (False, Status.TIME_LIMIT)
    assert "time limit" in found.message


@pytest.mark.parametrize("most", [1, 2, 4])
def test_too_few_steps_are_no_success(most: int) -> None:
    found = freed((0.5, 4.0), max_iterations=most, continuation=False, intervals=24)
    assert found.success == (found.status is Status.MINIMUM)
    if not found.success:
        assert "a minimum of cost" not in found.message
        assert found.minima == ()
    else:
        assert found.duration_derivative == pytest.approx(-20.0, rel=1e-6)


def the_tip(scene: hovi.Scene, q: npt.ArrayLike) -> npt.NDArray[np.float64]:
    return scene.robot.frame_position(scene.robot.tip_frames[0], np.asarray(q))


WAY = np.array([1.0, 0.3, -0.4, 0.2, 0.3, 0.1])
KINDS = {
    "a frame": lambda scene, q0, q1: (
        hovi.FrameGoal(scene.robot.tip_frames[0], position=the_tip(scene, q1), guess=q1),
        {},
    ),
    "a ball": lambda scene, q0, q1: (
        q1,
        {"obstacles": [hovi.Sphere(the_tip(scene, 0.5 * (q0 + q1)), 0.05, name="ball")]},
    ),
    "its links": lambda scene, q0, q1: (q1, {"self_collision": True}),
    "a condition": lambda scene, q0, q1: (
        q1,
        {"conditions": [hovi.Condition(lambda v: v[0] + v[1], hovi.Between(-1.0, 1.0))]},
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_free_duration_takes_a_few_times_the_steps_of_a_given_one(kind: str) -> None:
    """A search around solves takes more than that."""
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    q0 = np.array([0.0, -1.4, 1.6, -0.2, 0.5, 0.0])
    goal, options = KINDS[kind](scene, q0, q0 + WAY)
    given = {"intervals": 20, "self_collision": False} | options
    free = hovi.plan(scene, q0, goal, (0.4, 5.0), time_weight=50.0, **given)
    fixed = hovi.plan(scene, q0, goal, free.trajectory.duration, **given)
    assert free.success, free.message
    assert fixed.success, fixed.message
    assert free.nit <= 5 * fixed.nit
