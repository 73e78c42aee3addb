"""Oddities of real URDFs that change no robot are noted, and the same robot is loaded.

Each is put into a plain file. The model must be that of Pinocchio's own reader where that accepts
the file, and of the plain file otherwise; what could change the robot is refused.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.cli.application import main
from hovi.errors import ModelError

ARM = """<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
<link name="base"/>
<link name="rod"><inertial><origin xyz="0.1 0.2 0.3"/><mass value="2"/>
<inertia ixx="0.3" ixy="0.01" ixz="0.02" iyy="0.2" iyz="0.03" izz="0.1"/></inertial>
<visual><geometry><box size="1 0.1 0.1"/></geometry><material name="red"/></visual>
<collision><geometry><mesh filename="rod.stl" scale="2 2 2"/></geometry></collision></link>
<link name="camera"><inertial><mass value="0.3"/>
<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
<link name="finger"><inertial><mass value="0.1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="2" effort="10" velocity="3"/></joint>
<joint name="mount" type="fixed"><parent link="rod"/><child link="camera"/>
<origin xyz="0 0.5 0"/><axis xyz="0 0 1"/></joint>
<joint name="grip" type="prismatic"><parent link="rod"/><child link="finger"/><axis xyz="1 0 0"/>
<limit lower="-0.1" upper="0" effort="10" velocity="3"/><mimic joint="hinge" multiplier="-1"/>
</joint></robot>"""
MOVING = '<mass value="0.1"/>\n<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
HARMLESS = {
    "xacro that nothing uses": ("<link", '<xacro:property name="w" value="1"/>\n<link', "'w'"),
    "two materials": ('name="red"/>', 'name="red"/><material name="blue"/>', "first is taken"),
    "a lower triangle": ('izz="0.1"', 'izz="0.1" iyx="0.010" izy="3e-2"', "agree"),
    "a misspelt axis of a fixed joint": ('<axis xyz="0 0 1"/>', '<axis xzy="0 0 1"/>', "'mount'"),
    "an axis without direction": ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>', ""),
    "no name": ('<robot name="arm"', "<robot", "'file'"),
    "blank lines": ("<robot", '\n \n<?xml version="1.0"?><robot', ""),
    "one scale": ('scale="2 2 2"', 'scale="2"', "all axes"),
    "a camera without inertia": (
        '<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>',
        "",
        "'camera': a mass without <inertia> is that of a point",
    ),
    "a follower's limits": ('lower="-0.1" upper="0"', 'lower="0" upper="-0.1"', "swapped"),
}
HARMFUL = {
    "xacro that is used": ("<link", '<xacro:property name="w"/><link name="${w}"/><link', "xacro"),
    "a call of xacro": ("<link", "<xacro:gripper/>\n<link", "run xacro"),
    "two geometries": ("</geometry>", "</geometry><geometry/>", "other readers take the first"),
    "another lower triangle": ('izz="0.1"', 'izz="0.1" iyx="0.5"', "iyx="),
    "a misspelt axis": ('<axis xyz="0 1 0"/>', '<axis xzy="0 1 0"/>', "did you mean"),
    "a moving link without inertia": (MOVING, MOVING.splitlines()[0], "'finger'"),
    "reversed limits": ('lower="-1" upper="2"', 'lower="2" upper="-1"', "swap them"),
}


def files(folder: Path, change: tuple[str, str, str]) -> tuple[Path, Path]:
    """The plain file and the changed one."""
    assert change[0] in ARM
    plain, changed = folder / "plain.urdf", folder / "file.urdf"
    plain.write_text(ARM)
    changed.write_text(ARM.replace(change[0], change[1], 1))
    return plain, changed


@pytest.mark.parametrize("kind", HARMLESS)
def test_the_robot_is_the_same(
    tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    plain, changed = files(tmp_path, HARMLESS[kind])
    models = [hovi.load_robot(each).model for each in (plain, changed)]
    try:
        models.append(pin.buildModelFromUrdf(str(changed)))
    except ValueError:
        assert kind in ("blank lines", "a camera without inertia", "no name")
    for model in models[1:]:
        assert list(model.names) == list(models[0].names)
        for one, other in zip(models[0].inertias, model.inertias, strict=True):
            np.testing.assert_allclose(one.matrix(), other.matrix(), rtol=0, atol=1e-15)
        for one, other in zip(models[0].jointPlacements, model.jointPlacements, strict=True):
            assert one == other
    for bounds in ("lowerPositionLimit", "upperPositionLimit", "velocityLimit", "effortLimit"):
        assert getattr(models[1], bounds).tolist() == getattr(models[0], bounds).tolist()
    assert main(["info", str(changed)]) == 0
    assert HARMLESS[kind][2] in capsys.readouterr().out


@pytest.mark.parametrize("kind", HARMFUL)
def test_what_could_change_it_is_refused(tmp_path: Path, kind: str) -> None:
    with pytest.raises(ModelError) as refused:
        hovi.load_robot(files(tmp_path, HARMFUL[kind])[1])
    assert HARMFUL[kind][2] in str(refused.value)
