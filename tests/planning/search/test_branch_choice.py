"""Which branch a plan takes: the one whose motion costs least, of those that may be taken."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import hovi
from hovi.errors import UnreachableError
from hovi.robot.robot import Robot

FAST = {"intervals": 12, "scheme": "galerkin-2"}


@pytest.fixture(scope="module")
def scene(ur5: Robot) -> hovi.Scene:
    return hovi.Scene(ur5, [hovi.effects.Gravity()])


def test_the_branch_with_the_cheapest_motion_is_chosen(ur5: Robot, scene: hovi.Scene) -> None:
    """Not the nearest one: no dearer than the motions to all eight, planned from their cubics."""
    random = np.random.default_rng(3)
    for _ in range(3):
        start, q = random.uniform(-2.5, 2.5, (2, 6))
    goal = hovi.FrameGoal("tool0", ur5.frame_pose("tool0", q))
    branches = hovi.inverse_kinematics(ur5, goal, near=start)
    costs = []
    for branch in branches:
        alone = dataclasses.replace(goal, guess=branch)
        motion = hovi.plan(
            scene, start, alone, 1.5, continuation=False, **FAST, self_collision=False
        )
        costs.append(motion.cost if motion.success else np.inf)
    chosen = hovi.plan(scene, start, goal, 1.5, continuation=False, **FAST, self_collision=False)
    assert np.argmin(costs) != 0
    assert chosen.cost <= min(costs) * (1 + 1e-9)


def test_a_motion_begins_and_ends_at_frames(ur5: Robot, scene: hovi.Scene) -> None:
    poses = ur5.frame_pose("tool0", np.array([[0.3, -1.2, 1.3, -0.7, 0.8, 0], [1, -1, 1, 0, 1, 0]]))
    start, goal = (hovi.FrameGoal("tool0", pose) for pose in poses)
    motion = hovi.plan(scene, start, goal, 2.0, self_collision=False)
    assert motion.success, motion.message
    ends = motion.trajectory.sample([0.0, 2.0])
    np.testing.assert_allclose(ur5.frame_pose("tool0", ends.q), poses, atol=1e-9)
    np.testing.assert_allclose(ends.v, 0.0, atol=1e-9)


@pytest.mark.parametrize("turn", [0.0, 2 * np.pi])
def test_a_start_near_a_given_goal_is_its_own_branch(
    ur5: Robot, scene: hovi.Scene, turn: float
) -> None:
    """The motion from another one would be longer. turn: of the last joint, in its guess."""
    q = np.array([0.3, -1.2, 1.3, -0.7, 0.8, 0.0])
    pose, turned = ur5.frame_pose("tool0", q), q - np.array([0, 0, 0, 0, 0, turn])
    start = hovi.FrameGoal("tool0", pose, guess=turned if turn else None)
    motion = hovi.plan(scene, start, hovi.State(q + 0.2), 1.0, max_iterations=1, continuation=False)
    np.testing.assert_allclose(motion.trajectory.q[0], turned, atol=1e-8)


def test_branches_in_an_obstacle_are_not_chosen(ur5: Robot, scene: hovi.Scene) -> None:
    start, q = np.array([-0.2, -1.2, 1.3, -0.7, 0.8, 0]), np.array([0.9, -1.3, 1.4, -0.6, 0.7, 0.1])
    goal = hovi.FrameGoal("tool0", ur5.frame_pose("tool0", q))
    ball = hovi.Sphere(ur5.frame_position("forearm_link", q[None])[0], 0.02)
    for obstacles, is_taken in (((), True), ((ball,), False)):
        motion = hovi.plan(scene, start, goal, 3.0, obstacles=obstacles, self_collision=False)
        assert motion.success, motion.message
        assert (np.abs(motion.trajectory.q[-1] - q).max() < 1e-4) == is_taken


def test_ends_that_cannot_be_met_are_told(scene: hovi.Scene) -> None:
    """Without a start there is no motion; a goal gives a status, as before."""
    away = hovi.FrameGoal("tool0", position=[3.0, 0, 0])
    with pytest.raises(UnreachableError, match="misses it by"):
        hovi.plan(scene, away, np.zeros(6), 1.0, **FAST, self_collision=False)
    motion = hovi.plan(scene, np.zeros(6), away, 1.0, **FAST, self_collision=False)
    assert motion.status is hovi.Status.INFEASIBLE
    assert "no configuration that reaches the goal was found" in motion.message
