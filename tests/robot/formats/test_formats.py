"""Robots from xacro, MJCF and robot_descriptions, and which of them a scene file may name."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.cli.application import main
from hovi.errors import HoviError, InputError, ModelError
from hovi.robot.formats.packages import package_name
from hovi.robot.formats.recognized import format_of
from samples.cubic_motion import cubic_motion

XACRO = """<?xml version="1.0"?>
<robot name="made" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="sizes.xacro"/>
  <xacro:property name="length" value="${2 * half}"/>
  <xacro:macro name="rod" params="name mass">
    <link name="${name}">
      <inertial><origin xyz="0 0 ${half}"/><mass value="${mass}"/>
        <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
      <visual><geometry><mesh filename="package://parts/rod.stl"/></geometry></visual>
    </link>
  </xacro:macro>
  <link name="base"/>
  <xacro:rod name="upper" mass="${1 + 1}"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <origin xyz="0 0 ${length}"/>
    <limit lower="-1" upper="1" effort="10" velocity="2"/>
  </joint>
</robot>
"""
SIZES = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="half" value="0.35"/>
</robot>
"""
SDF = "<!-- a comment about <mujoco> --><sdf version='1.9'><model name='m'/></sdf>"


@pytest.fixture
def xacro(tmp_path: Path) -> Path:
    pytest.importorskip("xacrodoc")
    (tmp_path / "sizes.xacro").write_text(SIZES)
    path = tmp_path / "made.urdf.xacro"
    path.write_text(XACRO)
    return path


def test_formats_are_recognized(tmp_path: Path) -> None:
    for name, text, form in (
        ("a.xml", "<robot name='a'/>", "urdf"),
        ("b.xml", "<!-- <robot> -->\n<mujoco model='b'/>", "mjcf"),
        ("c.xml", SDF, "sdf"),
        ("c.sdf", SDF, "sdf"),
        ("d.urdf", "<mujoco/>", "urdf"),
        ("e.urdf.xacro", "", "xacro"),
    ):
        (tmp_path / name).write_text(text)
        assert format_of(tmp_path / name) == form
    assert format_of(tmp_path / "nowhere.xml") == "urdf"
    assert format_of("panda") == "urdf"
    assert format_of("panda_description") == "description"
    assert format_of(Path("panda_description")) == "urdf"


def test_xacro_is_expanded(xacro: Path) -> None:
    robot = hovi.load_robot(xacro)
    assert robot.joint_names == ("shoulder",)
    assert robot.model.inertias[1].mass == 2.0
    assert robot.model.jointPlacements[1].translation[2] == pytest.approx(0.7)
    assert "package://parts/rod.stl" in str(robot.source.urdf)
    again = hovi.load_robot(str(xacro))
    assert again.source.sha256 == robot.source.sha256


def test_xacro_that_fails_is_told_in_a_sentence(xacro: Path, tmp_path: Path) -> None:
    xacro.write_text(XACRO.replace("2 * half", "2 * whole"))
    with pytest.raises(ModelError, match=r"'made\.urdf\.xacro' cannot be expanded: .*whole"):
        hovi.load_robot(xacro)
    with pytest.raises(ModelError, match="cannot read the xacro file"):
        hovi.load_robot(tmp_path / "nowhere.xacro")


@pytest.mark.parametrize(
    ("module", "robot", "what"),
    [("xacrodoc", "made.xacro", "is a xacro file"), ("robot_descriptions", "a1_description", "")],
)
def test_a_missing_package_is_named(
    module: str, robot: str, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setitem(sys.modules, f"{module}._descriptions", None)
    with pytest.raises(ModelError, match=rf"{what}.*run pip install 'hovi\[robots\]'"):
        hovi.load_robot(robot)


def test_mjcf_comes_back(tmp_path: Path) -> None:
    """What hovi writes for MuJoCo has the same dynamics when it comes back."""
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    cubic_motion(scene)[0].to_mujoco(tmp_path / "arm.xml", 1.0)
    robot = hovi.load_robot(tmp_path / "arm.xml")
    assert robot.joint_names == scene.robot.joint_names
    again = hovi.Scene(robot, [hovi.effects.Gravity()])
    point = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 1, 6))
    np.testing.assert_allclose(
        again.inverse_dynamics(*point), scene.inverse_dynamics(*point), rtol=0, atol=1e-9
    )
    with pytest.raises(ModelError, match="floats by <freejoint/> in its first body"):
        hovi.load_robot(tmp_path / "arm.xml", free_flyer=True)
    held = hovi.load_robot(tmp_path / "arm.xml", locked=["elbow_joint"])
    assert held.nv == 5


