"""Configurations that meet a goal, from seeds all over the ranges of the joints."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.planning.problem.frame_goal import FrameCondition
from hovi.planning.problem.inverse_kinematics import _seeds, inverse_kinematics
from hovi.robot.robot import Robot


@pytest.mark.parametrize("limited", [False, True])
def test_seeds_begin_nearby_and_cover_the_ranges(ur5: Robot, limited: bool) -> None:
    """Every other one is anywhere within the limits, and within a turn without them."""
    near = 0.3 * np.ones(6)
    lower = np.array([-1.0, -2.0, 0.5, -3.0, -0.1, -9.0]) if limited else np.full(6, -np.inf)
    upper = np.array([2.0, -0.5, 2.5, 3.0, 0.1, 9.0]) if limited else np.full(6, np.inf)
    seeds = list(_seeds(ur5, near, lower, upper))
    np.testing.assert_array_equal(seeds[0], near)
    anywhere = np.array(seeds[2::2])
    low, high = np.maximum(lower, -np.pi), np.minimum(upper, np.pi)
    assert (anywhere >= low).all()
    assert (anywhere <= high).all()
    share = (anywhere - low) / (high - low)
    assert (share.min(axis=0) < 0.25).all()
    assert (share.max(axis=0) > 0.75).all()
    nearby = np.abs(np.array(seeds[1::2]) - near)
    assert nearby.max() <= 1.0
    assert (nearby[0] <= 0.2).all()


@pytest.mark.parametrize("signs", [*itertools.product([-1, 1], repeat=2)])
def test_a_goal_is_met_within_limits_on_every_side(ur5: Robot, signs: tuple[int, int]) -> None:
    """The limits leave one branch of the elbow and one half of the first joint's turn."""
    q = np.array([1.2 * signs[0], -1.0, 1.1 * signs[1], 0.4, 0.6, 0.2])
    pose = ur5.frame_position("tool0", q[None])[0]
    lower, upper = np.full(6, -3.0), np.full(6, 3.0)
    lower[0], upper[0] = sorted((0.2 * signs[0], 3.0 * signs[0]))
    lower[2], upper[2] = sorted((0.2 * signs[1], 3.0 * signs[1]))
    goal = hovi.FrameGoal("tool0", position=pose)
    found = inverse_kinematics(ur5, goal, np.zeros(6), lower, upper)
    assert found.reason == ""
    assert (found.q >= lower).all()
    assert (found.q <= upper).all()
    np.testing.assert_allclose(ur5.frame_position("tool0", found.q[None])[0], pose, atol=1e-7)


def test_every_pose_that_is_reached_within_limits_is_found(ur5: Robot) -> None:
    random, bound, data = np.random.default_rng(1), np.full(6, 3.0), ur5.model.createData()
    for _ in range(8):
        near, q = 0.8 * bound * random.uniform(-1, 1, (2, 6))
        pin.framesForwardKinematics(ur5.model, data, q)
        pose = data.oMf[ur5.model.getFrameId("tool0")]
        goal = hovi.FrameGoal("tool0", position=pose.translation, rotation=pose.rotation)
        found = inverse_kinematics(ur5, goal, near, -bound, bound)
        assert found.reason == ""
        assert (np.abs(found.q) <= bound).all()


@pytest.mark.parametrize(("beyond", "is_met"), [(-1e-3, True), (0.0, True), (4e-6, False)])
def test_a_goal_a_few_micrometres_beyond_the_reach_is_not_met(
    two_link: Robot, beyond: float, is_met: bool
) -> None:
    """The arm reaches 2.5 m, the sum of its links."""
    goal = hovi.FrameGoal("tip", position=[0.0, 0.0, -2.5 - beyond])
    found = inverse_kinematics(two_link, goal, np.array([-1.2, 0.3]))
    assert (found.reason == "") == is_met


@dataclass(frozen=True, eq=False)
class Recorded(FrameCondition):
    """Keeps every configuration at which it is evaluated."""

    tried: list[np.ndarray] = field(default_factory=list)

    def evaluate(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.tried.append(q.copy())
        return super().evaluate(q, v)


class RecordedGoal(hovi.FrameGoal):
    """A goal whose condition is the same object each time."""

    def condition(self, robot: Robot) -> FrameCondition:
        return self.__dict__.setdefault("recorded", Recorded(self, robot))


def test_no_step_moves_a_joint_by_more_than_half_a_radian(ur5: Robot) -> None:
    """Each configuration is a seed, or that near to one before it."""
    goal, near = RecordedGoal("tool0", position=[-0.4, 0.3, 0.2]), np.full(6, 0.3)
    assert inverse_kinematics(ur5, goal, near).reason == ""
    tried = goal.condition(ur5).tried
    free = np.full(6, np.inf)
    seeds = [*_seeds(ur5, near, -free, free)]
    steps = 0
    for i, q in enumerate(tried):
        if any(np.array_equal(q, seed) for seed in seeds):
            continue
        steps += 1
        assert min(np.abs(q - before).max() for before in tried[:i]) <= 0.5 * (1 + 1e-12)
    assert steps > 10
