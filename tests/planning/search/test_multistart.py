"""Multi-start: distinct minima, independent of the number of processes, and early ends."""

from __future__ import annotations

import pickle
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi import Solution, Status
from hovi.robot.loading import load_robot
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.scene import Scene
from hovi.workers.pool import end_idle_workers
from samples.manifold_robots import chain
from samples.paper_arm import HANG

GRID: dict[str, Any] = {"limits": "none", "scheme": "galerkin-2", "intervals": 24}
SAME_COST = 1e-6
"""Relative difference of the costs of two minima below which they are one."""


def search(scene: Scene, starts: int, processes: int = 1, **options: Any) -> Solution:
    """A swing-up in three seconds: it has many minima."""
    given = GRID | {"starts": starts, "processes": processes} | options
    return hovi.plan(scene, HANG, -HANG, 3.0, **given)


def nodes(solution: Solution) -> bytes:
    path = solution.trajectory.path
    return b"".join(each.tobytes() for each in (path.q, path.v, path.z, path.inner))


@pytest.fixture(scope="module")
def alone(arm_scene: Scene) -> Solution:
    """From the guess alone."""
    return search(arm_scene, 1)


# Worker processes


@pytest.mark.parametrize("processes", [2, 3])
def test_the_number_of_processes_changes_nothing(arm_scene: Scene, processes: int) -> None:
    one, several = search(arm_scene, 19), search(arm_scene, 19, processes)
    assert len(one.minima) > 2
    assert several.minima == one.minima
    assert several.message == one.message
    assert nodes(several) == nodes(one)


def test_starts_among_obstacles_may_be_solved_in_worker_processes() -> None:
    task = hovi.load_task(hovi.example("ur5_around_sphere"))
    here, there = (hovi.plan_task(task, starts=3, processes=number) for number in (1, 2))
    assert here.success
    assert there.success
    assert here.cost == pytest.approx(there.cost, rel=1e-3)
    assert len(here.minima) == len(there.minima)


