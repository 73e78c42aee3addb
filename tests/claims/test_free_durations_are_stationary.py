"""The best duration, against solves for given durations around it and known costs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import hovi
from hovi.effects import Armature, Gravity

WEIGHT = 20.0
BOUNDS = 0.3, 6.0
GRID = {"scheme": "galerkin-2", "intervals": 20, "self_collision": False, "processes": 1}
TORQUES = {"base": "none", "v": 4.0, "tau": [8.0, 3.0]}
MOVING = hovi.State([-1.5, 0.0], [0.8, -0.6]), hovi.State([0.3, 0.7], [0.5, -0.4])
REST = hovi.State([-1.5, 0.0]), hovi.State([0.3, 0.7])


def arm() -> hovi.Scene:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    return hovi.Scene(robot, [Gravity(9.8), Armature(0.05)])


def ur5() -> tuple[hovi.Scene, hovi.State, hovi.State]:
    task = hovi.load_task(hovi.example("ur5_reach"))
    return task.scene, task.start, task.goal


def frame(scene: hovi.Scene, start: hovi.State, goal: hovi.State) -> tuple[Any, ...]:
    """The task with the goal as that of its frame alone."""
    robot = scene.robot
    position = robot.frame_position(robot.tip_frame, np.asarray(goal.q))
    aim = hovi.FrameGoal(robot.tip_frame, position=position, guess=np.asarray(goal.q))
    return scene, start, aim


def past(scene: hovi.Scene, start: hovi.State, goal: hovi.State) -> list[hovi.Sphere]:
    """A ball in the way of the tip."""
    q = 0.5 * (np.asarray(start.q) + np.asarray(goal.q))
    return [hovi.Sphere(scene.robot.frame_position(scene.robot.tip_frame, q), 0.05, name="ball")]


BALANCE = hovi.Condition(lambda v: v[0] + v[1], hovi.Between(-3.0, 3.0), name="balance")
POWER = hovi.Condition(lambda tau, v: tau[0] * v[0], hovi.Between(-10.0, 10.0), name="power")
TASKS: dict[str, tuple[Callable[[], tuple[Any, ...]], dict[str, Any]]] = {
    "at rest": (lambda: (arm(), *REST), {}),
    "moving": (lambda: (arm(), *MOVING), {}),
    "six joints": (ur5, {}),
    "within limits": (lambda: (arm(), *MOVING), {"limits": TORQUES}),
    "a frame within limits": (lambda: frame(arm(), *REST), {"limits": TORQUES}),
    "a frame without limits": (lambda: frame(*ur5()), {"limits": "none"}),
    "a frame of six joints": (lambda: frame(*ur5()), {"limits": {"v": 0.8}}),
    "past a ball": (ur5, {"limits": {"v": 0.8}, "obstacles": past(*ur5())}),
    "a frame past a ball": (
        lambda: frame(*ur5()),
        {"limits": {"v": 0.8}, "obstacles": past(*ur5()), "self_collision": True},
    ),
    "under conditions": (lambda: (arm(), *MOVING), {"conditions": [BALANCE, POWER]}),
    "under conditions within limits": (
        lambda: (arm(), *REST),
        {"conditions": [BALANCE, POWER], "limits": {"base": "none", "tau": [12.0, 5.0]}},
    ),
}


def around(found: hovi.Solution) -> Callable[[float], float]:
    """J + w T for a given duration, each by a solve of its own from the motion found."""

    def total(T: float) -> float:
        assert found.problem is not None
        problem = found.problem.on(found.problem.grid.stretched(T))
        solved = hovi.solve(problem, found.trajectory)
        assert solved.success, solved.message
        return solved.cost  # the problem has the price of time

    return total


@pytest.mark.parametrize("kind", TASKS)
def test_the_best_duration_is_that_of_a_scalar_search_around_solves(kind: str) -> None:
    ends, options = TASKS[kind]
    given = GRID | {"limits": "none"} | options
    found = hovi.plan(*ends(), BOUNDS, time_weight=WEIGHT, **given)
    assert found.success, found.message
    assert found.n_neg == 0
    T, total, limited = found.trajectory.duration, around(found), bool(options)
    assert abs(found.duration_derivative + WEIGHT) <= (1e-7 if limited else 1e-10) * WEIGHT
    bracket = (0.95 * T, 1.01 * T, 1.1 * T) if limited else (0.99 * T, 1.001 * T, 1.01 * T)
    searched = minimize_scalar(total, bracket=bracket, options={"xtol": 1e-9, "maxiter": 20})
    assert pytest.approx(searched.x, rel=3e-3 if limited else 1e-6) == T
    assert found.cost == pytest.approx(searched.fun, rel=1e-5 if limited else 1e-11)
    if not limited:  # dS/dT + w by a stencil of sixth order
        h, stencil = 3e-3 * T, {1: 45 / 60, 2: -9 / 60, 3: 1 / 60}
        slope = sum(c * (total(T + k * h) - total(T - k * h)) for k, c in stencil.items()) / h
        assert abs(slope) <= 1e-7 * WEIGHT


def test_further_starts_begin_at_other_durations() -> None:
    """Between a fast motion and a slow one, the cost of this reach has a hump at half a second."""
    scene = hovi.Scene(hovi.load_robot("ur5"), [Gravity()])
    start = hovi.State([0.0, -1.4, 1.6, -0.2, 0.5, 0.0])
    aim = hovi.FrameGoal("tool0", position=[0.45, 0.25, 0.25])
    one, three = (
        hovi.plan(scene, start, aim, (0.2, 4.0), time_weight=100.0, starts=starts, processes=1)
        for starts in (1, 3)
    )
    assert one.success, one.message
    assert three.success, three.message
    assert three.cost < 0.6 * one.cost
    assert abs(three.duration_derivative + 100.0) <= 1e-4


@pytest.mark.parametrize("to", ["a configuration", "a frame"])
@pytest.mark.parametrize("weight", [1e3, 1e6])
def test_a_large_price_of_time_makes_motions_no_less_accurate(to: str, weight: float) -> None:
    """The cost without time is that of a plan for the duration that was found, a bound."""
    ends = frame(*ur5()) if to == "a frame" else ur5()
    given = GRID | {"limits": {"v": 0.8}}
    found = hovi.plan(*ends, (4.0, 6.0), time_weight=weight, **given)
    assert found.success, found.message
    T = found.trajectory.duration
    assert pytest.approx(4.0, rel=1e-12) == T
    alone = hovi.plan(*ends, 4.0, guess=found.trajectory, **given)
    assert alone.success, alone.message
    assert found.cost - weight * T == pytest.approx(alone.cost, rel=1e-4)


def glide(bounds: tuple[float, float], **options: Any) -> hovi.Solution:
    """A joint that turns by 1 rad and moves at 1 rad/s at both ends, without gravity.

    J = 6 I^2 (1 - T)^2 / T^3 is 0 at T = 1, has a maximum at T = 3, and falls beyond.
    """
    scene = hovi.Scene(hovi.load_robot(hovi.example("pendulum.urdf")))
    ends = hovi.State([0.0], [1.0]), hovi.State([1.0], [1.0])
    given = GRID | {"limits": "none", "intervals": 4} | options
    return hovi.plan(scene, *ends, bounds, **given)


def known(T: float) -> float:
    """The cost of the joint's motion; its inertia is m l^2 + 2/5 m r^2."""
    return 6 * (1.0 + 1.6e-4) ** 2 * (1 - T) ** 2 / T**3


