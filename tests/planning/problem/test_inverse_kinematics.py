"""Configurations in which a frame reaches its goal: all, within limits, clear of obstacles."""

from __future__ import annotations

import itertools

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError, UnreachableError
from hovi.planning.problem.inverse_kinematics import nearest_configuration
from hovi.robot.robot import Robot
from oracles.ur5_branches import branch_count

ARMS = {"ur5": None, "panda": None, "kinova": None, "xarm7": None, "z1": "link06"}
"""Example robots, and a frame if it is not their tip."""
HALF_TURNS = np.array([0, 0, 0, 1, 0, -1])


def placement(robot: Robot, frame: str, q: np.ndarray) -> pin.SE3:
    """By Pinocchio's forward kinematics."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    return pin.updateFramePlacement(robot.model, data, robot.model.getFrameId(frame)).copy()


def random_configuration(robot: Robot, random: np.random.Generator) -> np.ndarray:
    """Within the limits, and within a turn."""
    limits = hovi.as_limits(robot, "urdf")
    low, high = np.maximum(limits.lower[0], -np.pi), np.minimum(limits.upper[0], np.pi)
    angles = low + (high - low) * random.random(robot.nv)
    return robot.integrate(robot.neutral(), angles)


def is_within_limits(robot: Robot, q: np.ndarray) -> bool:
    indices, _ = robot.space.plain
    inside = (q[:, indices] >= robot.lower[indices]) & (q[:, indices] <= robot.upper[indices])
    return bool(inside.all())


@pytest.mark.parametrize("name", ARMS)
def test_random_poses_of_arms_are_met_to_a_nanometre(name: str) -> None:
    robot, random = hovi.load_robot(name), np.random.default_rng(7)
    frame = ARMS[name] or robot.tip_frame
    for _ in range(30):
        pose = placement(robot, frame, random_configuration(robot, random))
        found = hovi.inverse_kinematics(robot, hovi.FrameGoal(frame, pose))
        assert is_within_limits(robot, found)
        for q in found:
            reached = placement(robot, frame, q)
            assert np.linalg.norm(reached.translation - pose.translation) < 1e-9
            assert np.linalg.norm(pin.log3(reached.rotation.T @ pose.rotation)) < 1e-9


def test_all_branches_of_a_ur5_are_found(ur5: Robot) -> None:
    """As many as the geometry of its axes says, up to eight."""
    random, counts = np.random.default_rng(1), []
    for _ in range(60):
        pose = ur5.frame_pose("tool0", random.uniform(-3, 3, 6))
        expected = branch_count(pose)
        if expected is None:
            continue
        found = hovi.inverse_kinematics(ur5, hovi.FrameGoal("tool0", pose))
        assert len(found) == expected
        for one, other in itertools.combinations(found, 2):
            assert np.abs(np.remainder(one - other + np.pi, 2 * np.pi) - np.pi).max() > 1e-3
        counts.append(expected)
    assert set(counts) == {2, 4, 6, 8}


def test_the_configuration_nearest_to_the_given_one_comes_first(ur5: Robot) -> None:
    """At the turn that is nearest to it, too."""
    random = np.random.default_rng(2)
    for _ in range(10):
        q = random.uniform(-3, 3, 6)
        goal, near = hovi.FrameGoal("tool0", ur5.frame_pose("tool0", q)), q + 0.02
        near[0] += 2 * np.pi * (-1 if near[0] > 0 else 1)
        found = hovi.inverse_kinematics(ur5, goal, near=near)
        distance = np.linalg.norm(found - near, axis=1)
        assert (np.diff(distance) >= 0).all()
        np.testing.assert_allclose(np.abs(found[0] - q), [2 * np.pi, 0, 0, 0, 0, 0], atol=1e-8)
        nearer = found + 2 * np.pi * np.round((near - found) / (2 * np.pi))
        assert ((nearer == found) | (np.abs(nearer) > ur5.upper)).all()
        alone = hovi.inverse_kinematics(ur5, goal, near=near, most=1)
        np.testing.assert_allclose(alone[0], found[0], atol=1e-8)


def test_half_a_turn_from_the_given_configuration_a_branch_is_found_once(ur5: Robot) -> None:
    """Where rounding decides between the turns on both sides."""
    random = np.random.default_rng(6)
    for _ in range(10):
        q = random.uniform(-1.5, 1.5, 6)
        goal = hovi.FrameGoal("tool0", ur5.frame_pose("tool0", q))
        found = hovi.inverse_kinematics(ur5, goal, near=q + np.pi * HALF_TURNS)
        turns = np.exp(1j * found)
        for one, other in itertools.combinations(turns, 2):
            assert np.abs(one - other).max() > 1e-3


@pytest.mark.parametrize("kind", ["pose", "position", "rotation", "axis", "position and axis"])
@pytest.mark.parametrize("name", ["kinova", "panda"])
def test_every_kind_of_goal_is_met(name: str, kind: str) -> None:
    """By joints that turn without limits, and by more of them than there are equations."""
    robot = hovi.load_robot(name)
    frame, q = robot.tip_frame, random_configuration(robot, np.random.default_rng(3))
    wanted = placement(robot, frame, q)
    axis = ([0.0, 0.0, 2.0], wanted.rotation[:, 2])
    goal = {
        "pose": hovi.FrameGoal(frame, wanted),
        "position": hovi.FrameGoal(frame, position=wanted.translation),
        "rotation": hovi.FrameGoal(frame, rotation=wanted.rotation),
        "axis": hovi.FrameGoal(frame, axis=axis),
        "position and axis": hovi.FrameGoal(frame, position=wanted.translation, axis=axis),
    }[kind]
    found = hovi.inverse_kinematics(robot, goal)
    assert len(found) >= 4
    for each in found:
        reached = placement(robot, frame, robot.check_configuration(each, "q"))
        if goal.position is not None:
            np.testing.assert_allclose(reached.translation, wanted.translation, atol=1e-9)
        if goal.rotation is not None:
            assert np.linalg.norm(pin.log3(reached.rotation.T @ wanted.rotation)) < 1e-9
        if goal.axis is not None:
            np.testing.assert_allclose(reached.rotation[:, 2], wanted.rotation[:, 2], atol=1e-9)


def test_half_a_turn_away_from_its_goal_a_frame_is_turned_there(ur5: Robot) -> None:
    """Where the sine of the rotation error vanishes."""
    q = np.array([0.3, -1.0, 1.2, -0.4, 0.5, 0.2])
    pose = ur5.frame_pose("tool0", q)
    for turn in (np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1])):
        turned = pose[:3, :3] @ turn
        for goal in (
            hovi.FrameGoal("tool0", rotation=turned),
            hovi.FrameGoal("tool0", axis=([1, 0, 0], turned[:, 0])),
        ):
            found = hovi.inverse_kinematics(ur5, goal, near=q, seeds=1)
            assert max(goal.miss(ur5, found[0])) < 1e-9


@pytest.mark.parametrize("signs", [*itertools.product([-1, 1], repeat=2)])
def test_limits_leave_the_branches_within_them(ur5: Robot, signs: tuple[int, int]) -> None:
    """One side of the elbow, and one half of the first joint's turn."""
    q = np.array([1.2 * signs[0], -1.0, 1.1 * signs[1], 0.4, 0.6, 0.2])
    goal = hovi.FrameGoal("tool0", ur5.frame_pose("tool0", q))
    ranges = [[-3.0, 3.0]] * 6
    ranges[0] = sorted((0.2 * signs[0], 3.0 * signs[0]))
    ranges[2] = sorted((0.2 * signs[1], 3.0 * signs[1]))
    found = hovi.inverse_kinematics(ur5, goal, limits={"base": "none", "q": ranges})
    assert np.abs(found - q).max(axis=1).min() < 1e-8
    assert (found >= np.array(ranges)[:, 0]).all()
    assert (found <= np.array(ranges)[:, 1]).all()
    free = hovi.inverse_kinematics(ur5, goal, limits="none")
    assert len(found) < len(free) == 8


