"""Extremes of a motion between its quadrature points, against dense sampling."""

from __future__ import annotations

import numpy as np
import pytest

from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.limit_violation import closeness, excess_along, worst_sentence
from hovi.planning.problem.limits import as_limits
from hovi.planning.search.planner import plan
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene


@pytest.fixture(scope="module")
def motion(arm_scene: Scene) -> Trajectory:
    """A coarse reach of the arm, without limits."""
    ends = [-np.pi / 2, 0.0], [0.3, 0.7]
    return plan(arm_scene, *ends, 1.0, intervals=5, limits="none").trajectory


LIMITS = {"base": "none", "q": 1.5, "v": [2.0, 4.0], "a": 20.0, "tau": [8.0, 3.0]}


def test_extremes_are_those_of_dense_sampling(motion: Trajectory, two_link: Robot) -> None:
    limits = as_limits(two_link, LIMITS)
    excess = excess_along(motion, limits)
    s = np.linspace(0.0, 1.0, 20_001)
    for k in range(motion.grid.intervals):
        outputs = np.stack(motion.sample_intervals(np.full(len(s), k), s), axis=1)
        dense = limits.excess(outputs).max(axis=0)
        found = np.maximum(excess.lower[k], excess.upper[k])
        near = dense > -0.05
        assert near.any()
        np.testing.assert_allclose(found[near], dense[near], atol=1e-7)
        assert (found <= dense + 1e-7).all()


def test_closeness_is_the_smallest_distance_from_the_bounds(
    motion: Trajectory, two_link: Robot
) -> None:
    limits = as_limits(two_link, LIMITS)
    excess = excess_along(motion, limits)
    room = closeness(motion, limits)
    assert room.shape == (4, 2)
    assert room.min() == pytest.approx(-excess.worst)
    assert excess.by_interval.max() == pytest.approx(excess.worst)


def test_the_worst_is_named_with_joint_time_and_numbers(
    motion: Trajectory, two_link: Robot
) -> None:
    limits = as_limits(two_link, {"base": "none", "tau": [100.0, 0.5]})
    sentence = worst_sentence(motion, limits, two_link)
    for word in ("torque", "'elbow'", "N m", "at t =", "0.5"):
        assert word in sentence


def test_sliding_joints_are_measured_in_metres(panda: Robot) -> None:
    hand = load_robot("panda")  # with its two sliding fingers
    assert hand.coordinate_units[8].v == "m/s"
    assert hand.coordinate_units[8].tau == "N"
    assert panda.coordinate_units[0].tau == "N m"
