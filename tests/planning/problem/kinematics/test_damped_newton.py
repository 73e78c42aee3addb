"""Inverse kinematics in Python: its seeds and steps, and robots that only it knows."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
import pytest

import hovi
from hovi.conditions.function import Points
from hovi.planning.problem.frame_goal import PoseDifference
from hovi.planning.problem.kinematics.damped_newton import candidates, seeds
from hovi.robot.robot import Robot

FREE = np.full(6, -np.inf), np.full(6, np.inf)


@pytest.mark.parametrize("limited", [False, True])
def test_seeds_begin_nearby_and_cover_the_ranges(ur5: Robot, limited: bool) -> None:
    """Every other one is anywhere within the limits, and within a turn without them."""
    near = 0.3 * np.ones(6)
    lower = np.array([-1.0, -2.0, 0.5, -3.0, -0.1, -9.0]) if limited else FREE[0]
    upper = np.array([2.0, -0.5, 2.5, 3.0, 0.1, 9.0]) if limited else FREE[1]
    found = list(seeds(ur5, near, lower, upper))
    np.testing.assert_array_equal(found[0], near)
    anywhere = np.array(found[2::2])
    low, high = np.maximum(lower, -np.pi), np.minimum(upper, np.pi)
    assert (anywhere >= low).all()
    assert (anywhere <= high).all()
    share = (anywhere - low) / (high - low)
    assert (share.min(axis=0) < 0.25).all()
    assert (share.max(axis=0) > 0.75).all()
    nearby = np.abs(np.array(found[1::2]) - near)
    assert nearby.max() <= 1.0
    assert (nearby[0] <= 0.2).all()


@dataclass(frozen=True, eq=False)
class Recorded(PoseDifference):
    """Keeps every configuration at which it is evaluated."""

    tried: list[np.ndarray] = field(default_factory=list)

    def values(self, at: Points) -> np.ndarray:
        self.tried.append(at.q[0].copy())
        return super().values(at)


class RecordedGoal(hovi.FrameGoal):
    """A goal whose difference is the same object each time."""

    def difference(self, robot: Robot) -> PoseDifference:
        return self.__dict__.setdefault("recorded", Recorded(self, robot))


def test_no_step_moves_a_joint_by_more_than_half_a_radian(ur5: Robot) -> None:
    """Each configuration is a seed, or that near to one before it."""
    goal, near = RecordedGoal("tool0", position=[-0.4, 0.3, 0.2]), np.full(6, 0.3)
    assert len([*itertools.islice(candidates(ur5, goal, near, *FREE), 4)]) == 4
    tried = goal.difference(ur5).tried
    known = [*seeds(ur5, near, *FREE)]
    steps = 0
    for i, q in enumerate(tried):
        if any(np.array_equal(q, seed) for seed in known):
            continue
        steps += 1
        assert min(np.abs(q - before).max() for before in tried[:i]) <= 0.5 * (1 + 1e-12)
    assert steps > 10


def test_a_hand_on_a_floating_base_is_found(ur5: Robot) -> None:
    """Its joints have no fixed axis: the compiled search leaves it to this one."""
    robot = hovi.load_robot("ur5", free_flyer=True)
    random = np.random.default_rng(4)
    q = robot.integrate(robot.neutral(), random.uniform(-1, 1, robot.nv))
    pose = robot.frame_pose("tool0", q)
    found = hovi.inverse_kinematics(robot, hovi.FrameGoal("tool0", pose), most=3)
    np.testing.assert_allclose(
        robot.frame_pose("tool0", found), np.tile(pose, (len(found), 1, 1)), atol=1e-6
    )
    assert len(found) == 3
