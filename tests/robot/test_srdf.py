"""Poses and disabled pairs of SRDFs, against Pinocchio's own reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import HoviError, InputError, ModelError
from hovi.robot.example_robots import example_robot
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.robot.srdf import checked_pairs, parse_srdf

ARM = """<robot name="two_link">
  <group_state name="ready" group="arm">
    <joint name="shoulder" value="-1.5"/><joint name="elbow" value="0.25"/>
  </group_state>
  <group_state name="bent" group="arm"><joint name="elbow" value="2"/></group_state>
  <group_state name="elsewhere" group="arm"><joint name="gripper" value="2"/></group_state>
  <disable_collisions link1="base" link2="forearm" reason="Never"/>
</robot>"""


@pytest.mark.parametrize("name", ["panda", "z1", "talos", "solo12", "anymal"])
def test_poses_match_pinocchio(name: str) -> None:
    robot = load_robot(name)
    srdf = example_robot(name).srdf
    model = robot.model.copy()
    pin.loadReferenceConfigurations(model, str(srdf), False)
    theirs = {each.key(): np.array(each.data()) for each in model.referenceConfigurations}
    assert set(robot.poses) == set(theirs)
    for pose, q in theirs.items():
        np.testing.assert_allclose(robot.poses[pose], pin.normalize(model, q), atol=1e-12)


@pytest.mark.parametrize("name", ["panda", "ur5", "anymal"])
def test_checked_pairs_match_pinocchio_without_adjacent_links(name: str) -> None:
    robot = load_robot(name)
    geometry = robot.collision
    assert geometry is not None
    theirs = geometry.copy()
    theirs.addAllCollisionPairs()
    pin.removeCollisionPairs(robot.model, theirs, str(example_robot(name).srdf), False)
    parents = list(robot.model.parents)

    def apart(i: int, j: int) -> bool:
        a, b = (geometry.geometryObjects[k].parentJoint for k in (i, j))
        return parents[a] != b and parents[b] != a and a != b

    left = {(p.first, p.second) for p in theirs.collisionPairs if apart(p.first, p.second)}
    assert set(checked_pairs(robot.model, geometry, robot.semantics.disabled)) == left
    assert left


def test_joints_that_a_pose_does_not_list_are_neutral(models: Path, tmp_path: Path) -> None:
    (tmp_path / "arm.srdf").write_text(ARM)
    robot = load_robot(models / "two_link.urdf", srdf=tmp_path / "arm.srdf")
    assert {name: list(q) for name, q in robot.poses.items()} == {
        "ready": [-1.5, 0.25],
        "bent": [0.0, 2.0],
    }
    assert robot.semantics.disabled == {frozenset({"base", "forearm"})}
    with pytest.raises(InputError, match=r"no pose 'redy': did you mean 'ready'\?"):
        robot.pose("redy")
    again = Robot.from_dict(robot.to_dict())
    assert again.poses.keys() == robot.poses.keys()


def test_continuous_joints_take_angles() -> None:
    robot = load_robot("kinova")
    (angle,) = robot.semantics.states["arm_up"]["j2s6s200_joint_1"]
    joint = robot.model.joints[robot.model.getJointId("j2s6s200_joint_1")]
    q = robot.pose("arm_up")[joint.idx_q : joint.idx_q + 2]
    np.testing.assert_allclose(q, [np.cos(angle), np.sin(angle)], atol=1e-15)


def test_a_motion_is_planned_between_poses(models: Path, tmp_path: Path) -> None:
    (tmp_path / "arm.srdf").write_text(ARM)
    robot = load_robot(models / "two_link.urdf", srdf=tmp_path / "arm.srdf")
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    solution = hovi.plan(scene, "ready", "bent", 1.0)
    assert solution.success
    np.testing.assert_array_equal(solution.trajectory.q[[0, -1]], [[-1.5, 0.25], [0.0, 2.0]])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<robot><group_state", "not well-formed"),
        ("<model/>", "<robot>, not <model>"),
        ("<robot><group_state/></robot>", "lacks its attribute 'name'"),
        (ARM.replace('value="2"', 'value="nan"'), "must be plain finite numbers .* got 'nan'"),
        (ARM.replace('value="2"', 'value="1,5"'), "must be plain finite numbers .* got '1,5'"),
        (ARM.replace('value="2"', 'value="1_0"'), "must be plain finite numbers .* got '1_0'"),
        (ARM.replace('value="2"', 'value="\u0663"'), "must be plain finite numbers .* got"),
        (ARM.replace('value="2"', 'value="1e300"'), r"at most 1e\+12, got '1e300'"),
        ('<!DOCTYPE robot [<!ENTITY a "b">]><robot/>', "no DOCTYPE"),
    ],
)
def test_a_broken_srdf_is_refused_in_one_sentence(text: str, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        parse_srdf(text)


def test_a_joint_with_too_many_numbers_is_named(models: Path, tmp_path: Path) -> None:
    (tmp_path / "arm.srdf").write_text(ARM.replace('value="2"', 'value="2 3"'))
    robot = load_robot(models / "two_link.urdf", srdf=tmp_path / "arm.srdf")
    with pytest.raises(ModelError, match="pose 'bent' gives joint 'elbow' 2 numbers; it takes 1"):
        robot.pose("bent")


@pytest.mark.parametrize(("joint", "value"), [("elbow", "0 0"), ("root_joint", "1 2 3 0 0 0 0")])
def test_a_rotation_of_length_zero_is_refused(
    joint: str, value: str, models: Path, tmp_path: Path
) -> None:
    text = (models / "two_link.urdf").read_text().replace("revolute", "continuous")
    (tmp_path / "arm.urdf").write_text(text)
    (tmp_path / "arm.srdf").write_text(
        f'<robot name="arm"><group_state name="zero"><joint name="{joint}" value="{value}"/>'
        "</group_state></robot>"
    )
    robot = load_robot(tmp_path / "arm.urdf", srdf=tmp_path / "arm.srdf", free_flyer=True)
    with pytest.raises(ModelError, match="pose 'zero' gives a joint zeros"):
        robot.pose("zero")


def test_a_missing_srdf_is_refused(models: Path) -> None:
    with pytest.raises(HoviError, match="cannot read the SRDF"):
        load_robot(models / "two_link.urdf", srdf="nowhere.srdf")
