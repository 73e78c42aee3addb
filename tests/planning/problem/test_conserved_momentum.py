"""Robots in free fall: a passive base conserves its momenta."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.planning.problem.conserved_momentum import (
    falls_freely,
    free_fall_contradiction,
    without_redundancy,
)
from hovi.planning.problem.seams import Seam


@cache
def spacecraft() -> hovi.Task:
    return hovi.load_task(hovi.example("spacecraft_reorients"))


@cache
def reorientation(intervals: int, modes: int = 1) -> hovi.Solution:
    task = spacecraft()
    grid = hovi.Grid.uniform(task.duration, intervals, hovi.schemes.galerkin(modes))
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    guess = "cubic" if intervals == 8 else reorientation(8).trajectory
    return hovi.solve(hovi.TrajectoryProblem(ld, task.start, task.goal), guess)


def momentum_map(solution: hovi.Solution) -> np.ndarray:
    """J = Ad*_{q^-1} p of the base at every node: linear and angular momentum in the world."""
    rows = []
    for q, (p, _) in zip(solution.trajectory.q, solution.trajectory.momenta, strict=True):
        base = pin.XYZQUATToSE3(q[:7])
        rows.append(base.act(pin.Force(p[:6])).vector)
    return np.array(rows)


def test_the_spacecraft_ends_turned_and_its_place_follows() -> None:
    solution = reorientation(16, modes=3)
    assert solution.success, solution.message
    motion = solution.trajectory
    goal = np.array(spacecraft().goal.q)
    turn = pin.XYZQUATToSE3(motion.q[-1, :7]).rotation.T @ pin.XYZQUATToSE3(goal[:7]).rotation
    assert np.linalg.norm(pin.log3(turn)) < 1e-12
    np.testing.assert_allclose(motion.q[-1, 8:], goal[8:], atol=1e-14)
    assert np.linalg.norm(motion.q[-1, :3]) > 1e-3
    np.testing.assert_allclose(motion.v[-1], 0.0, atol=1e-7)


def test_the_six_momenta_of_the_action_are_equal_at_every_node() -> None:
    """Discrete Noether theorem with the base's multipliers; the goal fixes its orientation."""
    J = momentum_map(reorientation(8))
    size = np.max(np.abs(J))
    assert size > 1e-3
    assert np.max(np.ptp(J, axis=0)) < 1e-10 * size


def test_the_mechanical_momentum_drifts_by_the_order_of_the_scheme() -> None:
    """Equations that hold at quadrature points conserve momentum up to the quadrature error."""
    model = spacecraft().scene.model
    drifts = []
    grids = [16, 32, 64]
    for N in grids:
        motion, data = reorientation(N).trajectory, model.createData()
        h = [
            pin.computeCentroidalMomentum(model, data, q, v).vector.copy()
            for q, v in zip(motion.q, motion.v, strict=True)
        ]
        drifts.append(np.max(np.abs(h)))
    slopes = -np.diff(np.log(drifts)) / np.diff(np.log(grids))
    assert np.all(slopes > 5.7)
    assert drifts[-1] < 2e-10


def test_the_center_of_mass_of_a_falling_quadruped_moves_on_a_parabola() -> None:
    task = hovi.load_task(hovi.example("solo_in_flight"))
    solution = hovi.plan(
        task.scene, task.start, task.goal, task.duration, limits="none", self_collision=False
    )
    assert solution.success, solution.message
    t = np.linspace(0, task.duration, 21)
    sample, data = solution.trajectory.sample(t), task.scene.model.createData()
    center = np.array([pin.centerOfMass(task.scene.model, data, q).copy() for q in sample.q])
    fall = center[0] - np.outer(t**2 / 2, [0.0, 0.0, 9.81])
    np.testing.assert_allclose(center, fall, atol=1e-7)
    np.testing.assert_allclose(sample.q[-1, 7:], task.goal.q[7:], atol=1e-12)


def contradiction(**changes: object) -> str:
    """The message for the reorientation with another goal."""
    task = spacecraft()
    goal = dataclasses.replace(task.goal, **changes)
    solution = hovi.plan(
        task.scene, task.start, goal, task.duration, limits="none", self_collision=False
    )
    assert solution.status is hovi.Status.INFEASIBLE
    assert not solution.success
    return solution.message


def test_a_goal_that_moves_the_center_of_mass_is_infeasible() -> None:
    message = contradiction(free=())
    assert "cannot move the center of mass" in message
    assert "leave the goal's base position free" in message


