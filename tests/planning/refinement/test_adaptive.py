"""Plans to a tolerance: the true error is below it and near its estimate, or a reason is given."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hovi import Solution, Status, plan
from hovi.discrete.grid import Grid
from hovi.discrete.measures.motion_error import deviation
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Gravity
from hovi.planning.problem.tolerance import Accuracy
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task import Task
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from oracles.on_grid import solve_on_grid
from samples.paper_arm import HANG, REACH_Q, REACH_V
from samples.stopped_searches import InterruptedEvaluations, LeapingClock

SCENES = ("two_link_reach", "ur5_reach", "panda_reach")
TOLERANCES = (1e-2, 1e-4, 1e-6, 1e-9, "1 mm", "1e-3 mm", "0.1 deg", "1e-5 rad")


@pytest.fixture(scope="module", params=SCENES)
def task(request: pytest.FixtureRequest) -> Task:
    return load_task(example(f"{request.param}.toml"))


def planned(task: Task, tolerance: float | str, **options: object) -> Solution:
    ends = task.start, task.goal, task.duration
    return plan(
        task.scene, *ends, tolerance=tolerance, limits="none", **options, self_collision=False
    )  # type: ignore[arg-type]


def accuracy_of(solution: Solution) -> Accuracy:
    assert solution.accuracy is not None
    return solution.accuracy


def true_error(solution: Solution, frame: str | None = None) -> float:
    """The error in the tolerance's unit, relative to half the steps and six more modes."""
    problem, grid = solution.problem, solution.trajectory.grid
    assert problem is not None
    tables = tuple(galerkin(scheme.inner_modes + 6) for scheme in grid.schemes)
    fine = Grid(grid.steps, tables).halved(np.ones(grid.intervals, dtype=bool))
    reference = solve_on_grid(problem.on(fine), solution.trajectory)
    assert reference.success
    costs = solution.cost, reference.cost
    error = deviation(solution.trajectory, reference.trajectory, costs, frame)
    return accuracy_of(solution).tolerance.measure(error)


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_the_true_error_is_below_the_tolerance_and_near_its_estimate(
    task: Task, tolerance: float | str
) -> None:
    solution = planned(task, tolerance)
    accuracy = accuracy_of(solution)
    true = true_error(solution)
    assert solution.success
    assert accuracy.reached
    assert true <= accuracy.tolerance.size
    assert true <= 10 * accuracy.error
    if accuracy.error > 1e-12:  # below, rounding affects both
        assert true >= accuracy.error / 10


def test_the_error_of_another_frame(task: Task) -> None:
    frame = task.scene.robot.frame_names[-2]
    solution = planned(task, f"0.01 mm at {frame}")
    assert accuracy_of(solution).estimate is not None
    assert true_error(solution, frame) <= 1e-5


def test_a_larger_tolerance_takes_less_work(task: Task) -> None:
    rounds = [accuracy_of(planned(task, tolerance)).rounds for tolerance in (1e-2, 1e-5, 1e-11)]
    points = [each[-1].points for each in rounds]
    assert points == sorted(points)
    assert points[0] < points[-1]


def test_the_solution_reports_its_grid_and_its_error(task: Task) -> None:
    solution = planned(task, 1e-7)
    assert solution.problem is not None
    assert solution.problem.grid is solution.trajectory.grid
    assert solution.error_estimate == accuracy_of(solution).error
    assert solution.cost == pytest.approx(
        solution.problem.ld.action(solution.trajectory.path), rel=1e-13
    )
    assert "estimated error" in solution.message
    assert solution.nit == sum(done.nit for done in accuracy_of(solution).rounds)


def test_a_second_plan_is_the_same(task: Task) -> None:
    one, other = (planned(task, 1e-6) for _ in range(2))
    np.testing.assert_array_equal(one.trajectory.q, other.trajectory.q)
    np.testing.assert_array_equal(one.trajectory.grid.steps, other.trajectory.grid.steps)


# Where it ends early


def test_no_error_below_rounding_is_claimed(arm_scene: Scene) -> None:
    found = plan(arm_scene, HANG, State(REACH_Q, REACH_V), 1.0, limits="none", tolerance=1e-16)
    accuracy = accuracy_of(found)
    assert found.success
    assert not accuracy.reached
    assert accuracy.error >= 1e-14
    assert "stopped early: rounding allows no smaller error" in found.message