def test_a_maximum_in_the_duration_is_no_minimum() -> None:
    """The first duration is the one between the bounds, here that of the maximum."""
    for bounds in ((0.2, 45.0), (1.125, 8.0), (2.0, 4.5)):
        found = glide(bounds)
        assert found.success, found.message
        T = found.trajectory.duration
        assert pytest.approx(bounds[1], rel=1e-14) == T or pytest.approx(max(1.0, bounds[0])) == T
        assert found.cost == pytest.approx(known(T), rel=1e-9, abs=1e-9)
        assert found.cost < 0.99 * known(3.0)


@pytest.mark.parametrize(
    ("bounds", "end"), [((3.5, 8.0), 8.0), ((1.5, 2.9), 1.5), ((2.5, 2.95), 2.5)]
)
def test_a_duration_at_its_bound_is_exactly_there(bounds: tuple[float, float], end: float) -> None:
    """The cost falls beyond it, and is concave in the duration there at T = 2.5 and 2.9."""
    found = glide(bounds)
    assert (found.success, found.n_neg) == (True, 0)
    assert found.trajectory.duration == pytest.approx(end, rel=1e-15)
    assert found.cost == pytest.approx(known(end), rel=1e-10)
    assert found.duration_derivative * (1 if end == bounds[0] else -1) > 0


