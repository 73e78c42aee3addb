"""Poses that a hand passes on its way, however far the straight way turns past them."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi

Array = np.ndarray
FRAMES = {"ur5": "tool0", "panda": "panda_hand_tcp", "z1": "gripperMover"}
FINGERS = {"panda": ["panda_finger_joint1", "panda_finger_joint2"], "z1": ["jointGripper"]}
REACHED = 1e-6


def pose(scene: hovi.Scene, frame: str, q: Array) -> pin.SE3:
    """By Pinocchio alone."""
    model, data = scene.model, scene.model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId(frame, pin.BODY)].copy()


@pytest.mark.parametrize("limits", ["none", "urdf"])
@pytest.mark.parametrize("seed", [0, *(pytest.param(i, marks=pytest.mark.long) for i in (1, 2))])
@pytest.mark.parametrize("robot", FRAMES)
def test_a_pose_of_a_random_configuration_is_passed(robot: str, seed: int, limits: str) -> None:
    frame, rng = FRAMES[robot], np.random.default_rng(seed)
    arm = hovi.load_robot(robot, locked=FINGERS.get(robot, []))
    scene = hovi.Scene(arm, [hovi.effects.Gravity()])
    lower, upper = np.maximum(arm.lower, -2.0), np.minimum(arm.upper, 2.0)
    middle, room = (lower + upper) / 2, (upper - lower) / 2
    start, goal = (middle + room * rng.uniform(-0.5, 0.5, arm.nv) for _ in range(2))
    there = pose(scene, frame, middle + room * rng.uniform(-0.8, 0.8, arm.nv))
    via = [hovi.Via(1.0, hovi.FrameGoal(frame, there.homogeneous))]
    given = {"limits": limits, "self_collision": False, "processes": 1}
    found = hovi.plan(scene, start, goal, 2.5, via=via, **given)
    assert found.success, found.message
    passed = pose(scene, frame, found.trajectory.configurations([1.0])[0])
    assert np.abs(pin.log6(passed.actInv(there)).vector).max() < REACHED


def test_a_guess_passes_all_frames_and_keeps_its_ends() -> None:
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    start, goal = np.array([0.0, -1.2, 1.5, -0.3, 0.5, 0.0]), np.array([1.0, -1.0, 1.0, 0, 1.0, 0])
    places = [pose(scene, "tool0", start + 0.6), pose(scene, "tool0", goal - 0.5)]
    times = 0.5, 1.2
    via = [
        hovi.Via(t, hovi.FrameGoal("tool0", at.homogeneous))
        for t, at in zip(times, places, strict=True)
    ]
    grid = hovi.Grid.uniform(2.0, 20, hovi.schemes.galerkin(2))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    problem = hovi.TrajectoryProblem(ld, hovi.State(start), hovi.State(goal), via=via)
    motion = problem.trajectory(problem.guess("cubic"))
    for t, at in zip(times, places, strict=True):
        missed = pose(scene, "tool0", motion.configurations([t])[0]).actInv(at)
        assert np.abs(pin.log6(missed).vector).max() < 1e-3
    np.testing.assert_array_equal(motion.q[[0, -1]], [start, goal])
    np.testing.assert_array_equal(motion.v[[0, -1]], np.zeros((2, 6)))