def test_joints_that_do_not_move_the_frame_keep_their_values() -> None:
    panda = hovi.load_robot("panda")
    pose = panda.frame_pose("panda_hand", panda.pose("default"))
    near = panda.pose("default")
    near[-2:] = 0.03, 0.012
    found = hovi.inverse_kinematics(panda, hovi.FrameGoal("panda_hand", pose), near=near)
    np.testing.assert_array_equal(found[:, -2:], np.tile(near[-2:], (len(found), 1)))


def test_configurations_in_obstacles_are_left_out(ur5: Robot) -> None:
    """A ball at one elbow leaves the branches whose elbow is elsewhere."""
    q = np.array([0.4, -1.3, 1.4, -0.6, 0.7, 0.1])
    goal = hovi.FrameGoal("tool0", ur5.frame_pose("tool0", q))
    ball = hovi.Sphere(ur5.frame_position("forearm_link", q[None])[0], 0.02)
    every = hovi.inverse_kinematics(ur5, goal)
    clear = hovi.inverse_kinematics(ur5, goal, obstacles=[ball])
    assert 0 < len(clear) < len(every)
    elbows = ur5.frame_position("forearm_link", clear)
    assert np.linalg.norm(elbows - ball.position, axis=1).min() > 0.03
    at_goal = hovi.Sphere(ur5.frame_position("tool0", q[None])[0], 0.1)
    with pytest.raises(UnreachableError, match="configurations that were found, but all of them"):
        hovi.inverse_kinematics(ur5, goal, obstacles=[at_goal])


