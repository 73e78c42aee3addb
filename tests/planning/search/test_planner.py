"""plan: one call to a motion, and one sentence for every invalid input."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from hovi import Solution, Status, plan
from hovi import plan as public_plan
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.effects import Gravity
from hovi.errors import HoviError, InputError, ModelError, SceneError, SchemeError
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task_plan import plan_task
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.scene import Scene
from hovi.schemes import by_name, galerkin, is_galerkin
from oracles.on_grid import solve_on_grid
from samples.manifold_robots import half_turning
from samples.paper_arm import HANG, REACH_COST, REACH_Q, REACH_V
from samples.stopped_searches import InterruptedEvaluations

Array = npt.NDArray[np.float64]

GOAL = State(REACH_Q, REACH_V)
COARSE_INTERVALS, MAX_REFINED = 80, 6
"""Intervals of the grid on which many starts are compared, and how many minima are refined."""


def swing_up(scene: Scene, **options: Any) -> Solution:
    """A swing-up in three seconds, which has many minima."""
    options = {"intervals": 12, "scheme": "galerkin-1", "processes": 1, "limits": "none"} | options
    return plan(scene, HANG, -HANG, 3.0, **options, self_collision=False)


def assert_same(one: Solution, other: Solution) -> None:
    assert one.cost == other.cost
    assert one.minima == other.minima
    assert one.message == other.message
    for name in ("q", "v", "z", "inner"):
        arrays = (getattr(solution.trajectory.path, name) for solution in (one, other))
        assert len({array.tobytes() for array in arrays}) == 1
    assert one.trajectory.momenta.tobytes() == other.trajectory.momenta.tobytes()


# The solution


def test_plan_is_a_public_name() -> None:
    assert public_plan is plan


def test_one_start_is_one_solve(arm_scene: Scene) -> None:
    planned = plan(arm_scene, HANG, GOAL, 1.0, intervals=32, limits="none")
    assert planned.status is Status.MINIMUM
    assert planned.cost == pytest.approx(REACH_COST, rel=1e-9)
    assert planned.minima == (planned.cost,)
    assert planned.problem is not None
    solved = solve_on_grid(planned.problem)
    assert planned.cost == solved.cost
    assert planned.trajectory.q.tobytes() == solved.trajectory.q.tobytes()
    assert planned.setup_seconds >= 0
    assert planned.solve_seconds > 0


def test_the_default_is_a_tolerance_of_1e_3(arm_scene: Scene) -> None:
    found = plan(arm_scene, HANG, GOAL, 1.0, limits="none")
    assert found.accuracy is not None
    assert found.accuracy.tolerance.size == 1e-3
    assert found.accuracy.reached


@pytest.mark.parametrize(
    ("named", "scheme", "intervals"),
    [
        ({"intervals": 20}, "galerkin-2", 20),
        ({"scheme": "galerkin-1x5"}, "galerkin-1x5", 16),
        ({"scheme": "galerkin-3", "intervals": 12}, "galerkin-3", 12),
    ],
)
def test_naming_a_scheme_or_intervals_fixes_the_grid(
    arm_scene: Scene, named: dict[str, Any], scheme: str, intervals: int
) -> None:
    found = plan(arm_scene, HANG, GOAL, 1.0, limits="none", **named)
    assert found.accuracy is None
    assert found.trajectory.grid.intervals == intervals
    assert {each.name for each in found.trajectory.grid.schemes} == {scheme}


def test_configurations_are_states_at_rest(arm_scene: Scene) -> None:
    one = swing_up(arm_scene)
    states = plan(
        arm_scene,
        State(HANG),
        State(-HANG, [0.0, 0.0]),
        3.0,
        intervals=12,
        scheme=galerkin(1),
        limits="none",
    )
    assert_same(one, states)
    lists = plan(
        arm_scene,
        HANG.tolist(),
        (-HANG).tolist(),
        3,  # type: ignore[arg-type]
        intervals=12,
        scheme="galerkin-1",
        limits="none",
    )
    assert_same(one, lists)


def test_a_motion_is_a_guess(arm_scene: Scene) -> None:
    first = swing_up(arm_scene, starts=20)
    again = swing_up(arm_scene, guess=first.trajectory)
    assert again.cost == pytest.approx(first.cost, rel=1e-12)
    assert again.nit <= 2


def test_weights_change_which_motion_is_best(arm_scene: Scene) -> None:
    even, shy = swing_up(arm_scene), swing_up(arm_scene, weight=[1.0, 100.0])
    peaks = [
        np.abs(s.trajectory.sample(np.linspace(0, 3, 99)).tau[:, 1]).max() for s in (even, shy)
    ]
    assert peaks[1] < peaks[0]


def test_a_plan_can_be_replanned(arm_scene: Scene) -> None:
    planned = plan(arm_scene, HANG, GOAL, 1.0, limits="none")
    moved = planned.replan(goal=State(REACH_Q + 0.01, REACH_V))
    assert moved.status is Status.MINIMUM
    np.testing.assert_array_equal(moved.trajectory.q[-1], REACH_Q + 0.01)


# Limits


@pytest.mark.parametrize("intervals", [8, 12, 16])
@pytest.mark.parametrize("limits", [{"v": 6.0}, {"v": [5.0, 8.0]}, {"v": [3.0, 6.0]}])
def test_active_limits_are_held(arm_scene: Scene, intervals: int, limits: dict[str, Any]) -> None:
    free = plan(arm_scene, HANG, GOAL, 1.0, intervals=intervals, limits="none")
    bound = plan(arm_scene, HANG, GOAL, 1.0, intervals=intervals, limits={"base": "none"} | limits)
    t = np.linspace(0.0, 1.0, 501)
    largest = np.broadcast_to(limits["v"], 2)
    assert (np.abs(free.trajectory.sample(t).v).max(axis=0) > largest).any()
    assert bound.status is Status.MINIMUM
    assert (np.abs(bound.trajectory.sample(t).v).max(axis=0) <= largest * (1 + 1e-5)).all()
    assert bound.cost > 0.999 * free.cost


def test_a_plan_under_limits_can_be_replanned(arm_scene: Scene) -> None:
    limits = {"base": "none", "a": 30.0}
    planned = plan(arm_scene, HANG, GOAL, 1.0, intervals=6, limits=limits)
    assert planned.status is Status.MINIMUM
    again = planned.replan(goal=State(REACH_Q + 0.001, REACH_V))
    assert again.status is Status.MINIMUM
    np.testing.assert_array_equal(again.trajectory.q[-1], REACH_Q + 0.001)


def test_a_refinement_begins_with_the_grid_of_a_guess_only_if_that_is_usual(
    arm_scene: Scene,
) -> None:
    """Galerkin tables on more intervals than the first grid would have."""
    for scheme, intervals, kept in (
        ("galerkin-3", 70, True),
        ("galerkin-3", 4, False),
        ("taylor-midpoint", 70, False),
    ):
        first = plan(arm_scene, HANG, GOAL, 1.0, scheme=scheme, intervals=intervals, limits="none")
        options = {"guess": first.trajectory, "tolerance": 1e-5, "limits": "none"}
        found = plan(arm_scene, HANG, GOAL, 1.0, **options)  # type: ignore[arg-type]
        assert found.accuracy is not None
        assert found.accuracy.reached
        assert (found.accuracy.rounds[0].intervals == intervals) == kept
        assert all(is_galerkin(each) for each in found.trajectory.grid.schemes)


# Many starts


def test_more_starts_find_more_and_better_minima(arm_scene: Scene) -> None:
    one, many = swing_up(arm_scene), swing_up(arm_scene, starts=24)
    assert many.cost < one.cost
    assert many.success
    assert many.minima[0] == many.cost
    assert list(many.minima) == sorted(many.minima)
    assert len(many.minima) >= 4
    assert any(cost == pytest.approx(one.cost, rel=1e-6) for cost in many.minima)


def test_one_and_two_processes_give_the_same_bytes(arm_scene: Scene) -> None:
    assert_same(*(swing_up(arm_scene, starts=19, processes=count) for count in (1, 2)))


def test_the_same_seed_gives_the_same_bytes_and_another_does_not(arm_scene: Scene) -> None:
    one, again, other = (swing_up(arm_scene, starts=12, seed=seed) for seed in (1, 1, 2))
    assert_same(one, again)
    assert one.minima != other.minima


def test_minima_are_ranked_on_the_requested_grid(arm_scene: Scene) -> None:
    N = 2 * COARSE_INTERVALS + 10
    found = swing_up(arm_scene, starts=8, intervals=N, scheme="taylor-midpoint")
    motion = found.trajectory
    assert motion.grid.intervals == N
    assert {scheme.name for scheme in motion.grid.schemes} == {"taylor-midpoint"}
    assert found.status is Status.MINIMUM
    assert 2 <= len(found.minima) <= MAX_REFINED
    assert list(found.minima) == sorted(found.minima)
    assert found.minima[0] == found.cost
    assert found.problem is not None
    assert found.cost == pytest.approx(found.problem.ld.action(motion.path), rel=1e-13)
    again = solve_on_grid(found.problem, motion.path)
    assert again.cost == pytest.approx(found.cost, rel=1e-12)
    grid = Grid.uniform(3.0, COARSE_INTERVALS, by_name("galerkin-2"))
    coarse = solve_on_grid(found.problem.on(grid), motion)
    assert found.cost == pytest.approx(coarse.cost, rel=0.05)
    assert abs(found.cost - coarse.cost) > 1e-6  # the cost is not the coarse grid's


def test_progress_is_text_and_an_increasing_fraction(arm_scene: Scene) -> None:
    reports: list[tuple[str, float]] = []
    options = {"starts": 20, "intervals": 2 * COARSE_INTERVALS + 2}
    swing_up(arm_scene, progress=lambda text, share: reports.append((text, share)), **options)
    assert reports
    for text, share in reports:
        assert text
        assert "\n" not in text
        assert 0 <= share <= 1
    assert any("refining" in text for text, _ in reports)


# Budgets


def test_a_time_limit_ends_a_search_of_any_length(arm_scene: Scene) -> None:
    found = swing_up(arm_scene, starts=2000, time_limit=0.3, intervals=40)
    assert "The search ended after" in found.message
    assert "of 2000 starts" in found.message
    assert found.status in (Status.MINIMUM, Status.TIME_LIMIT)
    np.testing.assert_array_equal(found.trajectory.q[-1], -HANG)


def test_a_time_limit_leaves_time_for_the_requested_grid(arm_scene: Scene) -> None:
    N = 2 * COARSE_INTERVALS + 10
    found = swing_up(arm_scene, starts=2000, intervals=N, time_limit=2.0)
    assert found.trajectory.grid.intervals == N
    assert found.status in (Status.MINIMUM, Status.TIME_LIMIT)


def test_a_grid_that_takes_longer_than_the_limit_is_not_begun(arm_scene: Scene) -> None:
    found = swing_up(arm_scene, intervals=1_000_000, time_limit=1.0)
    assert (found.success, found.status) == (False, Status.TIME_LIMIT)
    assert "too little time" in found.message
    assert "1,000,000 intervals" in found.message
    assert found.trajectory.grid.intervals == COARSE_INTERVALS
    np.testing.assert_array_equal(found.trajectory.q[-1], -HANG)


def test_without_time_the_guess_is_returned_with_its_status(arm_scene: Scene) -> None:
    found = swing_up(arm_scene, time_limit=1e-9)
    assert (found.success, found.status) == (False, Status.TIME_LIMIT)
    assert "time limit was reached" in found.message
    assert found.minima == ()
    np.testing.assert_array_equal(found.trajectory.q[-1], -HANG)


def test_the_iteration_limit_is_of_one_solve(arm_scene: Scene) -> None:
    found = swing_up(arm_scene, max_iterations=2, continuation=False)
    assert (found.success, found.status) == (False, Status.ITERATION_LIMIT)
    assert found.nit == 2


def test_an_interrupt_gives_the_best_so_far(
    arm_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluations = InterruptedEvaluations(monkeypatch, 60)
    found = swing_up(arm_scene, starts=1000)
    assert evaluations.calls < 110
    assert "of 1000 starts" in found.message
    np.testing.assert_array_equal(found.trajectory.q[-1], -HANG)


def test_an_interrupt_before_the_requested_grid_is_no_success(arm_scene: Scene) -> None:
    def interrupt(text: str, share: float) -> None:
        raise KeyboardInterrupt

    N = 2 * COARSE_INTERVALS + 10
    found = swing_up(arm_scene, starts=1000, intervals=N, progress=interrupt)
    assert (found.success, found.status) == (False, Status.INTERRUPTED)
    assert "interrupted before the requested grid or the best duration was reached" in found.message


def test_after_an_interrupt_no_other_minimum_is_compared_with_a_finer_grid(
    arm_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    output, comparing, calls = EffortLagrangian.output, False, 0

    def progress(text: str, share: float) -> None:
        nonlocal comparing
        comparing = comparing or "comparing" in text

    def interrupted_once(self: EffortLagrangian, *jet: Any, **more: Any) -> Any:
        nonlocal calls
        calls += comparing
        if calls == 1:
            raise KeyboardInterrupt
        return output(self, *jet, **more)

    monkeypatch.setattr(EffortLagrangian, "output", interrupted_once)
    found = swing_up(arm_scene, starts=8, intervals=8, scheme="hermite-simpson", progress=progress)
    assert not found.success
    assert calls == 1


# Refusals


@pytest.mark.parametrize(
    ("options", "error", "sentence"),
    [
        ({"starts": 0}, InputError, "`starts` must be a whole number, 1 or more, but it is 0"),
        ({"starts": 2.5}, InputError, "`starts` must be a whole number, 1 or more, but it is 2.5"),
        (
            {"starts": np.nan},
            InputError,
            "`starts` must be a whole number, 1 or more, but it is nan",
        ),
        ({"max_iterations": 0}, InputError, "`max_iterations` must be a whole number, 1 or more"),
        ({"limits": "urfd"}, InputError, "limits are .*'urfd'"),
        ({"duration": 0.0}, InputError, "`duration` must be a positive number .* is 0"),
        ({"duration": -1.0}, InputError, "`duration` must be a positive .* is -1"),
        ({"duration": np.nan}, InputError, "`duration` must be a positive .* is nan"),
        ({"duration": np.inf}, InputError, "`duration` must be a positive .* is inf"),
        ({"goal": [np.nan, 0.0]}, InputError, "goal is nan at joint 'shoulder'"),
        ({"goal": [0.0]}, InputError, r"goal has shape \(1,\), expected \(2,\)"),
        ({"start": [0.0] * 3}, InputError, r"start has shape \(3,\), expected \(2,\)"),
        (
            {"start": State([0.0, 0.0], [np.inf, 0.0])},
            InputError,
            r"start\.v is inf at joint 'shou",
        ),
        ({"goal": State([0.0, 0.0], [0.0])}, InputError, r"goal\.v has shape \(1,\), expected"),
        (
            {"intervals": 0},
            InputError,
            "`intervals` must be a whole number from 1 to 1,000,000, but it is 0",
        ),
        ({"scheme": "galerkin"}, SchemeError, "no scheme 'galerkin': did you mean"),
        ({"scheme": "mean-difference"}, SchemeError, "'mean-difference' is not regular"),
        ({"guess": "cubik"}, InputError, "no guess 'cubik': did you mean 'cubic'"),
        ({"time_limit": 0.0}, InputError, "time_limit must be positive, in seconds, got 0"),
        ({"time_limit": -5}, InputError, "time_limit must be positive, in seconds, got -5"),
        ({"time_limit": np.nan}, InputError, "time_limit must be positive, in seconds, got nan"),
        ({"weight": [1.0]}, SceneError, "weight needs 2 numbers of 0 or more"),
        ({"seed": -1, "starts": 2}, InputError, "seed"),
        ({"seed": 1.5, "starts": 2}, InputError, "seed"),
    ],
)
def test_invalid_input_is_refused_in_one_sentence(
    arm_scene: Scene, options: dict[str, Any], error: type[HoviError], sentence: str
) -> None:
    problem: dict[str, Any] = {"start": HANG, "goal": GOAL, "duration": 1.0, "processes": 1}
    with pytest.raises(error, match=sentence) as raised:
        plan(arm_scene, **(problem | {"limits": "none"} | options))
    assert "\n" not in str(raised.value)


def test_a_whole_number_of_starts_may_be_a_float(arm_scene: Scene) -> None:
    assert swing_up(arm_scene, starts=2.0).success


def test_an_invalid_robot_is_refused_before_any_work() -> None:
    robot = load_robot(half_turning())
    with pytest.raises(ModelError, match=r"does not support planning.*'last' mimic"):
        plan(Scene(robot, [Gravity()]), robot.neutral(), robot.neutral(), 1.0, self_collision=False)


def test_distant_limits_do_not_limit_the_accuracy(two_link: Robot) -> None:
    scene = Scene(two_link, [Gravity(9.8)])
    ends = [-np.pi / 2, 0.0], [np.pi / 2, 0.0]
    near = plan(scene, *ends, 2.0, tolerance=1e-6)
    assert near.accuracy.reached, near.message
    assert near.error_estimate < 1e-6
    free = plan(scene, *ends, 2.0, tolerance=1e-6, limits="none")
    assert near.cost == pytest.approx(free.cost, rel=1e-6)
    assert near.problem.limits is not None


def test_invalid_scenes_and_via_points_are_refused(two_link: Robot) -> None:
    with pytest.raises(InputError, match=r"plan takes a hovi\.Scene"):
        plan(two_link, [0.0, 0.0], [1.0, 0.0], 1.0)
    with pytest.raises(InputError, match=r"via must be a list of hovi\.Via"):
        plan(Scene(two_link), [0.0, 0.0], [1.0, 0.0], 2.0, via=[(1.0, [1.0, 1.0])])
    for wrong in (Gravity(9.8), [Gravity], ["gravity"]):
        with pytest.raises(SceneError, match="effects is a list such as"):
            Scene(two_link, wrong)


def test_a_task_is_planned_with_all_its_options() -> None:
    task = load_task(example("ur5_around_sphere"))
    solution = plan_task(task.with_options(intervals=8), max_iterations=2, continuation=False)
    assert [each.name for each in solution.problem.clearance.obstacles] == ["ball"]
    assert solution.problem.clearance.margin == task.options.clearance.margin
