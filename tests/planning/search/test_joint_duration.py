"""Plans with a free duration whose motion and duration are found by one solve."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import hovi
from hovi import Solution, Status
from hovi.discrete.grid import Grid
from hovi.planning.search.free_duration import BestDuration, FreeDuration, SolveFor
from hovi.planning.search.joint_duration import (
    best_duration_by,
    best_on_its_grid,
    is_best,
    joint_minimum,
    unless_best,
)
from oracles.on_grid import solve_on_grid

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
def test_a_free_duration_takes_at_most_three_times_the_steps_of_its_own_value(
    name: str, grid: dict[str, Any]
) -> None:
    weight, bounds, _ = SCENES[name]
    ends, options = ends_of(name)
    free = hovi.plan(*ends, bounds, time_weight=weight, **options, **grid, self_collision=False)
    assert free.success, free.message
    assert abs(free.duration_derivative + weight) <= 1e-7 * weight
    fixed = hovi.plan(*ends, free.trajectory.duration, **options, **grid, self_collision=False)
    assert fixed.success, fixed.message
    assert free.nit <= 3 * fixed.nit
    assert "The best duration is" in free.message


def test_tightened_bounds_that_take_many_steps_give_way_to_halved_intervals() -> None:
    """With tightened bounds this duration moves for 200 steps, with halved intervals for 12."""
    ends, options = ends_of("panda_reach_limited")
    options |= {"intervals": 24}
    free = hovi.plan(*ends, (0.5, 6.0), time_weight=50.0, **options, self_collision=False)
    assert free.success, free.message
    assert abs(free.duration_derivative + 50.0) <= 5e-6
    fixed = hovi.plan(*ends, free.trajectory.duration, **options, self_collision=False)
    assert free.nit <= 4 * fixed.nit


NEXT_TO_A_JUMP = (
    "the cost jumps by 1e-7 of it next to the best duration, where its slope is 0.0106 per second "
    "off: 1.7e-4 of J / T, which is called unresolved"
)


@pytest.mark.parametrize(
    "weight", [0.0, 1e-3, pytest.param(1.0, marks=pytest.mark.xfail(reason=NEXT_TO_A_JUMP))]
)
def test_a_motion_of_least_cost_has_its_own_duration(weight: float) -> None:
    """Where time has no price, or nearly none: next to a jump of the cost slopes say nothing."""
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    start = np.array([0.0, -0.2, 0.3, -0.2, 0.1, 0.0])  # stretched out: every second costs
    goal = start + np.array([0.8, 0.3, -0.3, 0.2, 0.2, 0.2])
    tip = scene.robot.tip_frames[0]
    point = hovi.FrameGoal(tip, position=scene.robot.frame_position(tip, goal[None])[0])
    limits = {"base": "none", "v": 3.0, "tau": 300.0}
    free = hovi.plan(
        scene, start, point, (0.2, 4.0), time_weight=weight, limits=limits, self_collision=False
    )
    assert free.success, free.message
    T = free.trajectory.duration
    assert 0.21 < T < 3.9
    known = hovi.FrameGoal(tip, position=point.position, guess=free.trajectory.q[-1])
    for share in (-1e-2, -1e-3, 1e-3, 1e-2):
        other = hovi.plan(scene, start, known, T * (1 + share), limits=limits, self_collision=False)
        assert other.cost + weight * T * (1 + share) > free.cost, share


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


def test_no_joint_minimum_is_none() -> None:
    """A motion that ends beyond its limits has none, whatever its duration."""
    ends, _ = ends_of("two_link_reach")
    limits = {"base": "none", "q": [[-0.1, 0.1], [-0.1, 0.1]]}
    problem = hovi.plan(*ends, 1.0, intervals=8, limits=limits, continuation=False).problem
    assert problem is not None
    free = FreeDuration(0.5, 4.0, 20.0)
    assert joint_minimum(free, problem, problem.guess("cubic"), 500, None) is None


def fixed_solution(T: float) -> Solution:
    ends, options = ends_of("two_link_reach")
    return hovi.plan(*ends, T, intervals=8, **options)


def test_without_a_joint_minimum_durations_are_searched_for() -> None:
    first, asked = fixed_solution(1.4), []

    def solve(T: float, guess: hovi.Trajectory) -> Solution:
        asked.append(T)
        assert first.problem is not None
        return solve_on_grid(first.problem.on(first.problem.grid.stretched(T)), guess)

    free = FreeDuration(0.5, 4.0, 20.0)
    best = best_duration_by(free, solve, first, jointly=lambda _: None)
    assert best.solution.success
    assert len(asked) > 3
    assert best.solution.duration_derivative == pytest.approx(-20.0, rel=1e-8)
    again = best_duration_by(free, solve, best.solution, jointly=lambda _: pytest.fail("solved"))
    assert again.solution is best.solution
    assert again.ending == "The best duration is"


def test_a_stopped_joint_solve_is_told_as_no_success() -> None:
    first = fixed_solution(1.4)
    for status, words in ((Status.TIME_LIMIT, "time limit"), (Status.INTERRUPTED, "interrupted")):
        stopped = dataclasses.replace(first, success=False, status=status)
        best = best_duration_by(
            FreeDuration(0.5, 4.0, 20.0), _unasked, first, jointly=lambda _, s=stopped: s
        )
        found = best.with_time()
        assert (found.success, found.status) == (False, status)
        assert words in found.message
        assert found.nit == 2 * first.nit


def _unasked(T: float, guess: hovi.Trajectory) -> Solution:
    raise AssertionError(f"a solve for {T} s from one of {guess.duration} s")


@pytest.mark.parametrize("T", [0.6, 1.19, 2.0])
def test_a_motion_at_a_bound_is_the_best_only_if_shorter_or_longer_ones_are_beyond(
    T: float,
) -> None:
    """J + w T has its minimum at 1.19 s."""
    first = fixed_solution(T)
    slope = first.duration_derivative + 20.0
    for bounds in ((T, 2 * T), (T / 2, T)):
        outward = (slope > 0) == (bounds[0] == T) and not np.isclose(slope, 0.0)
        solved: list[Solution] = []
        best = best_duration_by(
            FreeDuration(*bounds, 20.0), _unasked, first, jointly=_record(first, solved)
        )
        assert (len(solved) == 0) == outward
        assert ("kept at its bound" in best.ending) == outward or len(solved) == 1


def _record(first: Solution, solved: list[Solution]) -> Any:
    def jointly(solution: Solution) -> Solution:
        solved.append(solution)
        return first

    return jointly


def test_next_to_a_jump_of_the_cost_the_slope_is_small_without_vanishing() -> None:
    first = fixed_solution(1.4)
    rate = first.duration_derivative
    for share, at_jump, best in ((1e-3, True, True), (1e-3, False, False), (0.1, True, False)):
        free = FreeDuration(0.5, 4.0, abs(rate) * (1 + share))
        found = BestDuration(free, first, 1, "The best duration is", at_jump=at_jump)
        assert is_best(found) == best
        told = unless_best(found)
        assert told.solution.success == best
        assert best or "shorter durations cost less by" in told.with_time().message


def test_a_search_that_ends_elsewhere_is_repeated_on_the_grid_of_its_motion() -> None:
    first, grids = fixed_solution(1.4), []

    def on_grid(grid: Grid) -> SolveFor:
        grids.append(grid)

        def solve(T: float, guess: hovi.Trajectory) -> Solution:
            assert first.problem is not None
            return solve_on_grid(first.problem.on(grid.stretched(T)), guess)

        return solve

    joint = iter([first, None])  # one that ends where it began, then none
    found = best_on_its_grid(
        FreeDuration(0.5, 4.0, 20.0), on_grid, first, jointly=lambda _: next(joint)
    )
    assert found.solution.success
    assert len(grids) == 2
    assert found.solution.duration_derivative == pytest.approx(-20.0, rel=1e-8)