@pytest.mark.parametrize("target", [[3.0, 0.0, 0.0], [0.0, 0.0, 0.089]])
def test_a_pose_out_of_reach_is_refused_with_the_nearest_configuration(
    ur5: Robot, target: list[float]
) -> None:
    """Too far away, and inside the shoulder."""
    goal = hovi.FrameGoal("tool0", position=target, rpy=[0.0, 0.5, 0.0])
    with pytest.raises(
        UnreachableError, match="at the nearest, frame 'tool0' misses it by"
    ) as told:
        hovi.inverse_kinematics(ur5, goal)
    distance, angle = goal.miss(ur5, told.value.q)
    assert f"misses it by {distance:.3g} m and {angle:.3g} rad" in str(told.value)
    assert distance + angle > 1e-3
    if target[0]:  # stretched towards it, but for what the angle is worth
        assert 2.0 < distance < 2.3


@pytest.mark.parametrize(("beyond", "is_met"), [(-1e-3, True), (0.0, True), (4e-6, False)])
def test_a_goal_a_few_micrometres_beyond_the_reach_is_not_met(
    two_link: Robot, beyond: float, is_met: bool
) -> None:
    """The arm reaches 2.5 m, the sum of its links."""
    goal = hovi.FrameGoal("tip", position=[0.0, 0.0, -2.5 - beyond])
    free = np.full(2, -np.inf), np.full(2, np.inf)
    found = nearest_configuration(two_link, goal, np.array([-1.2, 0.3]), free)
    assert (found.reason == "") == is_met


def test_sliding_joints_and_ranges_of_half_a_turn_are_kept(models) -> None:
    robot = hovi.load_robot(models / "cart_pole.urdf")
    frame, q = robot.tip_frame, np.array([0.7, 0.4])
    goal = hovi.FrameGoal(frame, position=robot.frame_position(frame, q[None])[0])
    found = hovi.inverse_kinematics(robot, goal, near=q)
    np.testing.assert_allclose(found[0], q, atol=1e-9)
    assert is_within_limits(robot, found)


def test_one_configuration_or_many_have_a_pose(panda: Robot) -> None:
    random = np.random.default_rng(5)
    q = random.uniform(-1, 1, (2, 3, 7))
    poses = panda.frame_pose("panda_hand", q)
    assert poses.shape == (2, 3, 4, 4)
    for index in np.ndindex(2, 3):
        wanted = placement(panda, "panda_hand", q[index]).homogeneous
        np.testing.assert_allclose(poses[index], wanted, atol=1e-15)
        np.testing.assert_array_equal(panda.frame_pose("panda_hand", q[index]), poses[index])
    with pytest.raises(InputError, match=r"q must have shape \(..., 7\)"):
        panda.frame_pose("panda_hand", np.zeros(6))
    with pytest.raises(InputError, match="no frame 'hand'"):
        panda.frame_pose("hand", np.zeros(7))


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"near": np.zeros(5)}, r"near has shape \(5,\)"),
        ({"near": "home"}, "has no pose 'home'"),
        ({"most": 0}, "most must be a whole number from 1"),
        ({"seeds": 1.5}, "seeds must be a whole number"),
        ({"limits": "tight"}, "tight"),
        ({"obstacles": [1]}, "an obstacle must be"),
    ],
)
def test_bad_arguments_are_refused_in_one_sentence(ur5: Robot, given: dict, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        hovi.inverse_kinematics(ur5, hovi.FrameGoal("tool0", position=[0.4, 0, 0.3]), **given)