class AtRound:
    """A progress of a plan that counts the grids that are reported, and acts at one of them."""

    def __init__(self, number: int, act: Callable[[], None]) -> None:
        self._number, self._act, self.texts = number, act, list[str]()

    def __call__(self, text: str, fraction: float) -> None:
        if "estimated error" in text:
            self.texts.append(text)
            if len(self.texts) == self._number:
                self._act()


def test_a_time_limit_is_reported_with_the_error_so_far(
    arm_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a clock that leaps after the first grid."""
    late = LeapingClock(monkeypatch).leap
    given = {"limits": "none", "tolerance": 1e-10, "intervals": 6, "time_limit": 1e5}
    goal = State(REACH_Q, REACH_V)
    ended = plan(arm_scene, HANG, goal, 1.0, **given, progress=AtRound(1, late))
    accuracy = accuracy_of(ended)
    assert (ended.success, accuracy.reached) == (True, False)
    assert len(accuracy.rounds) == 1
    assert accuracy.error == accuracy.rounds[0].error > 1e-7
    assert "stopped early: the time limit was reached" in ended.message


def test_an_interrupt_returns_the_best_candidate(
    arm_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the first solve, in the first comparison, and later."""
    evaluations = InterruptedEvaluations(monkeypatch)
    ends, given = (arm_scene, HANG, State(REACH_Q, REACH_V), 1.0), {"intervals": 6}
    assert plan(*ends, limits="none", tolerance=1e-10, **given).success
    whole, known = evaluations.calls, list[float]()
    for number in range(2, whole, 2):
        evaluations.restart(number)
        found = plan(*ends, limits="none", tolerance=1e-10, **given)
        assert not found.success
        assert found.status in (Status.INTERRUPTED, Status.UNRESOLVED)
        assert "interrupted" in found.message
        if found.accuracy is None:  # before the refinement
            assert found.error_estimate is None
        else:
            assert not found.accuracy.reached
            assert np.isnan(found.accuracy.error) == (found.error_estimate is None)
            known.append(found.accuracy.error)
    assert np.isnan(known).any()
    assert not np.isnan(known).all()


@pytest.mark.long
def test_the_estimate_of_a_minimum_that_moves_away_is_corrected(arm_scene: Scene) -> None:
    # with fifty seconds every finer grid leads further down a long valley
    options = {"limits": "none", "intervals": 60, "tolerance": 1e-6}
    found = plan(arm_scene, HANG, -HANG, 50.0, **options)  # type: ignore[arg-type]
    accuracy = accuracy_of(found)
    assert not accuracy.reached
    assert "stopped early" in found.message
    assert found.problem is not None
    assert found.error_estimate is not None
    every = np.ones(found.trajectory.grid.intervals, dtype=bool)
    finer = solve_on_grid(found.problem.on(found.trajectory.grid.halved(every)), found.trajectory)
    assert abs(finer.cost / found.cost - 1) <= 10 * found.error_estimate


def test_no_error_is_claimed_without_a_minimum(arm_scene: Scene) -> None:
    goal = State(REACH_Q, REACH_V)
    options = {"limits": "none", "max_iterations": 2, "continuation": False}
    found = plan(arm_scene, HANG, goal, 1.0, tolerance=1e-6, **options)  # type: ignore[arg-type]
    assert found.status is Status.ITERATION_LIMIT
    assert found.error_estimate is None
    assert not accuracy_of(found).reached
    assert "no error was estimated" in found.message


def test_standing_still_is_exact(arm_scene: Scene) -> None:
    weightless = Scene(arm_scene.robot)
    found = plan(weightless, HANG, HANG, 1.0, limits="none", tolerance=1e-9)
    assert (found.cost, found.error_estimate, accuracy_of(found).reached) == (0.0, 0.0, True)


# Grids


def test_a_sharp_turn_gets_the_short_intervals() -> None:
    task = load_task(example("two_link_swing_up.toml"))
    ends = task.start, task.goal, task.duration
    options = {"limits": "none", "processes": 1}
    guess = plan(task.scene, *ends, intervals=60, **options).trajectory  # type: ignore[arg-type]
    found = planned(task, 1e-7, guess=guess, intervals=24, processes=1)
    assert accuracy_of(found).rounds[0].error > 1e-2
    assert accuracy_of(found).reached
    assert true_error(found) <= 1e-7
    grid = found.trajectory.grid
    sharp = np.linalg.norm(found.trajectory.sample(grid.t[:-1] + grid.steps / 2).a, axis=1)
    short = grid.steps < 0.6 * grid.steps.max()
    assert grid.steps.max() > 3 * grid.steps.min()
    assert short[np.argmax(sharp)]
    assert np.median(sharp[short]) > 1.5 * np.median(sharp[~short])


def test_every_round_is_reported(arm_scene: Scene) -> None:
    reports, goal = AtRound(-1, lambda: None), State(REACH_Q, REACH_V)
    given = {"limits": "none", "tolerance": 1e-10, "intervals": 6}
    found = plan(arm_scene, HANG, goal, 1.0, **given, progress=reports)
    rounds = accuracy_of(found).rounds
    assert reports.texts == [
        f"{done.intervals} intervals, estimated error {done.error:.1e}" for done in rounds
    ]
    assert len(rounds) >= 2


def test_many_starts_are_ranked_with_their_errors(arm_scene: Scene) -> None:
    found = plan(arm_scene, HANG, -HANG, 3.0, limits="none", starts=12, processes=1, tolerance=1e-6)
    assert found.minima[0] == found.cost
    assert list(found.minima) == sorted(found.minima)
    assert accuracy_of(found).reached


def test_a_motion_of_mixed_schemes_is_saved_and_loaded(
    arm_scene: Scene, tmp_path_factory: pytest.TempPathFactory
) -> None:
    found = plan(arm_scene, HANG, State(REACH_Q, REACH_V), 1.0, limits="none", tolerance=1e-9)
    file = tmp_path_factory.mktemp("saved") / "motion.npz"
    found.trajectory.save(file)
    loaded = Trajectory.load(file)
    t = np.linspace(0.0, 1.0, 77)
    np.testing.assert_array_equal(loaded.sample(t).tau, found.trajectory.sample(t).tau)
    assert loaded.metadata["error_estimate"] == found.error_estimate


# Other problems than between two states


def test_ends_that_are_free(arm_scene: Scene) -> None:
    free = plan(
        arm_scene, HANG, State(REACH_Q, free_velocity="all"), 1.0, limits="none", tolerance=1e-7
    )
    assert accuracy_of(free).reached
    true = true_error(free)
    assert accuracy_of(free).error / 10 <= true <= 1e-7


def test_joints_without_torque(two_link: Robot) -> None:
    acrobot = Scene(two_link, effects=[Gravity(9.8)], passive=["shoulder"])
    found = plan(
        acrobot, HANG, State(np.add(HANG, [0.6, -1.0])), 1.5, limits="none", tolerance=1e-4
    )
    assert found.success
    assert accuracy_of(found).reached
    true = true_error(found)
    assert accuracy_of(found).error / 10 <= true <= 1e-4


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
def test_motions_under_limits(arm_scene: Scene, tolerance: float) -> None:
    limits = {"base": "none", "v": 5.0}
    options = {"limits": limits, "intervals": 8, "tolerance": tolerance}
    found = plan(arm_scene, HANG, State(REACH_Q, REACH_V), 1.0, **options)  # type: ignore[arg-type]
    accuracy = accuracy_of(found)
    assert found.problem is not None
    assert accuracy.reached
    every = np.ones(found.trajectory.grid.intervals, dtype=bool)
    grid = found.trajectory.grid.halved(every)
    grid = grid.halved(np.ones(grid.intervals, dtype=bool))
    reference = solve_on_grid(found.problem.on(grid), found.trajectory)
    assert reference.success
    true = abs(found.cost / reference.cost - 1)
    assert accuracy.error / 10 <= true <= tolerance
    t = np.linspace(0.0, 1.0, 1001)
    assert np.abs(found.trajectory.sample(t).v).max() <= 5.0 * (1 + 1e-5)


def test_no_error_below_the_tolerance_of_limits_is_claimed(arm_scene: Scene) -> None:
    limits = {"base": "none", "v": 5.0, "tolerance": 1e-4}
    goal = State(REACH_Q, REACH_V)
    found = plan(arm_scene, HANG, goal, 1.0, limits=limits, intervals=8, tolerance=1e-5)
    accuracy = accuracy_of(found)
    assert (found.success, accuracy.reached) == (True, False)
    assert accuracy.error >= 1e-4
    assert "stopped early" in found.message


@pytest.mark.parametrize("most", [10, 40, 60, 100])
def test_within_limits_few_steps_end_in_the_same_motion_or_are_told(
    tight_reach: dict[str, Any], most: int
) -> None:
    """A solve on a finer grid that reaches its iteration limit is continued once, from 40 on."""
    whole = plan(**tight_reach)
    found = plan(**tight_reach, max_iterations=most, continuation=False)
    assert whole.success, whole.message
    assert found.success == (most > 10)
    if found.success:
        assert accuracy_of(found).reached
        assert found.cost == pytest.approx(whole.cost, rel=1e-6)
    else:
        assert found.status is Status.ITERATION_LIMIT
        assert not accuracy_of(found).reached
        assert "the iteration limit was reached" in found.message


@pytest.fixture(scope="module")
def tight_reach() -> dict[str, Any]:
    """A UR5 within nine tenths of the torques that it would take, which halves intervals."""
    scene = Scene(load_robot("ur5"), [Gravity()])
    ends = {
        "scene": scene,
        "start": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0],
        "goal": [1.5, -1.0, 1.0, -1.5, -1.0, 0.5],
        "duration": 0.6,
        "self_collision": False,
    }
    free = plan(**ends, limits="none", scheme="galerkin-2", intervals=6).trajectory
    most = 0.9 * np.abs(free.sample(np.linspace(0.0, 0.6, 101)).tau).max(axis=0)
    return ends | {"limits": {"base": "none", "tau": most}, "tolerance": 1e-6, "intervals": 6}


