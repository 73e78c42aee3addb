"""A name that a link and a joint share stands for the link, wherever a frame is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import hovi

LINK = """<link name="{0}"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0.2 0 0"/><geometry><sphere radius="0.05"/></geometry></collision></link>"""
JOINT = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>
<origin xyz="{3} 0 0"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" velocity="5" effort="100"/></joint>"""


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> hovi.Robot:
    """Joint "arm" moves link "upper", and joint "elbow" moves link "arm"."""
    parts = [*map(LINK.format, ("base", "upper", "arm"))]
    parts += [
        JOINT.format("arm", "base", "upper", 0.0),
        JOINT.format("elbow", "upper", "arm", 0.4),
    ]
    path: Path = tmp_path_factory.mktemp("robot") / "crossed.urdf"
    path.write_text(f'<robot name="crossed">{"".join(parts)}</robot>')
    return hovi.load_robot(path)


def link_pose(robot: hovi.Robot, q: np.ndarray) -> pin.SE3:
    """Of link "arm": joint 2 carries it."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    return data.oMi[2]


Q = np.array([0.3, -0.7])


def test_positions_and_poses_are_those_of_the_link(robot: hovi.Robot) -> None:
    expected = link_pose(robot, Q)
    np.testing.assert_allclose(robot.frame_position("arm", Q), expected.translation, atol=1e-12)
    np.testing.assert_allclose(robot.frame_pose("arm", Q), expected.homogeneous, atol=1e-12)


def test_a_payload_is_carried_by_the_link(robot: hovi.Robot) -> None:
    scene = hovi.Scene(robot, [hovi.effects.Gravity(), hovi.effects.Payload("arm", 2.0)])
    model = robot.model.copy()
    model.inertias[2] += pin.Inertia(2.0, np.zeros(3), np.zeros((3, 3)))
    v, a = np.array([0.5, 1.0]), np.array([-1.0, 2.0])
    expected = pin.rnea(model, model.createData(), Q, v, a)
    np.testing.assert_allclose(scene.inverse_dynamics([Q], [v], [a])[0], expected, atol=1e-9)


def test_a_wrench_acts_on_the_link(robot: hovi.Robot) -> None:
    force = np.array([3.0, 0.0, -2.0])
    push = hovi.effects.Wrench("arm", tuple(force))
    still = np.zeros((1, 2))
    tau = hovi.Scene(robot, [push]).inverse_dynamics([Q], still, still)[0]
    J = pin.computeJointJacobian(robot.model, robot.model.createData(), Q, 2)
    R = link_pose(robot, Q).rotation
    np.testing.assert_allclose(tau, -(R @ J[:3]).T @ force, atol=1e-9)


def test_a_frame_goal_beside_an_obstacle_is_met_by_the_link(robot: hovi.Robot) -> None:
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    goal = hovi.FrameGoal("arm", position=link_pose(robot, Q).translation)
    found = hovi.plan(
        *(scene, [0.0, 0.0], goal, 1.0),
        **{"obstacles": [hovi.Sphere([0.0, 0.0, 2.0], 0.1)], "self_collision": False},
    )
    assert found.success, found.message
    end = link_pose(robot, found.trajectory.q[-1]).translation
    np.testing.assert_allclose(end, goal.position, atol=1e-6)


def test_a_goal_in_an_obstacle_is_refused_for_the_link(robot: hovi.Robot) -> None:
    at = link_pose(robot, Q).translation
    found = hovi.plan(
        *(hovi.Scene(robot), [2.0, 0.0], hovi.FrameGoal("arm", position=at), 1.0),
        **{"obstacles": [hovi.Sphere(at, 0.3, name="ball")], "self_collision": False},
    )
    assert found.status == "infeasible"
    assert "link 'arm' and obstacle 'ball'" in found.message


def test_what_a_shared_name_stands_for_is_noted(robot: hovi.Robot) -> None:
    assert "several frames are named 'arm': the name stands for the link" in robot.describe()
    assert "several frames" not in hovi.load_robot("z1").describe()


def test_a_shared_name_of_one_place_is_the_same_for_both() -> None:
    robot = hovi.load_robot("z1", locked=["jointGripper"])
    q = np.array([0.1, 1.0, -1.0, 0.2, 0.1, 0.3])
    load, rotors = hovi.effects.Payload("gripperStator", 1.0), hovi.effects.Armature(0.1)
    scene = hovi.Scene(robot, [hovi.effects.Gravity(), load, rotors])
    at = robot.frame_position("gripperStator", q)
    found = hovi.plan(
        *(scene, q + 0.05, hovi.FrameGoal("gripperStator", position=at), 1.0),
        **{"obstacles": [hovi.Sphere([1.5, 0, 0.3], 0.1)], "self_collision": False},
        **{"intervals": 16, "limits": "none"},
    )
    assert found.success, found.message
    end = robot.frame_position("gripperStator", found.trajectory.q[-1])
    np.testing.assert_allclose(end, at, atol=1e-6)
