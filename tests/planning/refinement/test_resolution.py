"""Success means a minimum along the whole motion: judged by pin.rnea and finer grids."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi import Solution, Status
from hovi.discrete.curve_integral import integral_along
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.errors import HoviWarning
from hovi.planning.problem.limits import as_limits
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import by_name
from oracles.on_grid import solve_on_grid
from samples.paper_arm import HANG, REACH_Q
from samples.stopped_searches import LeapingClock

RESOLVED = 0.01
"""Relative error of the cost above which a motion is no minimum."""
NEARBY, FARTHER, GROWTH = 0.05, 0.5, 2.0
"""Changes of q and T v up to which an estimate is kept, and up to which it grows by a factor."""
FAST: dict[str, Any] = {"limits": "none", "processes": 1}
PANDA_START = [0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.7]
PANDA_GOAL = [0.9, 0.3, -0.4, -1.2, 0.5, 2.2, -0.3]


@pytest.fixture(scope="module")
def panda() -> Scene:
    fingers = ["panda_finger_joint1", "panda_finger_joint2"]
    robot = hovi.load_robot("panda", locked=fingers)
    return Scene(robot, [hovi.effects.Gravity()])


def ur5() -> Scene:
    return Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


def integral(scene: Scene, trajectory: hovi.Trajectory) -> float:
    """1/2 integral |tau|^2 along the interpolant, by pin.rnea and 24 Gauss points per interval."""
    model = scene.robot.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    model.armature = np.zeros(model.nv)
    data = model.createData()
    x, w = np.polynomial.legendre.leggauss(24)
    h = np.diff(trajectory.t)[:, None]
    motion = trajectory.sample((trajectory.t[:-1, None] + h * (x + 1) / 2).ravel())
    tau = [pin.rnea(model, data, *row) for row in zip(*motion[:3], strict=True)]
    return float(np.sum((h * w / 2).ravel() * 0.5 * np.sum(np.square(tau), axis=1)))


def reach(scene: Scene, **options: Any) -> Solution:
    return hovi.plan(scene, PANDA_START, PANDA_GOAL, 1.5, **FAST, **options, self_collision=False)


def test_torque_that_hides_between_the_points_is_no_success(panda: Scene) -> None:
    found = reach(panda, scheme="galerkin-2", intervals=16)
    assert (found.success, found.status, found.n_neg) == (False, Status.UNRESOLVED, 0)
    hidden = integral(panda, found.trajectory)
    assert hidden > 1.5 * found.cost
    assert f"{found.cost:.6g}" in found.message
    assert f"{hidden:.5g}" in found.message
    assert found.minima == ()
    assert found.trajectory.metadata["status"] == "unresolved"


def test_solve_and_plan_agree_on_resolution(panda: Scene) -> None:
    def solved(N: int) -> Solution:
        grid = Grid.uniform(1.5, N, by_name("galerkin-2"))
        ld = hovi.DiscreteLagrangian(panda.effort_lagrangian(), grid)
        ends = hovi.State(PANDA_START), hovi.State(PANDA_GOAL)
        return hovi.solve(hovi.TrajectoryProblem(ld, *ends))

    assert solved(16).status is Status.UNRESOLVED
    carried = solved(80)
    assert carried.status is Status.MINIMUM
    assert integral(panda, carried.trajectory) == pytest.approx(carried.cost, rel=RESOLVED)


def test_a_default_plan_is_accurate_to_1e_3_in_cost_and_along_the_curve(
    panda: Scene, arm_scene: Scene
) -> None:
    hang, up = [-np.pi / 2, 0.0], [0.3, 0.7]
    ends = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1], [1.2, -0.6, 0.4, 0.7, -0.8, 1.0]
    cases = (
        (panda, PANDA_START, PANDA_GOAL, 1.5),
        (arm_scene, hang, up, 1.0),
        (ur5(), *ends, 1.5),
    )
    for scene, start, goal, T in cases:
        found = hovi.plan(scene, start, goal, T, **FAST, self_collision=False)
        assert found.success, found.message
        assert found.accuracy is not None
        assert found.accuracy.reached
        assert found.problem is not None
        fine = found.problem.on(Grid.uniform(T, 128, by_name("galerkin-4x10")))
        best = solve_on_grid(fine, found.trajectory)
        assert best.status is Status.MINIMUM
        lagrangian = found.problem.ld.lagrangian
        along = integral_along(lagrangian, found.trajectory).value
        assert found.cost == pytest.approx(best.cost, rel=1e-3)
        assert along == pytest.approx(best.cost, rel=1e-3)


@pytest.mark.parametrize("scheme", ["taylor-midpoint", "hermite-simpson", "galerkin-0"])
def test_a_cost_more_than_1_percent_off_is_no_success(arm_scene: Scene, scheme: str) -> None:
    """Each scheme on ever finer grids: unresolved while its cost is off, with honest estimates."""
    ends = [-np.pi / 2, 0.0], [np.pi / 2, 0.0], 2.0
    outcomes = []
    for N in (8, 12, 16, 24, 32, 64, 128):
        found = hovi.plan(arm_scene, *ends, scheme=scheme, intervals=N, **FAST)
        assert found.problem is not None
        fine = found.problem.on(Grid.uniform(2.0, 64, by_name("galerkin-4")))
        best = solve_on_grid(fine, found.trajectory)
        off = abs(found.cost / best.cost - 1)
        if found.success:
            assert found.error_estimate is not None
            assert off <= 1.2 * RESOLVED
            assert found.error_estimate / 3 <= off <= 3 * found.error_estimate
        outcomes.append(found.status)
    assert outcomes[0] is Status.UNRESOLVED
    assert outcomes[-1] is Status.MINIMUM
    assert set(outcomes) == {Status.UNRESOLVED, Status.MINIMUM}


@pytest.mark.parametrize("N", [7, 8, 9, 10, 11])
def test_the_change_of_the_cost_on_a_finer_grid_is_told_in_per_cent(
    arm_scene: Scene, N: int
) -> None:
    ends = [-np.pi / 2, 0.0], [np.pi / 2, 0.0], 2.0
    found = hovi.plan(arm_scene, *ends, scheme="taylor-midpoint", intervals=N, **FAST)
    assert found.problem is not None
    finer = solve_on_grid(found.problem.finer, found.trajectory)
    change = abs(finer.cost / found.cost - 1)
    assert f"a finer grid changes its cost by {100 * change:.2g} %" in found.message


def test_a_resolved_minimum_is_preferred_to_a_cheaper_unresolved_motion(arm_scene: Scene) -> None:
    found = hovi.plan(
        arm_scene, [-np.pi / 2, 0.0], [np.pi / 2, 0.0], 5.0, intervals=20, starts=16, **FAST
    )
    assert found.success
    assert "cheaper motion" in found.message
    assert found.cost == min(found.minima)


def test_replanning_near_a_resolved_motion_keeps_its_estimate(arm_scene: Scene) -> None:
    first = hovi.plan(arm_scene, [-np.pi / 2, 0.0], [0.3, 0.7], 1.0, intervals=16, **FAST)
    near = first.replan(goal=[0.3 + 0.2 * NEARBY, 0.7])
    far = first.replan(goal=[0.9, 0.2])
    assert near.success
    assert near.error_estimate == first.error_estimate
    assert anew(near) == pytest.approx(near.error_estimate, rel=0.5)
    assert far.success
    assert far.error_estimate != first.error_estimate
    true = solve_on_grid(far.problem.finer.finer, far.trajectory)  # type: ignore[union-attr]
    assert far.error_estimate == pytest.approx(abs(far.cost / true.cost - 1), rel=0.1)


def anew(solution: Solution) -> float:
    """The error estimate of the same motion by a comparison of its own."""
    assert solution.problem is not None
    found = hovi.solve(solution.problem, solution.trajectory)
    assert found.success, found.message
    assert found.cost == pytest.approx(solution.cost, rel=1e-5)
    assert found.error_estimate is not None
    return found.error_estimate


FREE_END = [1.2, 0.8]


def free_reach(two_link: Robot) -> Solution:
    """A reach to FREE_END without limits."""
    scene = Scene(two_link, [hovi.effects.Gravity()])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, 8, by_name("galerkin-2")))
    ends = hovi.State([0.0, 0.0]), hovi.State(FREE_END)
    return hovi.solve(hovi.TrajectoryProblem(ld, *ends))


@pytest.mark.parametrize(("far", "kept"), [(0.6, True), (1.6, False)])
def test_the_estimate_of_a_motion_without_limits_is_kept_with_a_margin_farther_away(
    two_link: Robot, far: float, kept: bool
) -> None:
    """far: the change of q, and of T v, relative to FARTHER."""
    first, end = free_reach(two_link), np.array(FREE_END)
    change = first.replan(goal=end + 0.01).trajectory.v - first.trajectory.v
    moved = first.replan(goal=end + 0.01 * far * FARTHER / np.abs(change).max())
    assert moved.success, moved.message
    assert first.error_estimate is not None
    assert moved.error_estimate is not None
    assert (moved.error_estimate == GROWTH * first.error_estimate) == kept
    assert anew(moved) <= moved.error_estimate * (1 + 1e-6)


@pytest.mark.parametrize("N", range(20, 60, 4))
def test_no_estimate_that_is_kept_is_too_large_for_a_success(two_link: Robot, N: int) -> None:
    """Twice more than half of one per cent is too large: such a motion is compared again."""
    scene = Scene(two_link, [hovi.effects.Gravity()])
    grid = Grid.uniform(1.0, N, by_name("taylor-midpoint"))
    ld = DiscreteLagrangian(scene.effort_lagrangian(), grid)
    first = hovi.solve(hovi.TrajectoryProblem(ld, hovi.State([0.0, 0.0]), hovi.State(FREE_END)))
    assert first.error_estimate is not None
    moved = first.replan(goal=[1.22, 0.82])
    if first.success:
        assert moved.success, moved.message
        doubled = moved.error_estimate == GROWTH * first.error_estimate
        assert doubled == (GROWTH * first.error_estimate <= RESOLVED)
    else:
        assert first.error_estimate > RESOLVED


def test_within_limits_estimates_of_a_chain_of_motions_are_those_of_new_comparisons(
    two_link: Robot,
) -> None:
    motion = fast_reach(two_link, {"v": 1.6, "tau": 60.0}, [1.2, 0.8])
    for goal in ([1.26, 0.76], [1.2, 0.8], [1.1, 0.85]):
        motion = motion.replan(goal=goal)
        assert motion.success, motion.message
        assert motion.error_estimate is not None
        assert anew(motion) <= 1.2 * motion.error_estimate + 3e-5
        assert motion.error_estimate <= 5.0 * anew(motion) + 3e-4


def fast_reach(two_link: Robot, limits: dict[str, Any], goal: list[float]) -> Solution:
    """A reach within limits, with an error estimate."""
    scene = Scene(two_link, [hovi.effects.Gravity()])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, 24, by_name("galerkin-2")))
    bounds = as_limits(two_link, {"base": "none", **limits})
    ends = hovi.State([0.0, 0.0]), hovi.State(goal)
    found = hovi.solve(hovi.TrajectoryProblem(ld, *ends, bounds))
    assert found.success, found.message
    return found


def test_an_estimate_is_kept_with_a_margin_while_the_same_limits_hold(two_link: Robot) -> None:
    first = fast_reach(two_link, {"v": 1.6, "tau": 60.0}, [1.2, 0.8])
    moved = first.replan(goal=[1.21, 0.8])
    assert moved.success, moved.message
    assert first.error_estimate is not None
    assert moved.error_estimate is not None
    assert moved.error_estimate > 2.0 * first.error_estimate
    assert anew(moved) <= moved.error_estimate


@pytest.mark.parametrize("goal", [1.21, 1.23])
def test_near_a_limit_that_begins_to_hold_no_estimate_is_too_small(
    two_link: Robot, goal: float
) -> None:
    """Its error is some ten times that of the motion before, and more from there on."""
    free = fast_reach(two_link, {"v": 10.0}, [1.2, 0.8])
    fastest = float(np.abs(free.trajectory.sample(np.linspace(0.0, 1.0, 1000)).v).max())
    first = fast_reach(two_link, {"v": 1.001 * fastest}, [1.2, 0.8])
    moved = first.replan(goal=[goal, 0.8])
    assert moved.success, moved.message
    assert first.error_estimate is not None
    assert moved.error_estimate is not None
    assert anew(moved) > 5.0 * first.error_estimate
    assert anew(moved) <= 1.2 * moved.error_estimate


def test_no_estimate_is_kept_from_a_motion_at_rest(two_link: Robot) -> None:
    """All motions near rest are small, and most of them are not resolved by this grid."""
    scene = Scene(two_link, [hovi.effects.JointSprings(1e3)])
    grid, rest = Grid.uniform(2.0, 4, by_name("galerkin-2x8")), hovi.State([0.0, 0.0])
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    still = hovi.solve(hovi.TrajectoryProblem(ld, rest, rest))
    assert still.success
    moved = still.replan(goal=[1e-4, -1e-4])
    assert moved.problem is not None
    alone = hovi.solve(moved.problem)
    assert (moved.status, alone.status) == (Status.UNRESOLVED, Status.UNRESOLVED)


def test_passive_joints_at_rest_carry_nothing(two_link: Robot) -> None:
    hanging = Scene(two_link, [hovi.effects.Gravity()], passive=["shoulder"])
    found = hovi.plan(hanging, [-np.pi / 2, 0.0], [-np.pi / 2, 0.0], 2.0, limits="none")
    assert found.status is Status.MINIMUM, found.message
    assert found.cost < 1e-20


def test_a_replanned_motion_that_its_grid_does_not_resolve_is_unresolved(
    arm_scene: Scene,
) -> None:
    hang = np.array([-np.pi / 2, 0.0])
    first = hovi.plan(arm_scene, hang, hang + 0.02, 10.0, intervals=16, **FAST)
    assert first.success, first.message
    again = first.replan(goal=-hang)
    assert (again.success, again.status) == (False, Status.UNRESOLVED)


def test_the_torque_of_a_passive_joint_between_the_points_counts(two_link: Robot) -> None:
    acrobot = Scene(two_link, [hovi.effects.Gravity()], passive=["shoulder"])
    ends = [-np.pi / 2, 0.0], [np.pi / 2, 0.0], 4.0
    coarse = hovi.plan(acrobot, *ends, intervals=40, **FAST)
    assert coarse.status is Status.UNRESOLVED
    assert "joint 'shoulder' is passive" in coarse.message
    fine = hovi.plan(acrobot, *ends, intervals=160, guess=coarse.trajectory, **FAST)
    assert fine.status is Status.MINIMUM
    model = two_link.model
    motion = fine.trajectory.sample(np.linspace(0.0, 4.0, 4001))
    data = model.createData()
    tau = np.array([pin.rnea(model, data, *row) for row in zip(*motion[:3], strict=True)])
    assert np.abs(tau[:, 0]).max() <= RESOLVED * np.abs(tau[:, 1]).max()


def test_every_success_has_an_error_estimate() -> None:
    for name in ("two_link_reach", "ur5_reach", "ur5_reach_limited", "cart_pole_swing_up"):
        found = hovi.plan_task(hovi.load_task(hovi.example(name)), starts=1)
        assert found.success, found.message
        assert found.error_estimate is not None
        assert 0 < found.error_estimate <= RESOLVED


LATE = "the time limit was reached before it was compared with one on a finer grid"


@pytest.mark.parametrize("limits", ["none", "urdf"])
def test_a_minimum_that_no_time_is_left_to_check_is_not_called_one(
    arm_scene: Scene, limits: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a clock that leaps when the plan says that it compares."""
    clock = LeapingClock(monkeypatch)

    def progress(text: str, share: float) -> None:
        if "comparing" in text:
            clock.leap()

    given = {"limits": limits, "intervals": 16, "scheme": "galerkin-2"}
    late = hovi.plan(arm_scene, HANG, REACH_Q, 1.0, time_limit=1e5, progress=progress, **given)
    assert (late.success, late.status, late.minima) == (False, Status.TIME_LIMIT, ())
    assert LATE in late.message
    assert late.trajectory.metadata["status"] == "time_limit"
    assert hovi.plan(arm_scene, HANG, REACH_Q, 1.0, **given).success


