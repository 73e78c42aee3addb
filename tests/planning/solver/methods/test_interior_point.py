"""Motions with hard limits, against Ipopt and dense sampling, and infeasible problems."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi import Solution, Status, plan, solve
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.robot import Robot
from hovi.schemes import galerkin
from oracles.ipopt_oracle import least_action

HELD = pytest.mark.filterwarnings("ignore:holding the robot still")
UR5 = {"v": 3.14, "tau": [150.0, 150.0, 150.0, 28.0, 28.0, 28.0]}
PANDA = {"v": [2.175] * 4 + [2.61] * 3, "tau": [87.0] * 4 + [12.0] * 3}


def reach(models: Path, name: str, limits: dict[str, object]) -> TrajectoryProblem:
    """A shipped reach on 16 intervals with two inner modes, under limits."""
    task = hovi.load_task(models / f"{name}.toml")
    grid = Grid.uniform(task.duration, 16, galerkin(2))
    ld = DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    return TrajectoryProblem(ld, task.start, task.goal, as_limits(task.scene.robot, limits))


def largest_excess(trajectory: Trajectory, limits: Limits, samples: int = 10_000) -> float:
    """Largest excess over a limit, as a share of its range, both sides of each node included."""
    N = trajectory.grid.intervals
    s = np.linspace(0.0, 1.0, max(samples // N, 2))
    k = np.repeat(np.arange(N), len(s))
    outputs = np.stack(trajectory.sample_intervals(k, np.tile(s, N)), axis=1)
    return float(limits.excess(outputs).max())


@pytest.mark.parametrize(
    ("name", "limits", "known", "most_more", "most_steps"),
    [("ur5_reach", UR5, 694.1903, 3e-3, 42), ("panda_reach", PANDA, 343.1333, 0.015, 72)],
)
def test_the_least_cost_is_little_more_than_that_of_ipopt_at_the_points(
    models: Path,
    name: str,
    limits: dict[str, object],
    known: float,
    most_more: float,
    most_steps: int,
) -> None:
    problem = reach(models, name, limits)
    assert problem.limits is not None
    found = solve(problem)
    assert found.success, found.message
    assert found.nit <= most_steps
    assert found.problem is not None
    cost, _ = least_action(found.problem, found.trajectory.path, move=0.0)
    assert cost <= known * (1 + 1e-7)
    assert cost * (1 - 1e-7) <= found.cost <= cost * (1 + most_more)


@pytest.mark.parametrize(
    ("name", "limits", "most_steps"),
    [
        ("two_link_reach", {"tau": [12.0, 4.0]}, 17),
        ("two_link_reach", {"v": [3.0, 6.0], "tau": [14.0, 5.0]}, 27),
        ("ur5_reach", UR5, 32),
        ("panda_reach", PANDA, 58),
    ],
)
def test_a_limited_reach_takes_few_steps(
    models: Path, name: str, limits: dict[str, object], most_steps: int
) -> None:
    found = solve(reach(models, name, {"base": "none"} | limits))
    assert found.success, found.message
    assert found.nit <= most_steps


@pytest.mark.parametrize(
    "name",
    [
        "ur5_reach_limited",
        "two_link_elbow_limited",
        pytest.param("panda_reach_limited", marks=pytest.mark.long),
    ],
)
def test_limits_hold_at_ten_thousand_samples(models: Path, name: str) -> None:
    task = hovi.load_task(models / f"{name}.toml")
    solution = plan(
        task.scene,
        task.start,
        task.goal,
        task.duration,
        scheme=task.options.scheme,
        intervals=task.options.intervals,
        limits=task.options.limits,
        self_collision=False,
    )
    assert solution.status is Status.MINIMUM, solution.message
    assert solution.n_neg == 0
    limits = as_limits(task.scene.robot, task.options.limits)
    assert largest_excess(solution.trajectory, limits) <= limits.tolerance


def test_inactive_limits_change_nothing(models: Path) -> None:
    free = solve(reach(models, "two_link_reach", {"base": "none"}))
    wide = solve(reach(models, "two_link_reach", {"base": "none", "q": 12.0, "tau": 1e4}))
    assert wide.cost == pytest.approx(free.cost, rel=1e-9)
    np.testing.assert_allclose(wide.trajectory.q, free.trajectory.q, atol=1e-6)


def test_active_limits_raise_the_cost_and_are_reached(models: Path) -> None:
    free = solve(reach(models, "two_link_reach", {"base": "none"}))
    limits = {"base": "none", "v": [3.0, 6.0]}
    bound = solve(reach(models, "two_link_reach", limits))
    assert bound.success
    assert bound.cost > 1.1 * free.cost
    assert np.abs(bound.trajectory.v).max(axis=0) == pytest.approx([3.0, 6.0], rel=2e-2)


def test_a_hard_range_is_the_limit_of_a_narrower_potential(models: Path) -> None:
    """The paper's potential, ten times as steep, costs less the narrower its bend is."""
    task = hovi.load_task(models / "two_link_elbow.toml")
    grid = Grid.uniform(task.duration, 100, hovi.schemes.by_name("galerkin-2x8"))
    robot, ends = task.scene.robot, (task.start, task.goal)
    elbow = (0.0, np.radians(170.0))
    hard = as_limits(robot, {"base": "none", "q": {"elbow": elbow}})
    gravity = hovi.effects.Gravity(9.8)

    def planned(effects: list[object], limits: Limits | None, guess: Trajectory | str) -> Solution:
        scene = hovi.Scene(robot, effects)
        ld = DiscreteLagrangian(scene.effort_lagrangian(), grid)
        solution = solve(TrajectoryProblem(ld, *ends, limits), guess)
        assert solution.success, solution.message
        return solution

    within = planned([gravity], hard, "cubic")
    wide, narrow = (
        planned(
            [gravity, hovi.effects.JointLimitPotential({"elbow": elbow}, 1e4, width)],
            None,
            within.trajectory,
        )
        for width in (5e-4, 1e-4)
    )
    assert within.cost < narrow.cost < wide.cost
    assert narrow.cost == pytest.approx(within.cost, rel=1e-3)


