"""Obstacles that change nothing, pairs that are added, and distances by Coal along the motion."""

from __future__ import annotations

import time

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.discrete.grid import DiscretePath
from hovi.optimize.criteria import Criteria
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.planning.clearance.obstacles import Obstacle
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.methods.active_pairs import with_active_pairs
from hovi.planning.solver.methods.interior_point import InteriorPoint
from hovi.planning.solver.methods.method import MethodResult
from hovi.planning.solver.solver import guess_path
from hovi.planning.solver.status import Status
from hovi.robot.robot import Robot
from hovi.schemes import galerkin

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


def recorded(problem: TrajectoryProblem) -> tuple[list[set[str]], MethodResult]:
    """The obstacles of each solve of the interior point, and the result with all their steps."""
    given, steps = list[set[str]](), 0

    def solve(part: TrajectoryProblem, path: DiscretePath, options: Criteria) -> MethodResult:
        found = part.distances
        given.append(set() if found is None else {pair.other for pair in found.pairs})
        nonlocal steps
        part_result = InteriorPoint()._minimize(part, path, options, None)
        steps += part_result.nit
        assert part_result.problem.finer.clearance is part.clearance
        return part_result

    result = with_active_pairs(solve, problem, guess_path(problem, "cubic"), Criteria())
    assert result.nit == steps
    return given, result


def problem_of(scene: hovi.Scene, obstacles: list[Obstacle]) -> TrajectoryProblem:
    grid = hovi.Grid.uniform(T, 12, galerkin(2))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    limits, clearance = as_limits(scene.robot, LIMITS), hovi.Clearance(obstacles)
    ends = hovi.State(START), hovi.State(GOAL)
    return TrajectoryProblem(ld, *ends, limits, clearance=clearance)


def test_solves_have_the_pairs_that_the_motion_before_violates(arm_scene: hovi.Scene) -> None:
    """The guess swings by the first ball, the motion without balls hangs down to the second."""
    robot = arm_scene.robot
    path = problem_of(arm_scene, [FAR])
    straight = path.trajectory(guess_path(path, "cubic"))
    middle = straight.configurations(np.array([0.5 * T]))
    aside = hovi.Sphere(robot.frame_position("tip", middle)[0], 0.1, name="aside")
    given, result = recorded(problem_of(arm_scene, [OUT_OF_REACH, FAR, aside]))
    assert given[0] == {"aside"}
    assert all("far" not in each for each in given)
    assert result.status is Status.MINIMUM, result.message
    free, _ = recorded(problem_of(arm_scene, [FAR]))
    assert free == [set()]
    assert result.problem.distances is not None
    assert {pair.other for pair in result.problem.distances.pairs} == {"far", "aside"}
    assert result.problem.finer.clearance is result.problem.clearance


def test_a_pair_is_added_where_only_the_motion_violates_it(arm_scene: hovi.Scene) -> None:
    free, problem = reach(arm_scene, []), problem_of(arm_scene, [FAR])
    guess = sampled(problem.trajectory(guess_path(problem, "cubic")), 200)
    tips = arm_scene.robot.frame_position("tip", sampled(free.trajectory, 30))
    balls = [hovi.Sphere(tip, 0.02, name="there") for tip in tips]
    ball = max(balls, key=lambda each: least_distance(arm_scene.robot, [each], guess))
    assert least_distance(arm_scene.robot, [ball], guess) > 0.02
    problem = problem_of(arm_scene, [FAR, ball])
    given, result = recorded(problem)
    assert given == [set(), {"there"}]
    assert result.status is Status.MINIMUM, result.message
    motion = result.problem.trajectory(result.path)
    assert least_distance(arm_scene.robot, [ball], sampled(motion, 2_000)) >= 0.01 - 1e-7


def sampled(motion: hovi.Trajectory, count: int) -> Array:
    return motion.configurations(np.linspace(0.0, T, count))


def test_the_end_of_the_time_before_the_check_is_reported(arm_scene: hovi.Scene) -> None:
    """The solve takes all of it."""

    def solve(part: TrajectoryProblem, path: DiscretePath, options: Criteria) -> MethodResult:
        result = InteriorPoint()._minimize(part, path, Criteria(), None)
        time.sleep(options.time_limit or 0.0)
        return result

    problem = problem_of(arm_scene, [FAR])
    options = Criteria(time_limit=0.3)
    result = with_active_pairs(solve, problem, guess_path(problem, "cubic"), options)
    assert result.status is Status.TIME_LIMIT
    assert "before the distances along the motion were checked" in result.message
    assert result.problem.clearance is problem.clearance


def test_without_time_for_the_first_check_the_solve_reports_it(arm_scene: hovi.Scene) -> None:
    problem = problem_of(arm_scene, [FAR])
    result = InteriorPoint().minimize(
        problem, guess_path(problem, "cubic"), Criteria(time_limit=0.0)
    )
    assert result.status is Status.TIME_LIMIT
    assert result.problem.clearance is problem.clearance
