"""Slopes of solutions in their ends: closed forms, and differences of solves on the same rows."""

from __future__ import annotations

import dataclasses
import pickle
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.errors import InputError
from hovi.planning.problem.limits import as_limits
from oracles.on_grid import cost_with_bounds, solve_on_grid
from samples.floating_arm import BALL, flight, floating
from samples.small_robots import arm

Array = npt.NDArray[np.float64]
GRAVITY = hovi.effects.Gravity()
BARRIER = 1e-11
"""Of solves that are compared: a larger one moves motions next to their limits."""


def problem(
    robot: hovi.Robot,
    start: Any,
    goal: Any,
    duration: float,
    limits: Any = None,
    *,
    intervals: int = 12,
    scheme: str = "galerkin-2",
    passive: tuple[str, ...] = (),
    **more: Any,
) -> hovi.TrajectoryProblem:
    scene = hovi.Scene(robot, [GRAVITY], passive=list(passive))
    grid = hovi.Grid.uniform(duration, intervals, hovi.schemes.by_name(scheme))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    bounds = None if limits is None else as_limits(robot, {"base": "none", **limits})
    end = goal if isinstance(goal, hovi.FrameGoal) else hovi.State(goal)
    return hovi.TrajectoryProblem(ld, hovi.State(start), end, bounds, **more)


def two_link(limits: Any = None) -> hovi.TrajectoryProblem:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    return problem(robot, [-1.2, 0.4], [0.9, 0.4], 1.5, limits)


def cart_pole() -> hovi.TrajectoryProblem:
    robot = hovi.load_robot(hovi.example("cart_pole.urdf"))
    ends = [0.0, -np.pi], [0.0, 0.0]
    return problem(robot, *ends, 2.0, intervals=32, passive=("hinge",))


def to_a_frame(limits: Any = None) -> hovi.TrajectoryProblem:
    start = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1]
    goal = hovi.FrameGoal("tool0", position=[0.4, 0.3, 0.4])
    return problem(hovi.load_robot("ur5"), start, goal, 1.5, limits, intervals=10)


def past_a_ball() -> hovi.TrajectoryProblem:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    ball = hovi.Clearance([hovi.Sphere([0.7, 0.0, -1.65], 0.15, name="ball")], 0.05)
    return problem(robot, [-np.pi / 2, 0.0], [0.3, 0.7], 1.5, intervals=16, clearance=ball)


def floating_past_a_ball() -> hovi.TrajectoryProblem:
    robot = floating()
    given: dict[str, Any] = {"scheme": "galerkin-2x8", "clearance": hovi.Clearance([BALL])}
    return problem(robot, *flight(robot), 1.5, **given)


def limited_torques() -> hovi.TrajectoryProblem:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    limits, given = {"tau": [7.8, 4.0]}, {"intervals": 20, "scheme": "galerkin-2x8"}
    return problem(robot, [-1.2, 0.4], [0.9, 0.4], 1.5, limits, **given)


PROBLEMS = {
    "free": (two_link, "start", 1e-7),
    "limits on speeds": (lambda: two_link({"v": 2.1}), "start", 1e-5),
    "limits on speeds for long": (lambda: two_link({"v": 1.6}), "goal", 2e-4),
    "limits on torques": (limited_torques, "goal", 3e-2),
    "passive": (cart_pole, "start", 1e-6),
    "frame": (to_a_frame, "start", 1e-5),
    "frame within limits": (lambda: to_a_frame({"v": 0.9}), "start", 5e-3),
    "ball": (past_a_ball, "goal", 1e-6),
    "floating": (floating_past_a_ball, "goal", 1e-3),
}
"""A problem, an end that moves, and how far slopes may be from differences: torques are tightened
anew in every solve, and light wrists are flat directions, in which solves end early."""
FLAT = "frame within limits", "floating"
"""Problems whose motions are not compared, but their costs."""