@pytest.mark.parametrize(
    ("start", "goal", "duration", "limits", "words"),
    [
        ([0.0, 3.0], [0.0, 0.0], 2.0, {"q": {"elbow": [0.0, 2.0]}}, ("start", "elbow", "3 rad")),
        ([0.0, 0.0], [0.0, 3.0], 2.0, {"q": {"elbow": [0.0, 2.0]}}, ("goal", "elbow", "3 rad")),
        ([0.0, 0.0], [2.0, 0.0], 0.5, {"v": 3.0}, ("shoulder", "3 rad/s", "0.5 s")),
        (
            [0.0, 0.0],
            [0.0, 0.0],
            2.0,
            {"tau": 2.0, "q": [[-0.05, 0.05], [-0.05, 0.05]]},
            ("torque", "shoulder", "7.656 N m"),
        ),
    ],
)
@HELD
def test_infeasible_problems_are_reported_with_the_right_reason(
    arm_scene: hovi.Scene,
    start: list[float],
    goal: list[float],
    duration: float,
    limits: dict[str, object],
    words: tuple[str, ...],
) -> None:
    """Held horizontal within 0.05 rad the arm needs 7.656 N m at the shoulder."""
    solution = plan(arm_scene, start, goal, duration, limits={"base": "none", **limits})
    assert solution.status is Status.INFEASIBLE
    assert not solution.success
    for word in words:
        assert word in solution.message


@HELD
@pytest.mark.parametrize("intervals", [16, 24, 32, 48])
def test_a_motion_with_a_weak_motor_is_found_on_every_grid(
    arm_scene: hovi.Scene, intervals: int
) -> None:
    """With 2 N m the arm cannot hold the pose, but falls, swings and comes back."""
    limits = {"base": "none", "tau": 2.0}
    solution = plan(arm_scene, [0.0, 0.0], [0.0, 0.0], 5.0, intervals=intervals, limits=limits)
    assert solution.success, solution.message
    assert largest_excess(solution.trajectory, as_limits(arm_scene.robot, limits)) <= 1e-6


def test_time_and_iteration_limits_have_their_own_statuses(models: Path) -> None:
    problem = reach(models, "ur5_reach", UR5)
    assert solve(problem, max_iterations=3).status is Status.ITERATION_LIMIT
    assert solve(problem, time_limit=1e-4).status is Status.TIME_LIMIT


def test_light_wrists_hold_their_velocity_limits_at_the_ends() -> None:
    """The last joint of a Z1 has so little inertia that it could start and stop in milliseconds."""
    robot = hovi.load_robot("z1", locked=["jointGripper"])
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    start = State([1.0, 1.5, -1.5, 0.5, -0.5, 2.0])
    solution = plan(scene, start, [-1.0, 0.5, -0.5, -0.5, 0.5, -2.0], 3.0, self_collision=False)
    assert solution.success, solution.message
    assert largest_excess(solution.trajectory, as_limits(robot, "urdf")) <= 1e-6


@pytest.mark.parametrize("intervals", [16, 32])
def test_a_guess_that_fails_on_the_halved_grid_is_restored_there_too(intervals: int) -> None:
    """Held still along the straight path, the arm needs 1.22 times the shoulder's torque limit."""
    robot = hovi.load_robot("talos_arm", locked=["gripper_left_joint"])
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    start = [0.499, 0.422, -0.098, 1.096, 1.342, 0.104]
    goal = [2.832, 1.647, -0.522, 1.966, 0.367, -0.201]
    options = {"intervals": intervals, "continuation": False}
    solution = plan(scene, start, goal, 1.9125, **options, self_collision=False)
    assert solution.success, solution.message
    assert largest_excess(solution.trajectory, as_limits(robot, "urdf")) <= 1e-6


@pytest.mark.long
def test_a_light_wrist_at_the_iteration_limit_is_refined_to_a_minimum() -> None:
    """The last joint has almost no inertia and can spin between the points of coarse intervals."""
    robot = hovi.load_robot("xarm7")
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    start = [-2.028, -0.447, -2.746, 2.798, -2.59, 0.217, 2.347]
    goal = [-0.174, 1.731, 1.671, 3.578, -2.341, -1.337, -2.7]
    solution = plan(scene, start, goal, 4.822, continuation=False, self_collision=False)
    assert solution.success, solution.message
    assert largest_excess(solution.trajectory, as_limits(robot, "urdf")) <= 1e-6


def test_a_barrier_that_fell_too_early_rises_again(ur5: Robot) -> None:
    """Within small gaps the way out of negative curvature takes four times as many steps."""
    scene = hovi.Scene(ur5, [hovi.effects.Gravity()])
    start = State([-1.469, 0.245, -0.36, 2.708, -2.887, 1.458])
    goal = State([0.719, -2.963, 1.377, -3.041, 1.621, 0.08])
    ld = DiscreteLagrangian(
        scene.effort_lagrangian(), Grid.uniform(3.53, 16, galerkin(4, points=10))
    )
    problem = TrajectoryProblem(ld, start, goal, as_limits(ur5, {"base": "urdf"}))
    found = solve(problem)
    assert found.status is Status.MINIMUM
    assert found.cost == pytest.approx(744.6, rel=1e-3)
    assert found.nit < 200
