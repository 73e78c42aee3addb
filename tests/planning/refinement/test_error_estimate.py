"""Error estimates against far more accurate solutions, which are checked with SciPy."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from hovi import Solution, estimate_error, plan
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import MORE_MODES, Grid
from hovi.discrete.measures.motion_error import (
    MotionError,
    deviation,
    relative_difference,
)
from hovi.discrete.state import State
from hovi.effects import Gravity
from hovi.errors import InputError
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.task_file.reading import load_task
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.scene import Scene
from hovi.schemes import by_name, galerkin
from hovi.system.deadline import Deadline
from oracles.on_grid import solve_on_grid
from samples.manifold_robots import BASES, with_arm
from samples.paper_arm import HANG, REACH_Q, REACH_V, REST, extremal

UR5_START = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1]
UR5_GOAL = [1.2, -0.6, 0.4, 0.7, -0.8, 1.0]
SCHEMES = [
    ("galerkin-0", 16),
    ("galerkin-1", 8),
    ("galerkin-2", 8),
    ("galerkin-2", 24),
    ("galerkin-3", 12),
    ("galerkin-4", 6),
    ("hermite-simpson", 16),
    ("taylor-midpoint", 32),
    ("taylor-trapezoid", 32),
]


def ur5_problem(scene: Scene, grid: Grid) -> TrajectoryProblem:
    ld = DiscreteLagrangian(scene.effort_lagrangian(), grid)
    return TrajectoryProblem(ld, State(UR5_START), State(UR5_GOAL))


def reach_problem(scene: Scene, grid: Grid) -> TrajectoryProblem:
    ld = DiscreteLagrangian(scene.effort_lagrangian(), grid)
    return TrajectoryProblem(ld, State(HANG), State(REACH_Q, REACH_V))


@pytest.fixture(scope="module")
def reach_reference(arm_scene: Scene) -> Solution:
    return solve_on_grid(reach_problem(arm_scene, Grid.uniform(1.0, 24, galerkin(6))))


@pytest.fixture(scope="module")
def ur5_scene() -> Scene:
    return Scene(load_robot("ur5"), effects=[Gravity()])


@pytest.fixture(scope="module")
def ur5_reference(ur5_scene: Scene) -> Solution:
    return solve_on_grid(ur5_problem(ur5_scene, Grid.uniform(1.5, 32, galerkin(6))))


def true_error(solution: Solution, reference: Solution) -> MotionError:
    costs = solution.cost, reference.cost
    return deviation(solution.trajectory, reference.trajectory, costs)


def assert_close(estimate: MotionError, true: MotionError, factor: float) -> None:
    assert estimate.cost / factor <= true.cost <= factor * estimate.cost
    for name in ("angle", "largest_v", "largest_tau", "largest_tip"):
        one, other = getattr(estimate, name), getattr(true, name)
        assert one / factor <= other <= factor * one, name


# The reference


def test_the_reference_solves_pontryagins_equations(
    arm_scene: Scene, reach_reference: Solution
) -> None:
    coarse = solve_on_grid(reach_problem(arm_scene, Grid.uniform(1.0, 16, galerkin(1)))).trajectory
    nodes = np.concatenate([coarse.q, coarse.v, coarse.momenta[:, 0], coarse.momenta[:, 1]], 1)
    ends = HANG, REST, REACH_Q, REACH_V
    exact = extremal(ends, 1.0, (coarse.t, nodes.T), 1e-9)
    t = np.linspace(0.0, 1.0, 51)
    motion, (q, v, _, _) = reach_reference.trajectory.sample(t), exact.at(t)
    assert reach_reference.cost == pytest.approx(exact.cost, rel=1e-9)
    np.testing.assert_allclose(motion.q, q, atol=1e-8)
    np.testing.assert_allclose(motion.v, v, atol=1e-7)


# The estimate


@pytest.mark.parametrize(("scheme", "intervals"), SCHEMES)
def test_the_estimate_is_the_error_within_a_factor_of_two(
    arm_scene: Scene, reach_reference: Solution, scheme: str, intervals: int
) -> None:
    grid = Grid.uniform(1.0, intervals, by_name(scheme))
    solution = solve_on_grid(reach_problem(arm_scene, grid), reach_reference.trajectory)
    estimate = estimate_error(solution)
    assert estimate is not None
    assert_close(estimate, true_error(solution, reach_reference), 2.0)


@pytest.mark.parametrize(("inner_modes", "intervals"), [(1, 16), (2, 12), (2, 24), (4, 12)])
def test_the_estimate_is_the_error_of_six_joints(
    ur5_scene: Scene, ur5_reference: Solution, inner_modes: int, intervals: int
) -> None:
    grid = Grid.uniform(1.5, intervals, galerkin(inner_modes))
    solution = solve_on_grid(ur5_problem(ur5_scene, grid), ur5_reference.trajectory)
    estimate = estimate_error(solution)
    assert estimate is not None
    assert_close(estimate, true_error(solution, ur5_reference), 2.0)


def test_one_more_mode_would_not_suffice(ur5_scene: Scene, ur5_reference: Solution) -> None:
    # with one and with two inner modes the costs have the same error, so the difference is useless
    costs = [
        solve_on_grid(
            ur5_problem(ur5_scene, Grid.uniform(1.5, 16, galerkin(r))), ur5_reference.trajectory
        ).cost
        for r in (1, 2)
    ]
    error = relative_difference(costs[0], ur5_reference.cost)
    assert relative_difference(*costs) < 0.05 * error


def test_unequal_intervals_of_unequal_degree_are_estimated_too(
    arm_scene: Scene, reach_reference: Solution
) -> None:
    steps = np.array([0.05, 0.1, 0.15, 0.2, 0.1, 0.15, 0.1, 0.05, 0.1])
    degrees = [1, 2, 3, 2, 4, 1, 2, 3, 2]
    grid = Grid(steps, tuple(galerkin(r) for r in degrees))
    solution = solve_on_grid(reach_problem(arm_scene, grid), reach_reference.trajectory)
    estimate = estimate_error(solution)
    assert estimate is not None
    assert_close(estimate, true_error(solution, reach_reference), 2.0)
    assert solution.problem is not None
    finer = solution.problem.finer.grid.schemes
    assert [scheme.inner_modes for scheme in finer] == [r + MORE_MODES for r in degrees]


def test_the_estimate_is_the_difference_to_the_solution_with_two_more_modes(
    arm_scene: Scene, reach_reference: Solution
) -> None:
    grid = Grid.uniform(1.0, 12, galerkin(2))
    solution = solve_on_grid(reach_problem(arm_scene, grid), reach_reference.trajectory)
    assert solution.problem is not None
    finer = solve_on_grid(solution.problem.finer, solution.trajectory)
    estimate = estimate_error(solution)
    assert estimate is not None
    assert estimate.cost == pytest.approx(abs(solution.cost / finer.cost - 1), rel=1e-3)
    assert estimate.cost == pytest.approx(abs(solution.cost / reach_reference.cost - 1), rel=0.05)


@pytest.mark.parametrize("weight", [1e-6, 1e6])
def test_a_refinement_within_limits_does_not_depend_on_the_unit_of_the_cost(
    arm_scene: Scene, weight: float
) -> None:
    """The same intervals are refined, and the errors are as large."""
    given = {"limits": {"base": "none", "v": 4.0}, "intervals": 8, "tolerance": 1e-4}
    one, other = (
        plan(arm_scene, HANG, REACH_Q, 1.0, weight=[R, R], **given) for R in (1.0, weight)
    )
    assert one.success, one.message
    assert other.success, other.message
    assert one.accuracy is not None
    assert other.accuracy is not None
    assert len(one.accuracy.rounds) > 1
    for mine, yours in zip(one.accuracy.rounds, other.accuracy.rounds, strict=True):
        assert (mine.intervals, mine.points) == (yours.intervals, yours.points)
        assert mine.error == pytest.approx(yours.error, rel=0.05)
    assert other.cost == pytest.approx(weight * one.cost, rel=1e-5)


def test_an_exact_cubic_has_no_error(arm_scene: Scene) -> None:
    # at rest without gravity no torque is needed
    scene = Scene(arm_scene.robot)
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, 8, galerkin(0)))
    still = solve_on_grid(TrajectoryProblem(ld, State(HANG), State(HANG)))
    estimate = estimate_error(still)
    assert estimate is not None
    assert (estimate.cost, estimate.angle, estimate.largest_tau) == (0.0, 0.0, 0.0)


# Measured quantities


def test_errors_of_revolute_and_sliding_joints_are_separate() -> None:
    def joint(number: int, kind: str) -> str:
        mass = '<mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
        return (
            f'<link name="l{number}"><inertial>{mass}</inertial></link>'
            f'<joint name="j{number}" type="{kind}"><parent link="l{number - 1}"/>'
            f'<child link="l{number}"/><axis xyz="0 0 1"/>'
            '<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>'
        )

    robot = cart(joint(1, "prismatic") + joint(2, "revolute"))
    np.testing.assert_array_equal(robot.sliding, [True, False])


def test_errors_of_floating_bases_separate_lengths_and_angles() -> None:
    slides = {base: load_robot(with_arm(base)).sliding for base in BASES}
    assert slides["free-flyer"].tolist() == [True] * 3 + [False] * 5 + [True]
    assert slides["planar"].tolist() == [True] * 2 + [False] * 3 + [True]
    assert slides["spherical"].tolist() == [False] * 5 + [True]


def cart(body: str) -> Robot:
    import pinocchio as pin

    text = f'<robot name="cart"><link name="l0"/>{body}</robot>'
    return load_robot(pin.buildModelFromXML(text))


def test_the_distance_of_a_motion_from_itself_is_zero(reach_reference: Solution) -> None:
    none = true_error(reach_reference, reach_reference)
    assert none.cost == none.angle == none.slide == none.largest_tip == none.largest_tau == 0.0


@pytest.mark.parametrize("scheme", ["galerkin-2", "galerkin-1x5", "galerkin-2x8"])
def test_the_error_of_an_underactuated_motion_is_estimated(two_link: Robot, scheme: str) -> None:
    """The finer motion has its own moments of the passive torque."""
    acrobot = Scene(two_link, effects=[Gravity(9.8)], passive=["shoulder"])
    goal = State(np.add(HANG, [0.6, -1.0]))

    def on(intervals: int, name: str) -> TrajectoryProblem:
        grid = Grid.uniform(1.5, intervals, by_name(name))
        ld = DiscreteLagrangian(acrobot.effort_lagrangian(), grid)
        return TrajectoryProblem(ld, State(HANG), goal)

    fine = solve_on_grid(on(64, "galerkin-3"))
    coarse = solve_on_grid(on(16, scheme), fine.trajectory)
    found = estimate_error(coarse)
    assert found is not None
    true = true_error(coarse, fine)
    assert found.cost == pytest.approx(true.cost, rel=0.1)
    assert found.angle == pytest.approx(true.angle, rel=0.2)
    assert 1e-9 < true.cost < 1e-3


def test_an_unknown_frame_and_another_duration_are_refused(
    arm_scene: Scene, reach_reference: Solution
) -> None:
    with pytest.raises(InputError, match="has no frame 'tol0'"):
        estimate_error(reach_reference, frame="tol0")
    longer = solve_on_grid(reach_problem(arm_scene, Grid.uniform(2.0, 8, galerkin(2))))
    with pytest.raises(InputError, match="same duration can be compared, not 2 s with 1 s"):
        true_error(longer, reach_reference)


def test_an_estimate_within_limits_holds_its_time_limit(arm_scene: Scene) -> None:
    lower = np.full((4, 2), -np.inf)
    lower[1] = -3.0
    problem = reach_problem(arm_scene, Grid.uniform(1.0, 12, galerkin(2)))
    limited = solve_on_grid(dataclasses.replace(problem, limits=Limits(lower, -lower)))
    assert limited.success
    assert estimate_error(limited) is not None
    with Deadline(-1.0).in_force():
        assert estimate_error(limited) is None


def test_only_minima_have_an_estimate(reach_reference: Solution) -> None:
    stopped = dataclasses.replace(reach_reference, success=False)
    with pytest.raises(InputError, match="only errors of minima can be estimated"):
        estimate_error(stopped)
    unknown = dataclasses.replace(reach_reference, problem=None)
    with pytest.raises(InputError, match="has no problem"):
        estimate_error(unknown)


def test_schemes_with_no_room_for_more_modes_are_refused() -> None:
    with pytest.raises(InputError, match="up to 38 inner modes, not 40; use more intervals"):
        Grid.uniform(1.0, 2, galerkin(40)).enriched(2)


@pytest.mark.parametrize("name", ["ur5_reach", "panda_reach"])
def test_an_estimate_takes_fewer_hessians_than_a_solve(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A minimum is near, so that a few of them lead to it; at last one proves that it is one."""
    task = load_task(example(name))
    grid = Grid.uniform(task.duration, 10, galerkin(4))
    ld = DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    assert isinstance(task.goal, State)
    solution = solve_on_grid(TrajectoryProblem(ld, task.start, task.goal))
    assert solution.problem is not None
    expand, hessians = EffortLagrangian.expand, 0

    def counted(self: EffortLagrangian, *jet: Any, **more: Any) -> Any:
        nonlocal hessians
        hessians += 1
        return expand(self, *jet, **more)

    monkeypatch.setattr(EffortLagrangian, "expand", counted)
    estimate = estimate_error(solution)
    taken, hessians = hessians, 0
    exact = solve_on_grid(solution.problem.finer, solution.trajectory)
    assert 0 < taken <= 4
    assert taken <= hessians
    assert estimate is not None
    assert estimate.cost == pytest.approx(abs(solution.cost / exact.cost - 1), rel=0.02)
    assert exact.n_neg == 0
