"""Closed loops that a URDF states by other programs' elements are named, not dropped in silence."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

import hovi
from hovi.errors import HoviWarning

LINK = """<link name="{name}"><inertial><mass value="1"/><origin xyz="0 0 0.1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="j_{child}" type="continuous"><parent link="{parent}"/>
<child link="{child}"/><axis xyz="0 1 0"/></joint>"""
CHAIN = (("base", "crank"), ("crank", "coupler"), ("base", "rocker"))
TIES = {
    "loop_joint": (
        '<loop_joint name="pin" type="revolute"><link1 link="coupler"/><link2 link="rocker"/>'
        "</loop_joint>"
    ),
    "drake:ball_constraint": (
        '<drake:ball_constraint><drake:ball_constraint_body_A name="coupler"/>'
        '<drake:ball_constraint_body_B name="rocker"/></drake:ball_constraint>'
    ),
    "joint": (
        '<gazebo><joint name="pin" type="revolute"><parent>coupler</parent><child>rocker</child>'
        "</joint></gazebo>"
    ),
    "connect": (
        '<mujoco><equality><connect body1="coupler" body2="rocker" anchor="0 0 0"/></equality>'
        "</mujoco>"
    ),
}


def four_bar(folder: Path, tie: str) -> Path:
    """A URDF of three moving links with a further element."""
    links = "".join(LINK.format(name=name) for name in ("base", "crank", "coupler", "rocker"))
    joints = "".join(JOINT.format(parent=parent, child=child) for parent, child in CHAIN)
    path = folder / "bar.urdf"
    path.write_text(f'<robot name="bar">{links}{joints}{tie}</robot>')
    return path


@pytest.mark.parametrize("tag", TIES)
def test_a_loop_is_warned_of_and_noted(tag: str, tmp_path: Path) -> None:
    path = four_bar(tmp_path, TIES[tag])
    said = f"<{tag}> of 'coupler' and 'rocker'"
    with pytest.warns(HoviWarning, match=f"'bar.urdf': its links move freely, without {said}"):
        robot = hovi.load_robot(path)
    assert robot.nv == 3
    assert f"not kept, so that its links move freely: {said}" in robot.describe()


@pytest.mark.parametrize(
    "tie", ["", "<gazebo reference='crank'><mu1>0.2</mu1></gazebo>", "<mujoco/>"]
)
def test_a_tree_is_loaded_without_a_word(tie: str, tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        robot = hovi.load_robot(four_bar(tmp_path, tie))
    assert "move freely" not in robot.describe()