def solved_near(known: hovi.Solution, end: Any, component: tuple[int, int], by: float) -> Any:
    """The solution with one component of an end moved, with the same rows."""
    motion, i = known.trajectory, -1 if end == "goal" else 0
    q, v = motion.q[i].copy(), motion.v[i].copy()
    step = by * np.eye(len(v))[component[1]]
    if component[0] == 0:
        q = known.problem.robot.integrate(q, step)
    moved = hovi.State(q, v + step if component[0] == 1 else v)
    limits = known.problem.limits
    if known.central is not None and (limits is None or not limits.on_torques):
        paths = tuple(path for _, path in known.central.points)
        central = known.central.on(motion.grid, paths)
        known = dataclasses.replace(known, central=central)
    options = {"barrier": BARRIER} if known.problem.limited else {}
    found = known.replan(**{end: moved}, **options)
    assert found.status == "minimum", found.message
    return found


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("order", [0, 1])
def test_slopes_are_differences_of_solutions(name: str, order: int) -> None:
    """Of the motion, of the least cost, and of its slopes, in q and in v at an end."""
    asked, end, tolerance = PROBLEMS[name]
    known = solve_on_grid(asked(), barrier=BARRIER)
    assert known.status == "minimum", known.message
    assert known.problem is not None
    factor: Any = known.factor
    assert factor.negative_eigenvalues == 0
    robot, h, i = known.problem.robot, 1e-4, 0
    there, back = (solved_near(known, end, (order, i), by) for by in (h, -h))
    slope = (there.cost - back.cost) / (2 * h)
    assert factor.cost_slopes(end)[order, i] == pytest.approx(slope, rel=max(tolerance, 1e-4))
    one, other = (each.factor.cost_slopes(end)[order, i] for each in (there, back))
    bend = factor.cost_curvature(end)[order * robot.nv + i, order * robot.nv + i]
    assert bend == pytest.approx((one - other) / (2 * h), rel=max(tolerance, 1e-4))
    if name in FLAT:
        return
    dq = robot.difference(back.trajectory.q, there.trajectory.q) / (2 * h)
    dv = (there.trajectory.v - back.trajectory.v) / (2 * h)
    slopes = factor.slopes(end)[..., order, i]
    np.testing.assert_allclose(slopes[:, 0], dq, rtol=0, atol=tolerance * np.abs(dq).max())
    np.testing.assert_allclose(slopes[:, 1], dv, rtol=0, atol=tolerance * np.abs(dv).max())


def test_the_curvature_of_a_slider_is_its_closed_form() -> None:
    """J = m^2 (6 d^2 / T^3 - 6 d (v0 + v1) / T^2 + 2 (v0^2 + v0 v1 + v1^2) / T)."""
    m, T = 0.5, 2.0
    found = solve_on_grid(problem(arm("rail", ("prismatic",)), [0.0], [1.0], T))
    expected = m**2 * np.array([[12 / T**3, 6 / T**2], [6 / T**2, 4 / T]])
    np.testing.assert_allclose(found.factor.cost_curvature("start"), expected, rtol=1e-9)


def test_a_slider_at_its_largest_speed_follows_by_the_time_there() -> None:
    """J = 8 m^2 V^2 / (9 s) with s = T - L / V: it speeds up in 3 s / 2 on each side."""
    m, T, L, V = 0.5, 2.0, 1.0, 0.7
    rail, s = arm("rail", ("prismatic",)), T - L / V
    factor: Any = solve_on_grid(problem(rail, [0.0], [L], T, {"v": V}, intervals=80)).factor
    assert factor.active > 0
    assert factor.cost_slopes("goal")[0, 0] == pytest.approx(8 * m**2 * V / (9 * s**2), rel=1e-4)
    assert factor.cost_curvature("goal")[0, 0] == pytest.approx(16 * m**2 / (9 * s**3), rel=1e-2)
    assert factor.strictness < 1e-5


def test_a_bound_of_a_condition_moves_the_cost_by_its_multipliers() -> None:
    """The slider again: dJ/dV = 8 m^2 / 9 (2 V / s - L / s^2)."""
    m, T, L, V = 0.5, 2.0, 1.0, 0.7
    rail, s = arm("rail", ("prismatic",)), T - L / V
    fast = hovi.Condition(lambda v: v, hovi.Between(-2.0, V), name="fast")
    asked = problem(rail, [0.0], [L], T, intervals=80, conditions=(fast,))
    slopes = solve_on_grid(asked).factor.bound_slopes["fast"]
    expected = 8 * m**2 / 9 * (2 * V / s - L / s**2)
    np.testing.assert_allclose(slopes, [[0.0], [expected]], rtol=1e-3, atol=1e-9)