def test_a_goal_that_needs_another_momentum_is_infeasible() -> None:
    v = np.zeros(9)
    v[3:6] = [0.0, 0.0, 0.1]
    task = spacecraft()
    state = hovi.State(task.start.q, v)
    free = np.zeros((2, 2, 9), dtype=bool)
    free[1, 0, :3] = True
    q, _ = task.start.on(task.scene.robot, "start")
    sentence = free_fall_contradiction(task.scene, ([q, q], [np.zeros(9), v]), free, 8.0)
    assert "angular momentum is off by" in sentence
    arm = free.copy()
    arm[1, 1, 8] = True  # one joint cannot take up what the base has
    sentence = free_fall_contradiction(task.scene, ([q, q], [np.zeros(9), v]), arm, 8.0)
    assert "momentum is off by" in sentence
    turned = free.copy()
    turned[1, 0, 3:6] = True  # then the momentum of the goal is unknown
    assert free_fall_contradiction(task.scene, ([q, q], [np.zeros(9), v]), turned, 8.0) == ""
    moving = hovi.plan(task.scene, state, task.start, 8.0, limits="none", self_collision=False)
    assert moving.status is hovi.Status.INFEASIBLE


def test_a_redundant_goal_is_met() -> None:
    """All components are prescribed, consistently with free fall."""
    free = reorientation(16, modes=3)
    end, problem = free.trajectory.q[-1], free.problem
    again = hovi.solve(problem.between(problem.start, hovi.State(end)), free.trajectory)
    assert again.success, again.message
    assert again.cost == pytest.approx(free.cost, rel=1e-9)
    np.testing.assert_allclose(again.trajectory.q[-1], end, atol=1e-8)


def test_friction_on_the_base_is_no_free_fall() -> None:
    """One coefficient for all coordinates also brakes the base; coefficients of the arm do not."""
    task = spacecraft()
    robot, passive = task.scene.robot, task.scene.passive
    everywhere = hovi.Scene(robot, [hovi.effects.ViscousFriction(0.1)], passive=passive)
    assert not falls_freely(everywhere)
    joints = dict.fromkeys(robot.joint_names[1:], 0.1)
    assert falls_freely(hovi.Scene(robot, [hovi.effects.ViscousFriction(joints)], passive=passive))


def test_a_rotor_on_one_axis_of_the_base_is_no_free_fall() -> None:
    task = spacecraft()
    robot, passive = task.scene.robot, task.scene.passive
    for axis in range(9):
        rotor = hovi.effects.Armature(np.eye(9)[axis].tolist())
        assert falls_freely(hovi.Scene(robot, [rotor], passive=passive)) == (axis >= 6)


def test_parts_of_an_orientation_cannot_be_free_alone() -> None:
    task = spacecraft()
    goal = dataclasses.replace(task.goal, free=("root_joint[3]", "root_joint[4]"))
    with pytest.raises(InputError, match="the position, one rotation, all rotations or everything"):
        hovi.plan(task.scene, task.start, goal, 1.0, self_collision=False)


def test_a_base_with_thrusters_may_go_anywhere() -> None:
    task = spacecraft()
    scene = hovi.Scene(task.scene.robot)
    goal = dataclasses.replace(task.goal, free=(), free_velocity=())
    solution = hovi.plan(
        scene, task.start, goal, task.duration, limits="none", self_collision=False
    )
    assert solution.success, solution.message
    J = momentum_map(solution)
    assert np.max(np.ptp(J, axis=0)) < 1e-10 * np.max(np.abs(J))


@pytest.mark.parametrize(
    ("arm_rates_free", "turn_free", "moving", "freed"),
    [
        (False, False, False, "velocity"),
        (False, False, True, "velocity"),
        (True, False, False, ""),
        (False, True, False, "velocity"),
        (False, True, True, ""),
    ],
)
def test_only_what_follows_from_the_momenta_is_freed(
    arm_rates_free: bool, turn_free: bool, moving: bool, freed: str
) -> None:
    """The base's velocity, if all joint rates and the inertia about every axis are known."""
    scene = spacecraft().scene
    free = np.zeros((2, 2, 9), dtype=bool)
    free[1, 1, 6:] = arm_rates_free
    free[1, 0, 3:6] = turn_free
    v = 0.1 * moving * np.ones(9)
    found = without_redundancy(scene, ([], [v, v]), free)
    expected = free.copy()
    expected[1, 0, :3] |= not turn_free
    expected[1, 1, :6] |= freed == "velocity"
    np.testing.assert_array_equal(found, expected)
    free[0, 0, 0] = True  # a free start, whose momenta are known at rest
    expected = free.copy()
    expected[1, 1, :6] |= freed == "velocity" and not moving
    np.testing.assert_array_equal(without_redundancy(scene, ([], [v, v]), free), expected)
    free[0, 1, 0] = True
    np.testing.assert_array_equal(without_redundancy(scene, ([], [v, v]), free), free)


