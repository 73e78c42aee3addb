"""Obstacles that change nothing, or something, and distances by Coal along the motion."""

from __future__ import annotations

import time
from typing import Any

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi import solve
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.planning.clearance.obstacles import Obstacle
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.robot import Robot
from hovi.schemes import galerkin
from hovi.system.deadline import OutOfTimeError

Array = npt.NDArray[np.float64]
START, GOAL, T = [-1.2, 0.4], [0.9, 0.4], 1.7
LIMITS = {"base": "none", "v": 6.0}
FAR = hovi.Sphere([0.0, 2.8, 0.0], 0.1, name="far")
OUT_OF_REACH = hovi.Sphere([9.0, 0.0, 0.0], 0.1, name="out of reach")


def reach(scene: hovi.Scene, obstacles: list[Obstacle], limits: object = LIMITS) -> hovi.Solution:
    given = {"limits": limits, "obstacles": obstacles}
    return hovi.plan(scene, START, GOAL, T, scheme="galerkin-2", intervals=12, **given)


def least_distance(robot: Robot, obstacles: list[Obstacle], q: Array) -> float:
    """Of all moving shapes from the obstacles, by Coal's own calls, one after the other."""
    geometry, data = convex_geometry(robot), robot.model.createData()
    places, least = geometry.createData(), np.inf
    result, request = coal.DistanceResult(), coal.DistanceRequest()
    for one in q:
        pin.updateGeometryPlacements(robot.model, data, geometry, places, one)
        for i, shape in enumerate(geometry.geometryObjects):
            if shape.parentJoint == 0:
                continue
            at = coal.Transform3s(places.oMg[i].rotation, places.oMg[i].translation)
            for obstacle in obstacles:
                ((body, place),) = obstacle.bodies()
                there = coal.Transform3s(place.rotation, place.translation)
                result.clear()
                args = shape.geometry, at, body, there, request, result
                least = min(least, coal.distance(*args))
    return float(least)


@pytest.mark.parametrize("limits", [LIMITS, "none"])
def test_obstacles_far_away_leave_every_digit_of_a_motion(
    arm_scene: hovi.Scene, limits: object
) -> None:
    free, kept = (reach(arm_scene, obstacles, limits) for obstacles in ([], [FAR]))
    assert kept.success, kept.message
    np.testing.assert_array_equal(kept.trajectory.q, free.trajectory.q)
    assert kept.nit == free.nit
    assert kept.trajectory.metadata["clearance"]["obstacles"][0]["name"] == "far"


@pytest.mark.parametrize(
    ("raised", "status"), [(KeyboardInterrupt, "interrupted"), (OutOfTimeError, "time_limit")]
)
def test_what_stops_the_last_check_of_distances_leaves_the_motion_found(
    arm_scene: hovi.Scene,
    monkeypatch: pytest.MonkeyPatch,
    raised: type[BaseException],
    status: str,
) -> None:
    free, calls = reach(arm_scene, [], "none"), []

    def stopped(*args: Any) -> Any:
        calls.append(args)
        raise raised

    monkeypatch.setattr("hovi.planning.solver.methods.free_first.near_pairs", stopped)
    found = reach(arm_scene, [FAR], "none")
    assert found.status.value == status
    assert len(calls) == 1
    assert "before the distances along the motion were checked" in found.message
    np.testing.assert_array_equal(found.trajectory.q, free.trajectory.q)


def test_self_collision_that_changes_nothing_leaves_every_digit(panda: Robot) -> None:
    scene = hovi.Scene(panda, [hovi.effects.Gravity()])
    start = np.array([0.0, -0.5, 0.0, -2.0, 0.0, 2.4, 0.785])
    goal = np.add(start, [0.3, 0.2, 0.0, 0.1, 0.0, 0.1, 0.0])
    free, kept = (
        hovi.plan(scene, start, goal, 1.5, scheme="galerkin-2", intervals=12, self_collision=given)
        for given in (False, True)
    )
    assert kept.success, kept.message
    np.testing.assert_array_equal(kept.trajectory.q, free.trajectory.q)


def test_a_pair_that_a_motion_violates_is_added_and_kept_apart(arm_scene: hovi.Scene) -> None:
    """By Coal, at 50,000 samples of the motion."""
    free = reach(arm_scene, [])
    t = np.linspace(0.0, T, 50_000)
    q = free.trajectory.configurations(t)
    ball = hovi.Sphere(arm_scene.robot.frame_position("tip", q[40_000:40_001])[0], 0.05)
    kept = reach(arm_scene, [ball, FAR])
    assert kept.success, kept.message
    assert kept.cost > free.cost
    q = kept.trajectory.configurations(t)
    assert least_distance(arm_scene.robot, [ball], q) >= 0.01 - 1e-7


def problem_of(scene: hovi.Scene, obstacles: list[Obstacle]) -> TrajectoryProblem:
    grid = hovi.Grid.uniform(T, 12, galerkin(2))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    limits, clearance = as_limits(scene.robot, LIMITS), hovi.Clearance(obstacles)
    ends = hovi.State(START), hovi.State(GOAL)
    return TrajectoryProblem(ld, *ends, limits, clearance=clearance)


def test_several_obstacles_are_kept_at_a_distance(arm_scene: hovi.Scene) -> None:
    """The guess swings by the first ball, the motion without balls hangs down to the second."""
    robot = arm_scene.robot
    path = problem_of(arm_scene, [FAR])
    middle = path.trajectory(path.guess("cubic")).configurations(np.array([0.5 * T]))
    aside = hovi.Sphere(robot.frame_position("tip", middle)[0], 0.1, name="aside")
    found = solve(problem_of(arm_scene, [OUT_OF_REACH, FAR, aside]))
    assert found.success, found.message
    assert found.problem is not None
    assert found.problem.distances is not None
    assert {pair.other for pair in found.problem.distances.pairs} >= {"far", "aside"}
    assert least_distance(robot, [FAR, aside], sampled(found.trajectory, 2_000)) >= 0.01 - 1e-7


def test_a_pair_is_added_where_only_the_motion_violates_it(arm_scene: hovi.Scene) -> None:
    free, problem = reach(arm_scene, []), problem_of(arm_scene, [FAR])
    guess = sampled(problem.trajectory(problem.guess("cubic")), 200)
    tips = arm_scene.robot.frame_position("tip", sampled(free.trajectory, 30))
    balls = [hovi.Sphere(tip, 0.02, name="there") for tip in tips]
    ball = max(balls, key=lambda each: least_distance(arm_scene.robot, [each], guess))
    assert least_distance(arm_scene.robot, [ball], guess) > 0.02
    problem = problem_of(arm_scene, [FAR, ball])
    result = solve(problem)
    assert result.success, result.message
    motion = result.trajectory
    assert least_distance(arm_scene.robot, [ball], sampled(motion, 2_000)) >= 0.01 - 1e-7


def sampled(motion: hovi.Trajectory, count: int) -> Array:
    return motion.configurations(np.linspace(0.0, T, count))


@pytest.mark.parametrize("steps", [0, 1, 5])
def test_out_of_time_no_motion_among_obstacles_is_a_success(
    arm_scene: hovi.Scene, steps: int
) -> None:
    """However many steps fit in the time: every one after them takes all of it."""

    def slow(number: int, cost: float) -> None:
        time.sleep(0.3 if number > steps else 0.0)

    problem = problem_of(arm_scene, [FAR])
    found = solve(problem, time_limit=0.3 if steps else 0.0, report=slow)
    assert found.status == "time_limit"
    assert not found.success
    assert found.problem is not None
    assert found.problem.clearance is problem.clearance