@pytest.mark.parametrize("program", ["/bin/false", "/nowhere/python"])
def test_guesses_are_solved_here_if_no_worker_starts(
    arm_scene: Scene, program: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = search(arm_scene, 5)
    end_idle_workers()
    monkeypatch.setattr(sys, "executable", program)
    found = search(arm_scene, 5, 2)
    assert found.minima == one.minima
    assert "Lost" not in found.message


KILL = "__import__('os').kill(__import__('os').getpid(), 9)"


class DeadlyScene(Scene):
    """A scene that kills every process to which it is sent."""

    def __reduce__(self) -> tuple[Any, ...]:
        return eval, (KILL,)


class OnceDeadlyScene(Scene):
    """A scene that kills the first process to which it is sent, which makes a folder `mark`."""

    mark = Path()

    def __reduce__(self) -> tuple[Any, ...]:
        known = pickle.dumps(Scene(self.robot, list(self.effects)))
        first = f"not __import__('subprocess').call(['mkdir', {str(self.mark)!r}], stderr=-3)"
        return eval, (f"{first} and {KILL} or __import__('pickle').loads({known!r})",)


def test_a_worker_that_is_killed_loses_its_guess_only(arm_scene: Scene, tmp_path: Path) -> None:
    OnceDeadlyScene.mark = tmp_path / "mark"
    deadly = OnceDeadlyScene(arm_scene.robot, list(arm_scene.effects))
    found, every = search(deadly, 19, 2), search(arm_scene, 19)
    assert found.success, found.message
    assert "Lost 1 of 19 starts: a worker process was ended by SIGKILL" in found.message
    assert len(found.minima) >= len(every.minima) - 1
    for cost in found.minima:
        assert np.isclose(cost, every.minima, rtol=1e-9).any()


def test_a_search_ends_with_a_round_that_every_process_dies_of(
    arm_scene: Scene, alone: Solution
) -> None:
    """With what was found before any process was needed."""
    found = search(DeadlyScene(arm_scene.robot, list(arm_scene.effects)), 1000, 2)
    assert found.success, found.message
    assert found.cost == alone.cost
    assert "The search ended after 1 of 1000 starts. Lost 16 of 1000 starts" in found.message
    assert "was ended by SIGKILL" in found.message


@pytest.mark.parametrize("intervals", [24, 160])
def test_one_process_needs_no_workers(arm_scene: Scene, intervals: int) -> None:
    """Neither for the search on a coarse grid, nor for the requested one."""
    deadly = DeadlyScene(arm_scene.robot, list(arm_scene.effects))
    found, known = (search(each, 5, 1, intervals=intervals) for each in (deadly, arm_scene))
    assert found.success, found.message
    assert found.minima == known.minima
    assert "Lost" not in found.message


# Distinct minima


def test_a_problem_has_what_was_asked_for(arm_scene: Scene) -> None:
    problem = search(arm_scene, 2, weight=(1.0, 5.0)).problem
    assert problem is not None
    assert problem.scene is arm_scene
    assert problem.grid.intervals == 24
    np.testing.assert_array_equal(problem.ld.lagrangian.weight, [1.0, 5.0])  # type: ignore[attr-defined]
    np.testing.assert_array_equal(problem.ends[0][1], -HANG)


def test_one_start_is_the_guess(alone: Solution) -> None:
    assert alone.problem is not None
    assert alone.cost == hovi.solve(alone.problem).cost
    assert alone.minima == (alone.cost,)


def test_minima_of_a_search_are_minima_by_ascending_cost(arm_scene: Scene, alone: Solution) -> None:
    """Equal ones count once, and each is a minimum that a solve from it finds again."""
    found = search(arm_scene, 20)
    costs = np.array(found.minima)
    assert len(costs) >= 3
    assert found.cost == costs[0]
    assert (np.diff(costs) > SAME_COST * costs[:-1]).all()
    assert np.isclose(costs, alone.cost, rtol=1e-9).any()
    assert found.problem is not None
    again = hovi.solve(found.problem, found.trajectory)
    assert (again.status, again.n_neg) == (Status.MINIMUM, 0)
    assert again.cost == pytest.approx(found.cost, rel=1e-12)


def test_only_minima_count_where_there_is_one(arm_scene: Scene) -> None:
    """With few steps most starts end before their minima, at whatever cost."""
    few, whole = search(arm_scene, 20, max_iterations=14, continuation=False), search(arm_scene, 20)
    assert few.success
    assert 1 <= len(few.minima) < len(whole.minima)
    assert list(few.minima) == sorted(few.minima)
    for cost in few.minima:
        assert np.isclose(cost, whole.minima, rtol=1e-6).any()


def test_without_a_minimum_the_best_motion_is_kept(arm_scene: Scene) -> None:
    hurried = {"max_iterations": 2, "continuation": False}
    costs = []
    for starts in (1, 4, 16):
        found = search(arm_scene, starts, **hurried)
        assert (found.status, found.minima) == (Status.ITERATION_LIMIT, ())
        assert np.isfinite(found.cost)
        costs.append(found.cost)
    assert costs == sorted(costs, reverse=True)


# The search


def test_starts_include_full_turns_either_way_of_continuous_joints() -> None:
    """A wheel of inertia I turned by x rad, at rest at both ends, costs 6 I^2 x^2 / T^3."""
    model = chain([pin.JointModelRUBZ()])
    inertia, T = float(pin.crba(model, model.createData(), pin.neutral(model))[0, 0]), 2.0
    turned = np.array([np.cos(1.0), np.sin(1.0)])
    grid = GRID | {"intervals": 8, "starts": 48, "processes": 1}
    found = hovi.plan(Scene(load_robot(model)), [1.0, 0.0], turned, T, **grid)
    turns = 1.0 + 2 * np.pi * np.array([0, -1, 1])
    np.testing.assert_allclose(found.minima[:3], 6 * inertia**2 * turns**2 / T**3, rtol=1e-9)


def test_more_starts_are_never_worse(arm_scene: Scene) -> None:
    best = [search(arm_scene, starts).cost for starts in (1, 5, 17, 24)]
    assert best == sorted(best, reverse=True)
    assert best[-1] < 0.7 * best[0]


def test_equal_seeds_give_equal_searches(arm_scene: Scene) -> None:
    one, again, other = (search(arm_scene, 12, seed=seed).minima for seed in (3, 3, 4))
    assert one == again
    assert one != other


def test_progress_counts_the_starts(arm_scene: Scene) -> None:
    reports: list[tuple[str, float]] = []
    search(arm_scene, 20, progress=lambda text, share: reports.append((text, share)))
    of_starts = [(text, share) for text, share in reports if " of 20 starts" in text]
    shares = [share for _, share in of_starts]
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < shares[-1] <= 1.0
    assert "20 of 20 starts" in of_starts[-1][0]


# Ends before the last start


@pytest.mark.parametrize("processes", [1, 2])
def test_a_time_limit_that_has_passed_gives_the_guess_back(
    arm_scene: Scene, alone: Solution, processes: int
) -> None:
    found = search(arm_scene, 1000, processes, time_limit=1e-9)
    assert (found.success, found.status, found.minima) == (False, Status.TIME_LIMIT, ())
    assert "after 1 of 1000 starts" in found.message
    assert found.problem is not None
    np.testing.assert_array_equal(found.trajectory.q, found.problem.guess("cubic").q)


def test_an_interrupt_between_rounds_keeps_the_solutions_so_far(arm_scene: Scene) -> None:
    def interrupt(text: str, fraction: float) -> None:
        raise KeyboardInterrupt

    found = search(arm_scene, 1000, progress=interrupt)
    every = search(arm_scene, 17)
    assert found.cost == every.cost  # those of the first round
    assert "after 17 of 1000 starts" in found.message


def test_an_interrupt_within_a_solve_ends_the_search(
    arm_scene: Scene, alone: Solution, monkeypatch: pytest.MonkeyPatch
) -> None:
    output, calls = EffortLagrangian.output, 0

    def interrupted_once(self: EffortLagrangian, *jet: Any, **more: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls == 100:
            raise KeyboardInterrupt
        return output(self, *jet, **more)

    monkeypatch.setattr(EffortLagrangian, "output", interrupted_once)
    found = search(arm_scene, 1000)
    assert 100 <= calls < 150
    assert found.success
    assert found.cost <= alone.cost
    ended = re.search(r"The search ended after (\d+) of 1000 starts", found.message)
    assert ended is not None
    assert 1 < int(ended[1]) < 100