def test_bound_slopes_are_differences_of_costs_on_the_same_rows() -> None:
    """In the unit of y, of both sides and of several values, whatever their scales."""
    robot, low, high = hovi.load_robot(hovi.example("two_link.urdf")), -1.3, 2.2
    ranges = np.array([9.0 - low, high + 9.0])
    both = hovi.Between([low, -9.0], [9.0, high])
    asked = hovi.Condition(lambda q, v: ca.vertcat(q[0], v[0]), both, name="both")
    found: Any = solve_on_grid(problem(robot, [-1.2, 0.4], [0.9, 0.4], 1.5, conditions=(asked,)))
    slopes = found.factor.bound_slopes["both"]

    def cost(side: str, entry: int, by: float) -> float:
        known = getattr(found.solved_bounds.objective.bounds, side)
        moved = known.reshape(-1, 2) + by / ranges * np.eye(2)[entry]
        return cost_with_bounds(found, **{side: moved.ravel()})

    for i, side in enumerate(("lower", "upper")):
        difference = (cost(side, i, 1e-4) - cost(side, i, -1e-4)) / 2e-4
        assert abs(difference) > 1.0
        assert slopes[i, i] == pytest.approx(difference, rel=1e-5)
        assert abs(slopes[i, 1 - i]) < 1e-7


def test_without_freedom_in_a_joint_its_slopes_are_no_numbers() -> None:
    factor: Any = solve_on_grid(two_link({"a": 6.0})).factor
    slopes = factor.slopes("start")
    assert np.isfinite(slopes[..., 0, 0]).all()
    assert np.isnan(slopes[..., 1, 1]).all()


def test_a_solution_from_another_process_is_solved_for_once_more() -> None:
    found = solve_on_grid(two_link({"v": 2.1}), barrier=BARRIER)
    again: Any = dataclasses.replace(
        found, solved_bounds=pickle.loads(pickle.dumps(found.solved_bounds))
    )
    assert again.solved_bounds is None
    np.testing.assert_allclose(
        again.factor.cost_curvature("goal"), found.factor.cost_curvature("goal"), rtol=1e-2
    )


def test_a_factor_of_no_minimum_within_limits_is_refused() -> None:
    found = solve_on_grid(two_link({"v": 2.1}), max_iterations=1)
    with pytest.raises(InputError, match="that of a minimum"):
        _ = found.factor


def test_an_unknown_end_is_refused() -> None:
    factor: Any = solve_on_grid(two_link()).factor
    for end in ("end", 0, np.zeros(2)):
        with pytest.raises(InputError, match="'start' or 'goal'"):
            factor.slopes(end)


def test_an_obstacle_out_of_the_way_changes_no_slope() -> None:
    far = hovi.Clearance([hovi.Sphere([0.0, 2.8, 0.0], 0.1, name="far")])
    known = two_link()
    one, other = (
        solve_on_grid(each).factor.cost_curvature("goal")
        for each in (known, dataclasses.replace(known, clearance=far))
    )
    np.testing.assert_allclose(one, other, rtol=1e-9)


def test_the_duration_of_a_motion_stays() -> None:
    """Where it was free, slopes are those of a motion of the same duration."""
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    scene = hovi.Scene(robot, [GRAVITY])
    given: Any = {"limits": "none", "tolerance": 1e-8}
    free = hovi.plan(scene, [-1.2, 0.4], [0.9, 0.4], (0.5, 5.0), time_weight=10.0, **given)
    T = free.trajectory.duration
    held = hovi.plan(scene, [-1.2, 0.4], [0.9, 0.4], T, **given)
    one, other = (each.factor.cost_curvature("goal") for each in (free, held))
    np.testing.assert_allclose(one, other, rtol=1e-5)


def test_a_motion_that_is_not_stationary_is_refused() -> None:
    found = solve_on_grid(two_link(), max_iterations=1)
    with pytest.raises(InputError, match="stationary"):
        _ = found.factor


def test_slopes_in_a_start_outside_of_its_limits_are_refused() -> None:
    rail = problem(arm("rail", ("prismatic",)), [0.0], [1.0], 2.0, {"v": 0.7})
    outside = rail.between(hovi.State([0.0], [0.705]), rail.goal)
    factor: Any = solve_on_grid(outside).factor
    assert np.isfinite(factor.cost_slopes("goal")).all()
    with pytest.raises(InputError, match="led back"):
        factor.slopes("start")


def test_a_periodic_motion_is_refused() -> None:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    scene = hovi.Scene(robot, [GRAVITY])
    ld = hovi.DiscreteLagrangian(
        scene.effort_lagrangian(), hovi.Grid.uniform(1.5, 12, hovi.schemes.by_name("galerkin-2"))
    )
    again = hovi.TrajectoryProblem(ld, hovi.State([-1.2, 0.4]), hovi.Periodic(held=["shoulder"]))
    with pytest.raises(InputError, match="periodic"):
        _ = solve_on_grid(again).factor