@pytest.mark.parametrize("scheme", ["galerkin-2", "galerkin-2x8", "taylor-midpoint"])
@pytest.mark.parametrize("name", ["two_link_reach", "panda_reach", "cart_pole_swing_up"])
def test_a_motion_of_half_an_hour_on_few_intervals_is_no_minimum(name: str, scheme: str) -> None:
    """As where milliseconds were meant: between the points the arm spins or falls."""
    task = hovi.load_task(hovi.example(name))
    options = {"scheme": scheme, "tolerance": None, "intervals": 16, **FAST}
    with pytest.warns(HoviWarning, match="the duration of 2000 s looks like milliseconds"):
        found = hovi.plan_task(dataclasses.replace(task, duration=2000.0), **options, starts=1)
    assert not found.success
    assert found.status in (Status.UNRESOLVED, Status.DIVERGED)


def test_the_change_that_is_told_is_that_on_the_finer_grid(arm_scene: Scene) -> None:
    ends, times = ([-np.pi / 2, 0.0], [np.pi / 2, 0.0], 2.0), 0
    for N in (8, 9, 10, 11):
        found = hovi.plan(arm_scene, *ends, scheme="hermite-simpson", intervals=N, **FAST)
        if "a finer grid changes its cost by" not in found.message:
            continue
        assert found.problem is not None
        finer = solve_on_grid(found.problem.finer, found.trajectory)
        told = 100 * abs(finer.cost / found.cost - 1)
        assert f"a finer grid changes its cost by {told:.2g} %" in found.message
        times += 1
    assert times >= 2


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e6])
def test_what_is_resolved_does_not_depend_on_the_unit_of_mass(
    two_link: Robot, scale: float
) -> None:
    """Stiff springs against which a small motion oscillates, and the same with other masses."""
    model = two_link.model.copy()
    for i in range(1, model.njoints):
        body = model.inertias[i]
        model.inertias[i] = pin.Inertia(scale * body.mass, body.lever, scale * body.inertia)
    scene = Scene(hovi.load_robot(model), [hovi.effects.JointSprings(1e3 * scale)])
    grid = Grid.uniform(2.0, 4, by_name("galerkin-2x8"))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    ends = hovi.State([0.0, 0.0]), hovi.State([1e-7, -1e-7])
    assert hovi.solve(hovi.TrajectoryProblem(ld, *ends)).status is Status.UNRESOLVED
