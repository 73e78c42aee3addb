"""Multi-start: distinct minima, independent of the number of processes, and early ends."""

from __future__ import annotations

import dataclasses
import sys

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi import PlanOptions, Solution, Status
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import cubic, with_bump
from hovi.discrete.path_on_grid import path_on_grid
from hovi.discrete.state import State
from hovi.planning.paths.first_guesses import FirstGuesses
from hovi.planning.search import multistart
from hovi.planning.search.final_stages import FinalStages
from hovi.planning.search.job import Job
from hovi.planning.search.multistart import (
    SAME_COST,
    STARTS_PER_ROUND,
    Exploration,
    Pool,
    default_processes,
    distinct,
    explore,
)
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.methods import interior_point
from hovi.planning.solver.solver import guess_path
from hovi.robot.loading import load_robot
from hovi.scene.scene import Scene
from hovi.schemes import by_name
from hovi.system.deadline import Deadline
from hovi.workers.pool import end_idle_workers
from oracles.on_grid import solve_on_grid
from samples.manifold_robots import chain
from samples.paper_arm import HANG


@pytest.fixture(scope="module")
def job(arm_scene: Scene) -> Job:
    """A swing-up in three seconds: it has many minima."""
    grid = Grid.uniform(3.0, 12, by_name("galerkin-1"))
    ends = State(HANG), State(-HANG)
    return Job(arm_scene, grid, *ends, PlanOptions(limits="none"))


@pytest.fixture(scope="module")
def guesses(job: Job) -> list:
    problem = job.problem()
    base = cubic(problem.robot, problem.ends, 3.0)
    curves = [base, *(with_bump(base, problem.robot, 3.0, seed) for seed in range(6))]
    return [path_on_grid(c, job.grid, problem.ends, problem.robot) for c in curves]


def silent(text: str, fraction: float) -> None:
    pass


def search(
    job: Job, guesses: list, starts: int, seed: int = 0, processes: int = 1
) -> list[Solution]:
    found = explore(Pool(job, processes), FirstGuesses(guesses[0]), starts, seed, silent)
    assert found.done == starts
    assert not found.interrupted
    return found.minima


# The pool


def test_a_job_is_the_problem_it_describes(job: Job, arm_scene: Scene) -> None:
    weighted = job.with_options(weight=(1.0, 5.0)).problem()
    assert weighted.scene is arm_scene
    assert weighted.grid is job.grid
    np.testing.assert_array_equal(weighted.ld.lagrangian.weight, [1.0, 5.0])  # type: ignore[attr-defined]
    np.testing.assert_array_equal(weighted.ends[0][1], -HANG)


@pytest.mark.parametrize("processes", [1, 2])
def test_solutions_come_in_the_order_of_the_guesses(
    job: Job, guesses: list, processes: int
) -> None:
    problem = job.problem()
    found = Pool(job, processes).solve_all(guesses).solutions
    assert len(found) == len(guesses)
    for guess, solution in zip(guesses, found, strict=True):
        alone = solve_on_grid(problem, guess)
        assert solution.cost == alone.cost
        assert solution.status == alone.status
        assert solution.trajectory.q.tobytes() == alone.trajectory.q.tobytes()


def test_starts_among_obstacles_may_be_solved_in_worker_processes() -> None:
    task = hovi.load_task(hovi.example("ur5_around_sphere"))
    here, there = (hovi.plan_task(task, starts=3, processes=number) for number in (1, 2))
    assert here.success
    assert there.success
    assert here.cost == pytest.approx(there.cost, rel=1e-3)
    assert len(here.minima) == len(there.minima)


def test_no_guess_is_no_solution(job: Job) -> None:
    assert Pool(job, 2).solve_all([]).solutions == []


@pytest.mark.parametrize("processes", [1, 2])
def test_a_pool_past_its_deadline_gives_the_first_guess_back(
    job: Job, guesses: list, processes: int
) -> None:
    found = Pool(job, processes, Deadline(-1.0)).solve_all(guesses).solutions
    assert [solution.status for solution in found] == [Status.TIME_LIMIT]
    np.testing.assert_array_equal(found[0].trajectory.q, guesses[0].q)


