"""Rotations by roll, pitch and yaw, and by quaternions whose order is named."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError


def test_rpy_is_what_a_urdf_means_by_it() -> None:
    """The joint of a URDF with this origin has this placement."""
    rpy = [0.4, -0.9, 2.1]
    text = (
        '<robot name="one"><link name="a"/><link name="b"/><joint name="j" type="revolute">'
        f'<origin rpy="{rpy[0]} {rpy[1]} {rpy[2]}"/><parent link="a"/><child link="b"/>'
        '<axis xyz="0 0 1"/><limit effort="1" velocity="1"/></joint></robot>'
    )
    wanted = pin.buildModelFromXML(text).jointPlacements[1].rotation
    np.testing.assert_allclose(hovi.FrameGoal("b", rpy=rpy).rotation, wanted, atol=1e-15)


def test_quaternions_are_read_in_the_order_of_their_name() -> None:
    """By Rodrigues' formula about an axis without symmetry."""
    axis, angle = np.array([2.0, -1.0, 2.0]) / 3, 0.7
    w, (x, y, z) = np.cos(angle / 2), np.sin(angle / 2) * axis
    K = np.cross(axis, np.eye(3)).T  # K v = axis x v
    wanted = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    for goal in (
        hovi.FrameGoal("tip", quaternion_xyzw=[x, y, z, w]),
        hovi.FrameGoal("tip", quaternion_wxyz=[w, x, y, z]),
        hovi.FrameGoal("tip", quaternion_wxyz=np.round([w, x, y, z], 4)),
    ):
        np.testing.assert_allclose(goal.rotation, wanted, atol=2e-4)
        np.testing.assert_allclose(goal.rotation @ goal.rotation.T, np.eye(3), atol=1e-15)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"rpy": [0.1, 0.2]}, "the rpy of a frame goal must be three finite numbers"),
        ({"rpy": [0.1, 0.2, np.nan]}, "three finite numbers"),
        ({"quaternion_xyzw": [0, 0, 1]}, "must be four finite numbers"),
        ({"quaternion_wxyz": [0, 0, 0, 0]}, "must have length 1"),
        ({"quaternion_wxyz": [1, 1, 0, 0]}, "of length 1.414: divide it by its length"),
        ({"rpy": [0, 0, 0], "rotation": np.eye(3)}, "leave out rotation or rpy"),
        ({"rpy": [0, 0, 0], "axis": ([0, 0, 1], [0, 0, 1])}, "leave out rpy or axis"),
        ({"rpy": [0, 0, 0], "pose": np.eye(4)}, "not both"),
    ],
)
def test_other_rotations_are_refused_in_one_sentence(given: dict, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        hovi.FrameGoal("tip", **given)
