"""Joints locked at given positions, with the joints that mimic them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError, ModelError
from hovi.robot.robot import Robot

FINGERS = "panda_leftfinger", "panda_rightfinger"


def places(robot: Robot, q: np.ndarray) -> list[np.ndarray]:
    """Where the collision shapes are."""
    data, shapes = robot.model.createData(), robot.collision
    assert shapes is not None
    placed = shapes.createData()
    pin.updateGeometryPlacements(robot.model, data, shapes, placed, q)
    return [place.homogeneous for place in placed.oMg]


@pytest.mark.parametrize("mimic", [False, True])
@pytest.mark.parametrize("opening", [0.0, 0.03])
def test_a_hand_is_locked_at_its_opening(opening: float, mimic: bool) -> None:
    """The second finger mimics the first."""
    free = hovi.load_robot("panda")
    robot = hovi.load_robot("panda", locked={"panda_finger_joint1": opening}, mimic=mimic)
    assert robot.nq == 7
    q = np.random.default_rng(1).uniform(-1, 1, 7)
    for finger in FINGERS:
        np.testing.assert_allclose(
            robot.frame_pose(finger, q),
            free.frame_pose(finger, np.array([*q, opening, opening])),
            atol=1e-15,
        )
    again = Robot.from_dict(robot.to_dict())
    np.testing.assert_array_equal(again.frame_pose(FINGERS[1], q), robot.frame_pose(FINGERS[1], q))


def test_shapes_and_masses_move_with_the_locked_joint() -> None:
    """An elbow at a right angle, of a UR5."""
    free, robot = hovi.load_robot("ur5"), hovi.load_robot("ur5", locked={"elbow_joint": 1.5})
    q = np.array([0.3, -1.0, 1.5, 0.4, 0.5, 0.6])
    kept = np.delete(q, 2)
    gravity = [hovi.effects.Gravity()]
    zero = np.zeros((1, 6))
    tau = hovi.Scene(free, gravity).inverse_dynamics(q[None], zero, zero)[0]
    less = hovi.Scene(robot, gravity).inverse_dynamics(kept[None], zero[:, :5], zero[:, :5])[0]
    np.testing.assert_allclose(less, np.delete(tau, 2), atol=1e-12)
    assert robot.collision is not None
    assert free.collision is not None
    assert robot.collision.ngeoms == free.collision.ngeoms
    for one, other in zip(places(robot, kept), places(free, q), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    assert "elbow_joint at 1.5" in robot.describe()


def test_a_continuous_joint_is_locked_at_an_angle() -> None:
    free, robot = (
        hovi.load_robot("kinova", locked=locked) for locked in ((), {"j2s6s200_joint_1": 0.7})
    )
    q = robot.neutral()
    whole = np.concatenate([[np.cos(0.7), np.sin(0.7)], q])
    np.testing.assert_allclose(
        robot.frame_pose("j2s6s200_end_effector", q),
        free.frame_pose("j2s6s200_end_effector", whole),
        atol=1e-15,
    )


SCISSORS = """<robot name="scissors"><link name="base"/>{links}</robot>"""
BLADE = """<link name="{name}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0"
 ixz="0" iyz="0"/></inertial></link><joint name="{name}_joint" type="revolute"><parent link="base"/>
 <child link="{name}"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/>
 {mimic}</joint>"""


@pytest.mark.parametrize("mimic", [False, True])
def test_a_follower_is_locked_at_its_multiple_and_offset(tmp_path: Path, mimic: bool) -> None:
    tag = '<mimic joint="one_joint" multiplier="-2" offset="0.1"/>'
    links = BLADE.format(name="one", mimic="") + BLADE.format(name="two", mimic=tag)
    file = tmp_path / "scissors.urdf"
    file.write_text(SCISSORS.format(links=links))
    robot = hovi.load_robot(file, locked={"one_joint": 0.4}, mimic=mimic)
    turn = robot.frame_pose("two", robot.neutral())
    np.testing.assert_allclose(turn[:2, 0], [np.cos(0.7), -np.sin(0.7)], atol=1e-15)


@pytest.mark.parametrize(
    ("locked", "error", "sentence"),
    [
        ({"panda_finger_joint1": 1.0}, ModelError, "cannot be locked at 1: its range is 0 to 0.04"),
        ({"panda_finger": 0.01}, ModelError, "has no joint 'panda_finger'"),
        ({"panda_finger_joint1": "open"}, InputError, "their positions in rad or m"),
        ({"panda_finger_joint1": np.nan}, InputError, "their positions in rad or m"),
        ({"panda_finger_joint1": True}, InputError, "their positions in rad or m"),
        ({"panda_finger_joint1": np.complex128(0.01)}, InputError, "their positions in rad or m"),
        (
            {"panda_finger_joint1": np.timedelta64(0, "s")},
            InputError,
            "their positions in rad or m",
        ),
        ({1: 0.0}, InputError, "names of joints"),
    ],
)
def test_other_positions_are_refused(locked: dict, error: type, sentence: str) -> None:
    with pytest.raises(error, match=sentence):
        hovi.load_robot("panda", locked=locked)


def test_a_floating_base_is_locked_at_its_neutral_place_only() -> None:
    with pytest.raises(ModelError, match="6 degrees of freedom"):
        hovi.load_robot("ur5", free_flyer=True, locked={"root_joint": 0.5})
    assert hovi.load_robot("ur5", free_flyer=True, locked={"root_joint": 0.0}).nq == 6


FILE = """robot = "panda"
duration = 2
locked = {locked}
start = {{ q = [0, 0, 0, -1, 0, 1, 0] }}
goal = {{ q = [0.1, 0, 0, -1, 0, 1, 0] }}
[effects.gravity]
"""


def test_scene_files_lock_joints_at_positions(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(FILE.format(locked="{ panda_finger_joint1 = 0.03 }"))
    task = hovi.load_task(path)
    saved = hovi.save_task(task, tmp_path / "again.toml")
    for robot in (task.scene.robot, hovi.load_task(saved).scene.robot):
        assert robot.source.held == {"panda_finger_joint1": 0.03, "panda_finger_joint2": 0.03}
    path.write_text(FILE.format(locked="{ panda_finger_joint1 = 'open' }"))
    with pytest.raises(hovi.HoviError, match="`locked"):
        hovi.load_task(path)