@pytest.mark.parametrize("program", ["/bin/false", "/nowhere/python"])
def test_guesses_are_solved_here_if_no_worker_starts(
    job: Job, guesses: list, program: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = Pool(job, 1).solve_all(guesses[:2])
    end_idle_workers()
    monkeypatch.setattr(sys, "executable", program)
    found = Pool(job, 2).solve_all(guesses[:2])
    assert found.lost == []
    assert len(found.solutions) == 2
    assert [each.cost for each in found.solutions] == [each.cost for each in alone.solutions]


KILL = "__import__('os').kill(__import__('os').getpid(), 9)"


class DeadlyPath(DiscretePath):
    """A guess that kills the process to which it is sent."""

    def __reduce__(self) -> tuple:
        return eval, (KILL,)


class DeadlyJob(Job):
    """A job that kills the process to which it is sent."""

    def __reduce__(self) -> tuple:
        return eval, (KILL,)


def test_a_worker_that_is_killed_loses_its_guess_only(job: Job, guesses: list) -> None:
    deadly = DeadlyPath(*guesses[1].arrays)
    alone = [solve_on_grid(job.problem(), guess).cost for guess in (guesses[0], guesses[2])]
    found = Pool(job, 2).solve_all([guesses[0], deadly, guesses[2]])
    assert [solution.cost for solution in found.solutions] == alone
    assert len(found.lost) == 1
    assert "SIGKILL" in found.lost[0]
    assert not found.interrupted


def test_an_exploration_ends_with_a_round_that_every_process_dies_of(
    job: Job, guesses: list
) -> None:
    deadly = DeadlyJob(job.scene, job.grid, job.start, job.goal, job.options)
    found = explore(Pool(deadly, 2), FirstGuesses(guesses[0]), 1000, 0, silent)
    assert (found.done, len(found.lost)) == (1, STARTS_PER_ROUND)
    assert found.minima[0].success
    assert not found.interrupted


def test_minima_stay_as_they_are_if_every_process_dies_that_refines_them(
    job: Job, guesses: list
) -> None:
    found = [solve_on_grid(job.problem(), guess) for guess in guesses[:2]]
    options = job.options.with_changes(processes=2)
    deadly = DeadlyJob(job.scene, job.grid, job.start, job.goal, options)
    best, *others = FinalStages(deadly, Deadline(), silent).to_requested_grid(found)
    assert others == []
    assert (best.success, best.status) == (False, Status.INTERRUPTED)
    assert best.trajectory is found[0].trajectory
    assert "the requested grid was not reached, since a worker process was ended" in best.message


def test_one_process_refines_minima_without_workers(job: Job, guesses: list) -> None:
    found = [solve_on_grid(job.problem(), guess) for guess in guesses[:2]]
    alone = job.options.with_changes(processes=1)
    deadly = DeadlyJob(job.scene, job.grid, job.start, job.goal, alone)
    refined = FinalStages(deadly, Deadline(), silent).to_requested_grid(found)
    assert [each.cost for each in refined] == pytest.approx(sorted(each.cost for each in found))


def test_there_is_at_least_one_processor(job: Job) -> None:
    assert default_processes() >= 1


# Distinct minima


def fake(solution: Solution, cost: float, status: Status = Status.MINIMUM) -> Solution:
    return dataclasses.replace(solution, cost=cost, status=status, success=status is Status.MINIMUM)


@pytest.fixture(scope="module")
def any_solution(job: Job, guesses: list) -> Solution:
    return solve_on_grid(job.problem(), guesses[0])


def test_minima_are_sorted_and_equal_ones_count_once(any_solution: Solution) -> None:
    near = 1.0 + 0.1 * SAME_COST
    costs = [3.0, 1.0, 2.0, near, 1.0, 3.0]
    found = distinct([fake(any_solution, cost) for cost in costs])
    assert [solution.cost for solution in found] == [1.0, 2.0, 3.0]


def test_only_minima_count_where_there_is_one(any_solution: Solution) -> None:
    others = [Status.SADDLE, Status.TIME_LIMIT, Status.DIVERGED, Status.ITERATION_LIMIT]
    solutions = [fake(any_solution, 0.1, status) for status in others]
    found = distinct([*solutions, fake(any_solution, 5.0)])
    assert [solution.cost for solution in found] == [5.0]


def test_without_a_minimum_the_best_other_solution_is_kept(any_solution: Solution) -> None:
    diverged = fake(any_solution, np.nan, Status.DIVERGED)
    rest = [fake(any_solution, cost, Status.TIME_LIMIT) for cost in (3.0, 2.0)]
    assert [s.cost for s in distinct([diverged, *rest])] == [2.0]
    assert distinct([diverged]) == [diverged]


# The search


def test_one_start_is_the_guess(job: Job, guesses: list) -> None:
    (only,) = search(job, guesses, 1)
    assert only.cost == solve_on_grid(job.problem(), guesses[0]).cost


def test_minima_of_a_search_are_minima_by_ascending_cost(job: Job, guesses: list) -> None:
    minima = search(job, guesses, 20)
    costs = [solution.cost for solution in minima]
    assert len(costs) >= 3
    assert costs == sorted(costs)
    assert (np.diff(costs) > SAME_COST * np.array(costs[:-1])).all()
    for solution in minima:
        assert solution.status is Status.MINIMUM
        assert solution.n_neg == 0
        again = solve_on_grid(job.problem(), solution.trajectory.path)
        assert again.cost == pytest.approx(solution.cost, rel=1e-12)
    assert any(
        cost == pytest.approx(solve_on_grid(job.problem(), guesses[0]).cost) for cost in costs
    )


def test_starts_include_full_turns_either_way_of_continuous_joints() -> None:
    """A wheel of inertia I turned by x rad, at rest at both ends, costs 6 I^2 x^2 / T^3."""
    model = chain([pin.JointModelRUBZ()])
    inertia, T = float(pin.crba(model, model.createData(), pin.neutral(model))[0, 0]), 2.0
    grid = Grid.uniform(T, 8, by_name("galerkin-2"))
    scene, turned = Scene(load_robot(model)), np.array([np.cos(1.0), np.sin(1.0)])
    wheel = Job(scene, grid, State([1.0, 0.0]), State(turned), PlanOptions(limits="none"))
    first = guess_path(wheel.problem(), "cubic")
    costs = [solution.cost for solution in search(wheel, [first], 48)]
    turns = 1.0 + 2 * np.pi * np.array([0, -1, 1])
    np.testing.assert_allclose(costs[:3], 6 * inertia**2 * turns**2 / T**3, rtol=1e-9)


def test_more_starts_are_never_worse(job: Job, guesses: list) -> None:
    best = [search(job, guesses, starts)[0].cost for starts in (1, 5, 17, 24)]
    assert best == sorted(best, reverse=True)


def test_equal_seeds_give_equal_searches(job: Job, guesses: list) -> None:
    one, again, other = (
        [solution.cost for solution in search(job, guesses, 12, seed)] for seed in (3, 3, 4)
    )
    assert one == again
    assert one != other


def test_the_number_of_processes_changes_nothing(job: Job, guesses: list) -> None:
    alone, shared = (search(job, guesses, 19, processes=count) for count in (1, 2))
    assert len(alone) == len(shared)
    for one, other in zip(alone, shared, strict=True):
        assert one.cost == other.cost
        for name in ("q", "v", "z", "inner"):
            arrays = (getattr(solution.trajectory.path, name) for solution in (one, other))
            assert len({array.tobytes() for array in arrays}) == 1


def test_progress_rises_to_one(job: Job, guesses: list) -> None:
    reports: list[tuple[str, float]] = []
    explore(
        Pool(job, 1),
        FirstGuesses(guesses[0]),
        20,
        0,
        lambda text, share: reports.append((text, share)),
    )
    shares = [share for _, share in reports]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert "20 of 20 starts" in reports[-1][0]


# Ends before the last start


def test_a_deadline_ends_the_search_with_the_solutions_so_far(job: Job, guesses: list) -> None:
    late = Pool(job, 1, Deadline(-1.0))
    found = explore(late, FirstGuesses(guesses[0]), 1000, 0, silent)
    assert found.done == 1
    assert not found.interrupted
    assert [solution.status for solution in found.minima] == [Status.TIME_LIMIT]


def test_an_interrupt_between_rounds_keeps_the_solutions_so_far(job: Job, guesses: list) -> None:
    def interrupt(text: str, fraction: float) -> None:
        raise KeyboardInterrupt

    found = explore(Pool(job, 1), FirstGuesses(guesses[0]), 1000, 0, interrupt)
    assert found.interrupted
    assert 1 < found.done < 1000
    assert found.minima[0].success


def test_an_interrupt_within_a_solve_ends_the_search(
    job: Job, guesses: list, monkeypatch: pytest.MonkeyPatch
) -> None:
    value, calls = ActionObjective.value, 0

    def interrupted_once(self: ActionObjective, x: object) -> float:
        nonlocal calls
        calls += 1
        if calls == 100:
            raise KeyboardInterrupt
        return value(self, x)  # type: ignore[arg-type]

    monkeypatch.setattr(ActionObjective, "value", interrupted_once)
    found = explore(Pool(job, 1), FirstGuesses(guesses[0]), 1000, 0, silent)
    assert found.interrupted
    assert 1 < found.done < 100
    assert calls < 110
    assert found.minima[0].success


# A path around obstacles, and the direct guess


DIVERGED, LIMIT, FOUND = Status.DIVERGED, Status.ITERATION_LIMIT, Status.MINIMUM


@pytest.mark.parametrize(
    ("others", "answers", "ways"),
    [
        (0, [FOUND], ["path rows"]),
        (0, [DIVERGED, FOUND], ["path rows", "direct rows"]),
        (0, [DIVERGED, DIVERGED, FOUND], ["path rows", "direct rows", "path points"]),
        (0, [DIVERGED, LIMIT], ["path rows", "direct rows"]),
        (
            0,
            [DIVERGED, DIVERGED, LIMIT, FOUND],
            ["path rows", "direct rows", "path points", "direct points"],
        ),
        (0, [LIMIT, LIMIT], ["path rows", "direct rows"]),
        (2, [DIVERGED, FOUND], ["path rows", "direct rows"]),
        (2, [DIVERGED] * 2 + [FOUND], ["path rows", "direct rows", "other rows"]),
        (
            2,
            [DIVERGED] * 4 + [FOUND],
            ["path rows", "direct rows", "other rows", "other rows", "path points"],
        ),
        (2, [DIVERGED, LIMIT], ["path rows", "direct rows"]),
        (2, [DIVERGED] * 2 + [LIMIT], ["path rows", "direct rows", "other rows"]),
    ],
)
def test_the_slower_way_comes_after_the_other_guesses(
    job: Job,
    guesses: list,
    monkeypatch: pytest.MonkeyPatch,
    others: int,
    answers: list[Status],
    ways: list[str],
) -> None:
    """others: number of further paths, which are drawn once, and only where they are needed."""
    drawn = list[int]()

    def further() -> list:
        drawn.append(others)
        return guesses[2 : 2 + others]

    first = FirstGuesses(guesses[0], 0.1, (guesses[1],), further)
    asked, found = answered(job, first, answers, monkeypatch)
    assert asked == ways
    assert found.done == len(ways)
    assert found.minima[0].success == (FOUND in answers)
    assert len(found.by_path) == sum("direct" not in each for each in ways)
    assert len(drawn) == (len(ways) > 2)


def answered(
    job: Job, first: FirstGuesses, answers: list[Status], monkeypatch: pytest.MonkeyPatch
) -> tuple[list[str], Exploration]:
    """What a single start solves, guess and way, where solves end as given; and what it finds."""
    known, left, asked = search(job, [first.direct], 1)[0], list(answers), list[str]()
    names = {id(first.direct): "direct", id(first.paths[0]): "path"}

    def solve(job: Job, free: object, guess: object, limit: object, way: object) -> Solution:
        asked.append(f"{names.get(id(guess), 'other')} {way}")
        status = left.pop(0)
        return dataclasses.replace(known, status=status, success=status is FOUND)

    monkeypatch.setattr(multistart, "_solve", solve)
    monkeypatch.setattr(interior_point, "takes_rows", lambda problem: True)
    return asked, explore(Pool(job, 1), first, 1, 0, silent)


def test_where_distances_have_no_rows_every_guess_has_one_solve(
    job: Job, guesses: list, monkeypatch: pytest.MonkeyPatch
) -> None:
    known, asked = search(job, guesses, 1)[0], list[object]()

    def solve(job: Job, free: object, guess: object, limit: object, way: object) -> Solution:
        asked.append(way)
        return dataclasses.replace(known, status=DIVERGED, success=False)

    monkeypatch.setattr(multistart, "_solve", solve)
    explore(Pool(job, 1), FirstGuesses(guesses[0], 0.1, (guesses[1],)), 1, 0, silent)
    assert asked == [None, None]
