"""Empty ranges, soft limits and odd units of a URDF are named, with what to do about them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi.cli.application import main
from hovi.errors import InputError

RANGE = 'lower="-2" upper="2"'
ARM = f"""<robot name="arm"><link name="base"/>
<link name="a"><inertial><origin xyz="0 0 0.2"/><mass value="2"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<link name="b"><inertial><origin xyz="0 0 0.2"/><mass value="1.5"/>
<inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial></link>
<joint name="j1" type="prismatic"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/>
<limit lower="0" upper="0.5" effort="50" velocity="3"/></joint>
<joint name="j2" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.4"/>
<axis xyz="0 1 0"/><limit {RANGE} effort="50" velocity="3"/></joint></robot>"""
EMPTY = {"zeros": 'lower="0" upper="0"', "nothing": "", "a point": 'lower="1" upper="1"'}


def robot(folder: Path, old: str = "", new: str = "") -> hovi.Robot:
    """The arm with a change in its file."""
    assert old in ARM
    file = folder / "arm.urdf"
    file.write_text(ARM.replace(old, new))
    return hovi.load_robot(file)


@pytest.mark.parametrize("kind", EMPTY)
def test_an_empty_range_is_named_by_its_joint(
    tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = hovi.Scene(robot(tmp_path, RANGE, EMPTY[kind]), [hovi.effects.Gravity()])
    ends = [0.1, 0.0], [0.2, 0.5]
    with pytest.raises(InputError, match=r"joint 'j2' of robot 'arm' has an empty .* lock .* give"):
        hovi.plan(scene, *ends, 2.0)
    for limits in ({"q": {"j2": [-1.0, 1.0]}}, "none"):
        assert hovi.plan(scene, *ends, 2.0, limits=limits).success
    assert main(["info", str(tmp_path / "arm.urdf")]) == 0
    assert "no range of positions at j2" in capsys.readouterr().out


def test_soft_limits_bound_the_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    soft = '<safety_controller soft_lower_limit="-0.1" soft_upper_limit="0.4" k_velocity="1"/>'
    arm = robot(tmp_path, "</joint></robot>", f"{soft}</joint></robot>")
    scene = hovi.Scene(arm, [hovi.effects.Gravity()])
    start, goal = hovi.State([0.1, 0.0], [0.0, -2.0]), hovi.State([0.2, 0.3])
    free, bounded = (hovi.plan(scene, start, goal, 2.0, limits=x) for x in ("urdf", "soft"))
    assert free.success
    assert bounded.success
    lowest = [
        x.trajectory.sample(np.linspace(0.0, 2.0, 5_000)).q[:, 1].min() for x in (free, bounded)
    ]
    assert lowest[0] < -0.11
    assert -0.1 - 1e-6 <= lowest[1] < -0.099
    assert not hovi.plan(scene, [0.1, 0.0], [0.2, 0.5], 2.0, limits="soft").success
    assert main(["info", str(tmp_path / "arm.urdf")]) == 0
    assert 'safety controllers at j2: limits = "soft"' in capsys.readouterr().out


def test_soft_limits_that_are_not_there_are_refused(tmp_path: Path) -> None:
    none = '<safety_controller k_velocity="1"/></joint></robot>'
    for old, new in (("", ""), ("</joint></robot>", none)):
        scene = hovi.Scene(robot(tmp_path, old, new), [hovi.effects.Gravity()])
        with pytest.raises(InputError, match="no <safety_controller> with soft limits"):
            hovi.plan(scene, [0.1, 0.0], [0.2, 0.5], 2.0, limits="soft")


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        ('upper="0.5"', 'upper="500"', "500 m, looks like millimetres: 500 mm are 0.5 m"),
        ('value="1.5"', 'value="1500"', "looks like grams: 1500 g are 1.5 kg"),
        ('izz="0.05"', 'izz="50000"', "looks like kg mm^2"),
        ("", "", ""),
    ],
)
def test_odd_units_are_hinted_at(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, hint: str
) -> None:
    robot(tmp_path, old, new)
    assert main(["info", str(tmp_path / "arm.urdf")]) == 0
    told = capsys.readouterr().out
    assert hint in told
    assert hint or "looks like" not in told


@pytest.mark.parametrize("name", ["ur5", "panda", "solo12", "tiago", "talos", "anymal", "kinova"])
def test_real_robots_have_no_odd_units(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", name]) == 0
    assert "looks like" not in capsys.readouterr().out
