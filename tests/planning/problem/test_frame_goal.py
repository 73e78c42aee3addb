"""Task-space goals: their equations, and inverse kinematics."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.conditions.function import Function, at_state, linear
from hovi.conditions.state_difference import StateDifference
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.inverse_kinematics import nearest_configuration
from hovi.robot.robot import Robot
from oracles.finite_differences import derivative


def placement(robot: Robot, frame: str, q: np.ndarray) -> pin.SE3:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return data.oMf[robot.model.getFrameId(frame)].copy()


def goals(robot: Robot, frame: str, q: np.ndarray) -> dict[str, FrameGoal]:
    """One goal of every kind, met at q."""
    pose = placement(robot, frame, q)
    axis = ([0.0, 0.0, 2.0], pose.rotation[:, 2])
    return {
        "pose": FrameGoal(frame, pose),
        "matrix": FrameGoal(frame, pose.homogeneous),
        "position": FrameGoal(frame, position=pose.translation),
        "rotation": FrameGoal(frame, rotation=pose.rotation),
        "axis": FrameGoal(frame, axis=axis),
        "position and axis": FrameGoal(frame, position=pose.translation, axis=axis),
    }


KINDS = ("pose", "matrix", "position", "rotation", "axis", "position and axis")


@pytest.mark.parametrize("kind", KINDS)
def test_the_equations_of_a_goal_have_exact_derivatives(panda: Robot, kind: str) -> None:
    random = np.random.default_rng(1)
    target, q = random.uniform(-1, 1, (2, 7))
    error = goals(panda, "panda_hand", target)[kind].difference(panda)
    v, weights = np.zeros(7), random.standard_normal(error.size)
    c, J = linear(error, q, v)
    assert c.shape == (error.size,)
    np.testing.assert_allclose(J[:, 0], derivative(lambda x: linear(error, x, v)[0], q), atol=1e-9)
    assert not J[:, 1].any()
    slope = derivative(lambda x: weights @ linear(error, x, v)[1][:, 0], q)
    curvature = error.curvature(at_state(q, v), weights[None])[("q", "q")][0]
    np.testing.assert_allclose(curvature, slope, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_inverse_kinematics_meets_every_kind_of_goal(panda: Robot, ur5: Robot, kind: str) -> None:
    random = np.random.default_rng(2)
    for robot, frame in ((panda, "panda_hand"), (ur5, "tool0")):
        target = random.uniform(0.6 * robot.lower, 0.6 * robot.upper).clip(-2, 2)
        goal = goals(robot, frame, target)[kind]
        reached = nearest_configuration(robot, goal, robot.neutral(), (robot.lower, robot.upper))
        assert reached.reason == ""
        assert np.all(reached.q >= robot.lower)
        assert np.all(reached.q <= robot.upper)
        pose, wanted = placement(robot, frame, reached.q), placement(robot, frame, target)
        if goal.position is not None:
            np.testing.assert_allclose(pose.translation, wanted.translation, atol=1e-10)
        if goal.rotation is not None:
            assert np.linalg.norm(pin.log3(pose.rotation.T @ wanted.rotation)) < 1e-9
        if goal.axis is not None:
            np.testing.assert_allclose(pose.rotation[:, 2], wanted.rotation[:, 2], atol=1e-9)


def test_the_derivatives_are_taken_along_the_configuration_space() -> None:
    """For joints with configurations (cos, sin); a frame goal and a joint goal."""
    robot = hovi.load_robot("kinova")
    random = np.random.default_rng(3)
    q = robot.integrate(robot.neutral(), random.uniform(-1, 1, robot.nv))
    target = robot.integrate(q, random.uniform(-0.5, 0.5, robot.nv))
    v, held = np.zeros(robot.nv), np.ones((2, robot.nv), dtype=bool)
    for error in (
        goals(robot, robot.tip_frame, target)["pose"].difference(robot),
        StateDifference(robot, (target, v), held),
    ):
        weights = random.standard_normal(error.size)
        J = linear(error, q, v)[1][:, 0]

        def moved(d: np.ndarray, error: Function = error) -> np.ndarray:
            return linear(error, robot.integrate(q, d), v)[0]

        np.testing.assert_allclose(J, derivative(moved, np.zeros(robot.nv)), atol=1e-9)
        slope = derivative(
            lambda d, moved=moved, weights=weights: (
                weights @ derivative(lambda e: moved(d + e), np.zeros(robot.nv))
            ),
            np.zeros(robot.nv),
        )
        curvature = error.curvature(at_state(q, v), weights[None]).get(("q", "q"), np.zeros(1))
        np.testing.assert_allclose(curvature[0], slope, atol=1e-6)


def test_a_goal_out_of_reach_is_reported_with_its_distance(ur5: Robot) -> None:
    goal, bounds = FrameGoal("tool0", position=[3.0, 0, 0]), (ur5.lower, ur5.upper)
    reached = nearest_configuration(ur5, goal, ur5.neutral(), bounds)
    assert "frame 'tool0' misses it by" in reached.reason
    missing = float(reached.reason.split("misses it by ")[1].split(" m")[0])
    tip = placement(ur5, "tool0", reached.q).translation
    assert missing == pytest.approx(np.linalg.norm(tip - [3.0, 0, 0]), rel=1e-2)
    assert missing > 1.5


def test_half_a_turn_away_does_not_count_as_met(ur5: Robot) -> None:
    """The sines of the rotation error vanish there, too."""
    pose = placement(ur5, "tool0", np.array([0.3, -1.0, 1.2, -0.4, 0.5, 0.2]))
    turned = pose.rotation @ np.diag([1.0, -1.0, -1.0])
    goal = FrameGoal("tool0", rotation=turned)
    q = np.array([0.3, -1.0, 1.2, -0.4, 0.5, 0.2])
    assert np.max(np.abs(linear(goal.difference(ur5), q, np.zeros(6))[0])) < 1e-12
    assert goal.miss(ur5, q)[1] == pytest.approx(np.pi)


def test_bad_goals_are_refused_in_one_sentence(ur5: Robot) -> None:
    for arguments, sentence in (
        ({}, "needs a pose, a position"),
        ({"position": [0, 0]}, "three finite numbers"),
        ({"position": [0, 0, np.nan]}, "three finite numbers"),
        ({"rotation": 2 * np.eye(3)}, "orthonormal"),
        ({"rotation": -np.eye(3)}, "reflection"),
        ({"axis": ([0, 0, 0], [0, 0, 1])}, "has length zero"),
        ({"pose": np.eye(4), "position": [0, 0, 0]}, "not both"),
        ({"rotation": np.eye(3), "axis": ([0, 0, 1], [0, 0, 1])}, "not both"),
        ({"pose": np.eye(3)}, r"\(4, 4\).*for a rotation alone write rotation="),
        ({"pose": np.zeros(3)}, "for a position alone write position="),
        ({"pose": np.zeros(6)}, "for three angles write position=..., rpy="),
        ({"pose": np.zeros(7)}, "for a quaternion write position=..., quaternion_xyzw="),
        ({"pose": np.eye(5)}, r"\(5, 5\)\.$"),
        (
            {"position": [0, 0, 0], "quaternion": [1, 0, 0, 0]},
            "has no `quaternion`: did you mean 'quaternion_xyzw' or 'quaternion_wxyz'",
        ),
        ({"positon": [0, 0, 0]}, "has no `positon`: did you mean 'position'"),
    ):
        with pytest.raises(InputError, match=sentence):
            FrameGoal("tool0", **arguments)
    with pytest.raises(InputError, match="did you mean 'tool0'"):
        hovi.FrameGoal("tool", position=[0, 0, 0]).check(ur5)


def test_a_goal_of_a_frame_that_does_not_move_is_refused(ur5: Robot) -> None:
    scene, start = hovi.Scene(ur5, [hovi.effects.Gravity()]), hovi.State(ur5.neutral())
    fixed = FrameGoal("base", position=[0.0, 0.0, 0.1])
    sentence = r"frame 'base' of robot 'ur5' is fixed to the world.*one that moves is 'tool0'\.$"
    with pytest.raises(InputError, match=sentence):
        hovi.plan(scene, start, fixed, 1.0, self_collision=False)
    above = hovi.Via(0.5, fixed)
    with pytest.raises(InputError, match=sentence):
        hovi.plan(
            scene, start, hovi.State(ur5.neutral() + 0.3), 1.0, via=[above], self_collision=False
        )
