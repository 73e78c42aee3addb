"""What an MJCF says is kept, noted by `hovi info`, or refused in a sentence that names it."""

from __future__ import annotations

from pathlib import Path

import pytest

import hovi
from hovi.errors import HoviWarning, ModelError

BODY = """<body name="a"><joint name="j" axis="0 1 0" {joint}/><inertial pos="0 0 .2" mass="{mass}"
diaginertia=".03 .03 .01"/>{body}</body>"""
FILE = """<mujoco model="arm"><compiler angle="radian"/>{top}
<worldbody>{bodies}{world}</worldbody>{end}</mujoco>"""


def loaded(
    folder: Path, joint: str = "", mass: str = "2", body: str = "", **parts: str
) -> hovi.Robot:
    """The robot of a file with these parts."""
    texts = {"top": "", "world": "", "end": ""} | parts
    path = folder / "arm.xml"
    path.write_text(FILE.format(bodies=BODY.format(joint=joint, mass=mass, body=body), **texts))
    return hovi.load_robot(path)


REFUSED = {
    "a mass that is no number": ({"mass": "nan"}, "mass='nan' of <inertial> of body 'a'"),
    "an infinite mass": ({"mass": "inf"}, "mass='inf'"),
    "a mass beyond all numbers": ({"mass": "1e400"}, "mass='1e400'"),
    "a negative mass": ({"mass": "-1"}, "mass -1 kg"),
    "a misspelt attribute": ({"joint": 'rangee="0 1"'}, "rangee= of joint 'j' is unknown"),
    "a range upside down": ({"joint": 'range="1 -1"'}, "range of joint 'j'"),
    "an axis without direction": ({"world": '<body><joint axis="0 0 0"/></body>'}, "is zero"),
    "a copied body": ({"world": '<replicate count="3"><body/></replicate>'}, "<replicate>"),
    "an unknown class": ({"joint": 'class="x"'}, "joint 'j' is of the class 'x'"),
    "a file that is not there": (
        {"top": '<include file="gone.xml"/>'},
        "'gone.xml' cannot be read",
    ),
    "itself": ({"top": '<include file="arm.xml"/>'}, "a second time"),
    "a misspelt section": ({"end": "<equalty/>"}, "<equalty> is unknown: did you mean 'equality'"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_not_read_is_refused(what: str, tmp_path: Path) -> None:
    parts, words = REFUSED[what]
    with pytest.raises(ModelError, match=r"^MJCF 'arm\.xml': [^\n]*") as caught:
        loaded(tmp_path, **parts)
    assert words in str(caught.value)


NOTED = {
    "gravity": ({"top": '<option gravity="0 0 -3.7"/>'}, "gravity='0 0 -3.7'"),
    "compensation": ({"world": '<body name="b" gravcomp="1"/>'}, "gravcomp= is not read"),
    "a motor": (
        {"end": '<actuator><motor joint="j" ctrlrange="-5 5"/></actuator>'},
        "ctrlrange -5 5",
    ),
    "a spring": ({"joint": 'stiffness="3"'}, "stiffness= is not read"),
    "a pair": (
        {"end": '<contact><exclude body1="a" body2="b"/></contact>'},
        "pairs that may touch",
    ),
    "a pose": ({"end": '<keyframe><key name="home" qpos="1"/></keyframe>'}, "keyframes 'home'"),
    "a tendon": ({"end": '<tendon><fixed name="t"/></tendon>'}, "fixed 't'"),
}


@pytest.mark.parametrize("what", NOTED)
def test_what_is_left_out_is_noted(what: str, tmp_path: Path) -> None:
    parts, words = NOTED[what]
    assert words in loaded(tmp_path, **parts).describe()
    assert words not in loaded(tmp_path).describe()


def test_a_tie_of_joints_is_warned_of_unless_they_are_locked(tmp_path: Path) -> None:
    end = '<equality><joint joint1="j" polycoef="0 1 0 0 0"/></equality>'
    with pytest.warns(HoviWarning, match="its joints move freely, without <joint> of 'j'"):
        robot = loaded(tmp_path, end=end)
    assert "not kept, so that its bodies move freely: <joint> of 'j'" in robot.describe()
    hovi.load_robot(tmp_path / "arm.xml", locked=["j"])


def test_two_worlds_are_one(tmp_path: Path) -> None:
    end = '<worldbody><light pos="0 0 3"/></worldbody>'
    robot = loaded(tmp_path, end=end)
    assert robot.joint_names == ("j",)
    assert sum(each.mass for each in robot.model.inertias) == 2.0


def test_every_joint_of_a_body_has_its_name_and_moves_within_limits(tmp_path: Path) -> None:
    robot = loaded(
        tmp_path,
        world="""<body name="b"><joint name="x" type="slide" range="-1 1"/>
<joint name="turn" axis="0 0 1" range="-3 3"/><inertial pos="0 0 .2" mass="2" diaginertia="1 1 1"/>
</body>""",
    )
    assert robot.joint_names == ("j", "x", "turn")


def test_a_body_that_is_fixed_to_the_world_needs_no_mass(tmp_path: Path) -> None:
    (tmp_path / "open.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n")
    mesh = '<asset><mesh name="m" file="open.obj"/></asset>'
    geom = '<geom type="mesh" mesh="m"/>'
    assert loaded(tmp_path, top=mesh, world=f'<body name="base">{geom}</body>').nv == 1
    with pytest.raises(ModelError, match="a mesh with a mass that is not nearly convex and closed"):
        loaded(tmp_path, top=mesh, world=f'<body name="arm"><joint/>{geom}</body>')