def test_an_interrupt_after_some_grids_returns_the_most_accurate_motion(arm_scene: Scene) -> None:
    """Under a limit, which takes many grids."""
    limits = {"base": "none", "tau": 6.5, "tolerance": 1e-9}

    def interrupt() -> None:
        raise KeyboardInterrupt

    goal = State(REACH_Q, REACH_V)
    given = {"limits": limits, "intervals": 6, "tolerance": 1e-12}
    ended = plan(arm_scene, HANG, goal, 1.0, **given, progress=AtRound(3, interrupt))
    accuracy = accuracy_of(ended)
    finished = accuracy.rounds[:2]  # the last one was not compared any more
    best = min(finished, key=lambda done: done.error)
    assert best is finished[1]
    assert ended.status is Status.INTERRUPTED
    assert ended.cost == best.cost
    assert accuracy.error >= best.error
    assert accuracy.error < 0.5 * finished[0].error


@pytest.mark.parametrize(
    ("intervals", "number", "limited"),
    [(1, 1, 1), (2, 1, 2), (16, 10, 16), (60, 40, 60), (1000, 40, 60)],
)
def test_the_first_grids_are_those_that_the_page_on_tolerances_states(
    arm_scene: Scene, intervals: int, number: int, limited: int
) -> None:
    """docs/tolerance.md: of 16 intervals 10, and 40 at most; 60 at most where kinks are."""
    once = {"max_iterations": 1, "continuation": False, "tolerance": 1e-3, "intervals": intervals}
    for limits, most, scheme in (
        ("none", number, "galerkin-4x10"),
        ({"base": "none", "v": 50.0}, limited, "galerkin-2x8"),
    ):
        found = plan(arm_scene, HANG, REACH_Q, 1.5, limits=limits, **once)
        grid = found.trajectory.grid
        assert grid.intervals == accuracy_of(found).rounds[0].intervals == most
        assert {each.name for each in grid.schemes} == {scheme}


@pytest.mark.parametrize("objective", ["effort", "acceleration"])
def test_within_limits_grids_are_refined_whatever_the_objective(
    arm_scene: Scene, objective: str
) -> None:
    """Also where no torque has a weight, whose differences are what an interval contributes."""
    given = {"limits": {"base": "none", "v": 2.2}, "objective": objective, "intervals": 6}
    found = plan(arm_scene, HANG, REACH_Q, 1.0, tolerance=1e-4, **given)
    fine = plan(arm_scene, HANG, REACH_Q, 1.0, scheme="galerkin-2x8", **(given | {"intervals": 96}))
    accuracy = accuracy_of(found)
    assert accuracy.reached
    assert len(accuracy.rounds) == 2
    assert accuracy.rounds[1].points > accuracy.rounds[0].points
    assert abs(found.cost / fine.cost - 1) <= 1e-4
