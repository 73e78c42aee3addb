"""Task-space goals inside obstacles, and no others, are infeasible before any solve."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi import Status
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import Distances
from hovi.planning.clearance.obstacles import Box, Capsule, Obstacle, Sphere
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goal_clearance import goal_distances
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot

OBSTACLES: list[Obstacle] = [
    Sphere([0.45, 0.25, 0.30], 0.1, name="ball"),
    Box([0.2, 0.3, 0.1], [0.3, -0.2, 0.5], name="box"),
    Capsule([[0.2, 0.4, 0.1], [0.3, 0.4, 0.6]], 0.05, name="pole"),
]
START = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1]


@pytest.fixture(scope="module")
def ur5() -> Robot:
    return load_robot("ur5")


@pytest.fixture(scope="module")
def distances(ur5: Robot) -> Distances:
    return Distances(ur5, Clearance(OBSTACLES, 0.02))


def placed(robot: Robot, q: np.ndarray) -> pin.SE3:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return data.oMf[robot.model.getFrameId("tool0")]


@pytest.mark.parametrize("seed", range(20))
def test_a_pose_gives_the_distances_of_its_link_and_a_position_a_bound(
    seed: int, ur5: Robot, distances: Distances
) -> None:
    q = np.random.default_rng(seed).uniform(-2.5, 2.5, 6)
    pose, measured = placed(ur5, q), distances.values(q[None])[0]
    actual = {
        pair: min(d for other, d in zip(distances.pairs, measured, strict=True) if other == pair)
        for pair in distances.pairs
    }
    exact = goal_distances(FrameGoal("tool0", pose), distances)
    bounds = goal_distances(FrameGoal("tool0", position=pose.translation), distances)
    assert len(exact) == len(bounds) > 0
    for pair, d in exact.items():
        assert d == pytest.approx(actual[pair], abs=1e-5)
        assert bounds[pair] >= actual[pair] - 1e-5


@pytest.mark.parametrize("turned", [{}, {"axis": ([0, 0, 1], [0, 0, -1])}])
@pytest.mark.parametrize("what", ["goal", "via point"])
def test_a_goal_in_a_ball_is_infeasible_at_once(
    turned: dict[str, Any], what: str, ur5: Robot
) -> None:
    scene = hovi.Scene(ur5, [hovi.effects.Gravity()])
    inside = FrameGoal("tool0", position=[0.45, 0.25, 0.25], **turned)
    ends = {"goal": inside} if what == "goal" else {"goal": START, "via": [hovi.Via(1.0, inside)]}
    found = hovi.plan(
        scene,
        START,
        duration=2.0,
        obstacles=OBSTACLES[:1],
        limits="none",
        **ends,
        self_collision=False,
    )
    assert (found.status, found.nit) == (Status.INFEASIBLE, 0)
    assert f"with frame 'tool0' at the {what}, link 'wrist_3_link' and obstacle" in found.message
    assert "'ball' overlap by 0.0495 m or come closer" in found.message
