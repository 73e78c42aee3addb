"""An arm on a base that floats freely, without gravity, takes its tool to another place."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi

NOT_FOUND = pytest.mark.xfail(
    strict=True,
    reason="500 steps end without a motion; a guess that conserves the momentum and meets the goal "
    "to 5e-14 m takes as many steps as the cubic",
)
FOLDED = [0.0, -1.2, 1.0, -0.6, -0.8, 0.2]
DURATION = 4.0


@pytest.mark.long
@pytest.mark.parametrize(
    ("distance", "whole"), [(0.05, False), pytest.param(0.1, True, marks=NOT_FOUND)]
)
def test_the_tool_is_moved_while_the_momentum_stays_zero(distance: float, whole: bool) -> None:
    """whole: whether the goal is a pose, or a position alone."""
    robot = hovi.load_robot("ur5", free_flyer=True)
    scene = hovi.Scene(robot, [], passive=[robot.joint_names[0]])
    start = robot.neutral()
    start[7:] = FOLDED
    pose = robot.frame_pose("tool0", start)
    pose[0, 3] += distance
    goal = hovi.FrameGoal("tool0", pose) if whole else hovi.FrameGoal("tool0", position=pose[:3, 3])
    found = hovi.plan(scene, start, goal, DURATION, limits="none", self_collision=False)
    assert found.success, found.message
    missed = robot.frame_pose("tool0", found.trajectory.q[-1]) - pose
    assert np.abs(missed if whole else missed[:3, 3]).max() < 1e-6
    sample = found.trajectory.sample(np.linspace(0.0, DURATION, 50))
    model, data = robot.model, robot.model.createData()
    momenta = [
        pin.computeCentroidalMomentum(model, data, q, v).vector
        for q, v in zip(sample.q, sample.v, strict=True)
    ]
    assert np.abs(momenta).max() < 1e-6