def test_what_pinocchio_does_not_read_is_told(tmp_path: Path) -> None:
    (tmp_path / "bad.xml").write_text("<mujoco><worldbody><body></mujoco>")
    with pytest.raises(ModelError, match=r"MJCF 'bad\.xml': it is not well-formed XML"):
        hovi.load_robot(tmp_path / "bad.xml")
    (tmp_path / "robot.sdf").write_text(SDF)
    with pytest.raises(ModelError, match="is SDF, which Pinocchio's wheel does not read"):
        hovi.load_robot(str(tmp_path / "robot.sdf"))


@pytest.mark.parametrize("robot", ["made.xacro", "arm.mjcf", "panda_description", "arm.xml"])
def test_a_scene_file_names_no_robot_that_runs_or_downloads_something(
    robot: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "made.xacro").write_text(XACRO)
    (tmp_path / "arm.xml").write_text("<mujoco/>")
    scene = tmp_path / "scene.toml"
    scene.write_text(f'robot = "{robot}"\nduration = 1.0\n[start]\nq = [0.0]\n[goal]\nq = [1.0]\n')
    with pytest.raises(HoviError, match=r"may name a URDF or an example robot.*in Python"):
        hovi.load_task(scene)


# Descriptions


def git(folder: Path, *arguments: str) -> str:
    identity = ["-c", "user.name=test", "-c", "user.email=test@example.org"]
    command = ["git", "-C", str(folder), *identity, *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A local repository in the place of the one that panda_description is cloned from."""
    repositories: Any = pytest.importorskip("robot_descriptions._repositories")
    source = tmp_path / "source"
    urdf = source / "robots" / "panda_description" / "urdf" / "panda.urdf"
    urdf.parent.mkdir(parents=True)
    urdf.write_text(Path(hovi.example("two_link.urdf")).read_text())
    git(source, "init", "--quiet")
    git(source, "add", ".")
    git(source, "commit", "--quiet", "-m", "robot")
    local = repositories.Repository(
        url=str(source), commit=git(source, "rev-parse", "HEAD"), cache_path="example-robot-data"
    )
    monkeypatch.setitem(repositories.REPOSITORIES, "example-robot-data", local)
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(tmp_path / "cache"))
    monkeypatch.delitem(sys.modules, "robot_descriptions.panda_description", raising=False)
    yield source
    sys.modules.pop("robot_descriptions.panda_description", None)


def test_a_description_is_cloned_once_and_then_read_from_the_cache(repository: Path) -> None:
    robot = hovi.load_robot("panda_description")
    assert robot.joint_names == ("shoulder", "elbow")
    assert robot.source.kind == "urdf"
    repository.rename(repository.with_name("gone"))
    del sys.modules["robot_descriptions.panda_description"]
    assert hovi.load_robot("panda_description").nv == 2
    assert isinstance(robot.model, pin.Model)


def test_a_clone_that_fails_is_told_in_a_sentence(repository: Path) -> None:
    repository.rename(repository.with_name("gone"))
    with pytest.raises(ModelError, match="cannot clone the repository of 'panda_description'"):
        hovi.load_robot("panda_description")


def test_an_unknown_description_has_a_suggestion() -> None:
    pytest.importorskip("robot_descriptions")
    with pytest.raises(ModelError, match="has no 'pandaa_description': did you mean 'panda_desc"):
        hovi.load_robot("pandaa_description")


def test_a_free_joint_of_mjcf_is_a_base_that_floats(tmp_path: Path) -> None:
    (tmp_path / "box.xml").write_text(
        "<mujoco><worldbody><body name='box'><freejoint/>"
        "<inertial pos='0 0 0' mass='2' diaginertia='0.1 0.2 0.25'/></body></worldbody></mujoco>"
    )
    robot = hovi.load_robot(tmp_path / "box.xml")
    assert (robot.nq, robot.nv) == (7, 6)
    assert robot.model.inertias[1].mass == 2.0


# Arguments and packages of xacro

ARM = """<robot name="$(arg name)" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="mass" default="3"/>
  <xacro:arg name="flipped" default="false"/>
  <xacro:include filename="$(find parts_description)/link.xacro"/>
  <link name="base"/>
  <xacro:part mass="$(arg mass)"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="part"/>
    <axis xyz="0 0 ${-1 if '$(arg flipped)' == 'true' else 1}"/>
    <limit lower="-1" upper="1" effort="10" velocity="2"/>
  </joint>
</robot>
"""
PART = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="part" params="mass">
    <link name="part"><inertial><mass value="${mass}"/>
      <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
      <visual><geometry><mesh filename="package://parts_description/rod.obj"/></geometry></visual>
    </link>
  </xacro:macro>
</robot>
"""
ROD = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def package(folder: Path, name: str, files: dict[str, str]) -> Path:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{name}</name></package>")
    for file, text in files.items():
        (folder / file).write_text(text)
    return folder


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A xacro file in a package, whose parts are in another one."""
    pytest.importorskip("xacrodoc")
    return package(tmp_path / "tree" / "robots" / "arm", "arm_description", {"arm.xacro": ARM})


def test_arguments_are_given_and_packages_beside_the_file_are_found(arm: Path) -> None:
    package(arm.parents[1] / "parts_description", "parts_description", {"link.xacro": PART})
    (arm.parents[1] / "parts_description" / "rod.obj").write_text(ROD)
    robot = hovi.load_robot(arm / "arm.xacro", xacro_args={"name": "ur", "mass": 5})
    assert robot.name == "ur"
    assert robot.model.inertias[1].mass == 5.0
    assert robot.visual is not None
    assert robot.visual.ngeoms == 1
    turned = hovi.load_robot(arm / "arm.xacro", xacro_args={"name": "ur", "flipped": True})
    assert turned.model.inertias[1].mass == 3.0
    assert (
        turned.source.sha256
        != hovi.load_robot(
            arm / "arm.xacro", xacro_args={"name": "ur", "flipped": False}
        ).source.sha256
    )


def test_what_is_missing_is_said_once_and_without_classes(arm: Path, tmp_path: Path) -> None:
    path = arm / "arm.xacro"
    with pytest.raises(ModelError, match=r"needs a value of its argument 'name': write xacro_args"):
        hovi.load_robot(path)
    with pytest.raises(ModelError) as error:
        hovi.load_robot(path, xacro_args={"name": "ur"})
    assert "needs the package 'parts_description'" in str(error.value)
    assert "--package-dir FOLDER" in str(error.value)
    assert str(error.value).count("parts_description") == 1
    assert not any(word in str(error.value) for word in ("class", "Exception", "Error"))
    elsewhere = package(tmp_path / "else" / "p", "parts_description", {"link.xacro": PART})
    for folder in (elsewhere, elsewhere.parent):
        given = {"name": "ur"}
        assert hovi.load_robot(path, package_dirs=[folder], xacro_args=given).nv == 1
        with pytest.raises(ModelError, match="no argument 'nmae': did you mean 'name'"):
            hovi.load_robot(path, package_dirs=[folder], xacro_args=given | {"nmae": "ur"})
    (elsewhere / "link.xacro").write_text(PART.replace("${mass}", "${mess}"))
    with pytest.raises(ModelError) as error:
        hovi.load_robot(path, package_dirs=[elsewhere], xacro_args={"name": "ur"})
    assert str(error.value).count("mess") == 2  # what is not defined, and where
    assert "in 'link.xacro'" in str(error.value) or "arm.xacro" in str(error.value)


def test_arguments_are_for_xacro_files_only() -> None:
    with pytest.raises(InputError, match="xacro_args are those of a xacro file, and 'panda'"):
        hovi.load_robot("panda", xacro_args={"name": "ur"})
    with pytest.raises(InputError, match="texts, numbers, True or False, got 'name': \\[\\]"):
        hovi.load_robot("panda", xacro_args={"name": []})


def test_the_command_line_takes_arguments_and_packages(
    arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    package(tmp_path / "else" / "p", "parts_description", {"link.xacro": PART})
    file, folder = str(arm / "arm.xacro"), str(tmp_path / "else")
    given = ["--xacro-arg", "name:=ur", "--xacro-arg", "mass:=7", "--package-dir", folder]
    assert main(["info", file, *given]) == 0
    assert capsys.readouterr().out.startswith("ur: 1 joint, nq = 1, nv = 1, 7 kg")
    assert main(["info", file, "--xacro-arg", "name=ur"]) == 2
    assert "takes NAME:=VALUE" in capsys.readouterr().err
    assert main(["info", file]) == 2
    assert capsys.readouterr().err.count("'name'") == 1


@pytest.mark.parametrize("kind", ["a pipe", "a large file", "a folder", "no text"])
def test_an_odd_package_file_names_no_package(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "package.xml"
    if kind == "a pipe":
        os.mkfifo(file)
    elif kind == "a folder":
        file.mkdir()
    else:
        file.write_bytes(b"\xff" * 100 if kind == "no text" else b"<name>a</name>" + b" " * 10**6)
    assert package_name(tmp_path) is None