@pytest.mark.parametrize("bounds", [(0.08, 1.6), (0.3, 8.5), (1.25, 20.0)], ids=str)
def test_limits_hold_everywhere_at_the_best_duration(bounds: tuple[float, float]) -> None:
    """From first durations that are too short for any motion, and from longer ones."""
    found = hovi.plan(arm(), *REST, bounds, time_weight=WEIGHT, limits=TORQUES, **GRID)
    assert found.success, found.message
    T = found.trajectory.duration
    assert abs(found.duration_derivative + WEIGHT) <= 1e-7 * WEIGHT
    motion = found.trajectory.sample(np.linspace(0.0, T, 20_000))
    tau = arm().inverse_dynamics(motion.q, motion.v, motion.a)
    share = np.abs(tau).max(axis=0) / [8.0, 3.0]
    assert np.abs(motion.v).max() <= 4.0 * (1 + 2e-6)
    assert 0.999 < share.max() <= 1 + 2e-6
    total = around(found)
    assert found.cost < min(total(0.97 * T), total(1.03 * T))


@pytest.mark.parametrize(("bounds", "end"), [((2.0, 4.0), 2.0), ((1.2, 1.35), 1.35)])
def test_within_limits_a_duration_ends_exactly_at_a_bound(
    bounds: tuple[float, float], end: float
) -> None:
    """The best duration without bounds is 1.43 s; the motion is that of the bound alone."""
    found = hovi.plan(arm(), *REST, bounds, time_weight=WEIGHT, limits=TORQUES, **GRID)
    assert (found.success, found.n_neg) == (True, 0)
    assert found.trajectory.duration == pytest.approx(end, rel=1e-15)
    assert (found.duration_derivative + WEIGHT) * (1 if end == bounds[0] else -1) > 0
    fixed = hovi.plan(arm(), *REST, end, limits=TORQUES, **GRID)
    assert found.cost == pytest.approx(fixed.cost + WEIGHT * end, rel=1e-5)


def test_a_motion_of_a_free_duration_is_replanned_in_few_steps() -> None:
    """To goals all around its own one, some of which move where torques hold it."""
    given, steps = {"limits": TORQUES, **GRID}, np.zeros(2)
    found = hovi.plan(arm(), *REST, (1.25, 20.0), time_weight=WEIGHT, **given)
    T, around = found.trajectory.duration, [(1, -1), (-1, 1), (0.5, 0), (0, 2), (1, 1), (-1, -1)]
    for change in around:
        near = hovi.State([0.3 + 0.01 * change[0], 0.7 + 0.01 * change[1]])
        again, cold = found.replan(goal=near), hovi.plan(arm(), REST[0], near, T, **given)
        assert again.success, again.message
        assert again.trajectory.duration == T
        assert again.cost == pytest.approx(cold.cost + WEIGHT * T, rel=1e-4)
        steps += again.nit, cold.nit
    assert steps[0] <= 0.5 * steps[1]


def test_ends_beyond_their_limits_are_said_without_a_solve() -> None:
    limits = {"base": "none", "q": [[-1.0, 1.0], [-1.0, 1.0]]}
    found = hovi.plan(arm(), *REST, BOUNDS, time_weight=WEIGHT, limits=limits, **GRID)
    assert (found.status, found.nit) == ("infeasible", 0)
    assert "shoulder" in found.message


@pytest.mark.parametrize("limits", ["none", TORQUES], ids=["free", "limited"])
def test_a_stopped_search_is_no_success(limits: Any) -> None:
    given = {"time_weight": WEIGHT, "limits": limits, **GRID}
    late = hovi.plan(arm(), *REST, BOUNDS, time_limit=1e-4, **given)
    few = hovi.plan(arm(), *REST, BOUNDS, max_iterations=2, continuation=False, **given)
    assert (late.success, late.status) == (False, "time_limit")
    assert (few.success, few.status) == (False, "iteration_limit")