def in_segments(stop: State, goal: State, mass: float) -> hovi.Solution:
    """The spacecraft moves its arm, takes a mass if it is not 0, and moves on."""
    task = spacecraft()
    load = [hovi.effects.Payload(frame=task.scene.robot.tip_frame, mass=mass)] if mass else []
    segments = [hovi.Segment(stop, 0.8), hovi.Segment(goal, 0.9, effects=load)]
    options = {"limits": "none", "self_collision": False, "intervals": 32, "continuation": False}
    return hovi.plan_sequence(task.scene, task.start, segments, **options)


def arm_at(angles: list[float]) -> np.ndarray:
    q = np.array(spacecraft().start.on(spacecraft().scene.robot, "start")[0])
    q[7:] = angles
    return q


BASE = {"free": ("root_joint",), "free_velocity": ("root_joint",)}


@pytest.mark.parametrize("mass", [0.0, 5.0])
def test_a_goal_from_which_a_mass_was_taken_along_is_compared_with_the_segment_s_momenta(
    mass: float,
) -> None:
    """Where the base is left by a motion is a goal that it can reach, with the load or without."""
    arms = [0.5, -0.4, 0.3], [0.2, 0.9, -0.5]
    found = in_segments(State(arm_at(arms[0]), **BASE), State(arm_at(arms[1]), **BASE), mass)
    assert found.success, found.message
    motion = found.trajectory
    node = int(np.argmin(np.abs(motion.t - 0.8)))
    v = motion.v[node]
    assert np.abs(v).max() < 1e-8
    stop, goal = State(motion.q[node]), State(motion.q[-1])
    again = in_segments(State(arm_at(arms[0]), **BASE), goal, mass)
    assert again.problem is not None
    assert again.problem.unreachable == ""
    reached = in_segments(stop, State(arm_at(arms[1]), **BASE), mass)
    assert reached.problem is not None
    assert reached.problem.unreachable == ""
    assert reached.cost == pytest.approx(found.cost, rel=1e-6)
    hold = reached.problem.holds[0]
    np.testing.assert_array_equal(hold.fixed[0], [False] * 3 + [True] * 6)
    np.testing.assert_array_equal(hold.fixed[1], [False] * 6 + [True] * 3)


def test_a_seam_at_which_the_center_of_mass_would_have_moved_is_refused() -> None:
    q = arm_at([0.5, -0.4, 0.3])
    q[0] += 1.0
    found = in_segments(State(q), State(arm_at([0.2, 0.9, -0.5]), **BASE), 0.0)
    assert found.status is hovi.Status.INFEASIBLE
    assert "joint torques cannot move the center of mass" in found.message


@pytest.mark.parametrize("moving", [False, True])
def test_a_replan_from_a_moving_base_leaves_unknown_what_its_momenta_no_longer_imply(
    moving: bool,
) -> None:
    """A start whose base is placed freely says the momenta at rest, and none with a velocity."""
    task = spacecraft()
    stop = State(arm_at([0.5, -0.4, 0.3]), free=["root_joint"])
    scheme = hovi.schemes.galerkin(2)
    part = hovi.DiscreteLagrangian(
        task.scene.effort_lagrangian(), hovi.Grid.uniform(0.8, 4, scheme)
    )
    q, goal = arm_at([0.0, 0.0, 0.0]), State(arm_at([0.2, 0.9, -0.5]), **BASE)
    rest, moved = (State(q, v * np.ones(9), free=["root_joint"]) for v in (0.0, 0.1))
    first, then = (rest, moved) if moving else (moved, rest)
    known = hovi.TrajectoryProblem.of_segments([part, part], first, goal, via=(Seam(0.8, stop),))
    assert known.structure.layout.size > 0
    problem = known.between(then, goal)
    fresh = hovi.TrajectoryProblem.of_segments([part, part], then, goal, via=(Seam(0.8, stop),))
    np.testing.assert_array_equal(problem.holds[0].fixed[1], [moving] * 6 + [True] * 3)
    assert problem.structure.layout.size == fresh.structure.layout.size
