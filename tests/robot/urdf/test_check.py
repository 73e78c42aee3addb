from __future__ import annotations

from pathlib import Path

import pytest

from hovi.errors import ModelError
from hovi.robot.urdf import check
from hovi.robot.urdf.check import check_urdf, read_urdf
from hovi.robot.urdf.harmless import without_harmless
from hovi.robot.urdf.planar_chain import chain
from hovi.robot.urdf.rules import RULES

ARM = """<robot name="arm">
  <link name="base"/>
  <link name="rod">
    <inertial>
      <origin xyz="0.5 0 0" rpy="0 0 0"/>
      <mass value="2.0"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/>
    </inertial>
    <visual><geometry><box size="1 0.1 0.1"/></geometry></visual>
    <visual><geometry><mesh filename="package://arm/rod.stl"/></geometry></visual>
  </link>
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="rod"/>
    <origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="10" velocity="3"/>
  </joint>
</robot>"""

HINGE = ARM[ARM.index("  <joint") : ARM.index("</robot>")]

# what is replaced, by what, and the words that the sentence must hold
BROKEN = {
    "mass NaN": ('value="2.0"', 'value="NaN"', ["'rod'", "<mass value='NaN'>", "finite"]),
    "mass inf": ('value="2.0"', 'value="inf"', ["'rod'", "<mass value='inf'>"]),
    "mass with a comma": ('value="2.0"', 'value="1,5"', ["'rod'", "'1,5'", "decimal point"]),
    "mass with a unit": ('value="2.0"', 'value="1abc"', ["'rod'", "'1abc'"]),
    "mass in hexadecimal": ('value="2.0"', 'value="0x10"', ["'rod'", "'0x10'"]),
    "mass with an underscore": ('value="2.0"', 'value="1_0"', ["'rod'", "'1_0'"]),
    "mass of 1e308": ('value="2.0"', 'value="1e308"', ["'rod'", "1e+12"]),
    "mass of 1e999": ('value="2.0"', 'value="1e999"', ["'rod'", "1e+12"]),
    "mass empty": ('value="2.0"', 'value=""', ["'rod'", "value="]),
    "mass missing": ('<mass value="2.0"/>', "", ["'rod'", "<mass>"]),
    "mass negative": ('value="2.0"', 'value="-2.0"', ["'rod'", "-2.0 kg"]),
    "inertia incomplete": ('izz="0.1"', "", ["'rod'", "izz="]),
    "inertia negative": ('izz="0.1"', 'izz="-0.1"', ["'rod'", "-0.1 kg m^2", "semi-definite"]),
    "inertia indefinite": ('ixy="0"', 'ixy="0.2"', ["'rod'", "semi-definite"]),
    "axis zero": ('axis xyz="0 1 0"', 'axis xyz="0 0 0"', ["'hinge'", "axis"]),
    "axis of two numbers": ('axis xyz="0 1 0"', 'axis xyz="0 1"', ["'hinge'", "3 numbers"]),
    "origin NaN": ('xyz="0 0 1"', 'xyz="0 nan 1"', ["'hinge'", "'0 nan 1'"]),
    "limits crossed": ('lower="-1"', 'lower="2"', ["'hinge'", "lower=2", "upper=1"]),
    "limit infinite": ('upper="1"', 'upper="inf"', ["'hinge'", "upper='inf'"]),
    "limit of 1e308": ('upper="1"', 'upper="1e308"', ["'hinge'", "1e+30"]),
    "limit negative": ('velocity="3"', 'velocity="-3"', ["'hinge'", "velocity"]),
    "limit without effort": ('effort="10"', "", ["'hinge'", "effort="]),
    "limit missing": (
        ARM[ARM.index("<limit") : ARM.index("\n  </joint")],
        "",
        ["'hinge'", "<limit"],
    ),
    "box negative": ('size="1 0.1 0.1"', 'size="1 -0.1 0.1"', ["'rod'", "negative"]),
    "damping negative": (
        "<axis",
        '<dynamics damping="-1" friction="1"/><axis',
        ["'hinge'", "negative damping"],
    ),
    "two inertials": (
        "</inertial>",
        '</inertial><inertial><mass value="1"/></inertial>',
        ["'rod'", "2 elements <inertial>"],
    ),
    "two masses": ("<mass", '<mass value="9"/><mass', ["'rod'", "2 elements <mass>"]),
    "two axes": ("<axis", '<axis xyz="1 0 0"/><axis', ["'hinge'", "2 elements <axis>"]),
    "plane that is not level": ("revolute", "planar", ["'hinge'", "planar", "normal +z"]),
    "joint type unknown": ("revolute", "revolut", ["'hinge'", "did you mean 'revolute'"]),
    "joint unnamed": ('joint name="hinge"', "joint", ["joint", "no name"]),
    "joint twice": ("</robot>", HINGE + "</robot>", ["'hinge'", "2 times"]),
    "link unnamed": ('<link name="base"/>', "<link/>", ["link", "no name"]),
    "link twice": ("</robot>", '<link name="rod"/></robot>', ["'rod'", "2 times"]),
    "link of a long name": ('"rod"', '"' + "rod" * 10**5 + '"', ["a link", "256 characters"]),
    "joint of a strange name": ('"hinge"', '"a\x9b2Jb"', ["a joint", "printable"]),
    "joint called universe": ('"hinge"', '"universe"', ["a joint", "'universe'"]),
    "robot of a strange name": ('"arm"', '"a\x9b"', ["<robot>", "printable"]),
    "no links": (ARM[ARM.index("  <link") : ARM.index("</robot>")], "", ["no <link>"]),
    "child missing": ('<child link="rod"/>', "", ["'hinge'", "<child"]),
    "child unknown": ('child link="rod"', 'child link="rood"', ["'hinge'", "did you mean 'rod'"]),
    "two parents": (
        "</robot>",
        HINGE.replace('"hinge"', '"other"') + "</robot>",
        ["'rod'", "'hinge'", "'other'"],
    ),
    "cycle": (
        "</robot>",
        HINGE.replace('"hinge"', '"back"').replace('"rod"', '"x"').replace('"base"', '"rod"')
        + HINGE.replace('"hinge"', '"last"')
        .replace('"rod"', '"base"')
        .replace('parent link="base"', 'parent link="x"')
        + '<link name="x"/></robot>',
        ["cycle"],
    ),
    "own parent": ('parent link="base"', 'parent link="rod"', ["'rod'", "cycle"]),
    "two roots": ("</robot>", '<link name="floor"/></robot>', ["'base'", "'floor'", "root"]),
    "mimic of itself": ("<axis", '<mimic joint="hinge"/><axis', ["'hinge'", "mimics itself"]),
    "mesh climbs out": ("arm/rod.stl", "../../etc/passwd", ["'rod'", "package"]),
    "mesh climbs out later": ("arm/rod.stl", "arm/../x.stl", ["'rod'", "package"]),
    "a misspelt element": ("inertial>", "inertail>", ["'rod'", "<inertail>", "<inertial>?"]),
    "a value as text": ('<axis xyz="0 1 0"/>', "<axis>0 1 0</axis>", ["'hinge'", "'0 1 0'"]),
    "a long name": ('name="arm"', f'name="{"arm" * 100}"', ["<robot>", "256 characters"]),
    "not a robot": ("robot", "sdf", ["<robot>", "<sdf>"]),
    "xacro": ("</robot>", "<xacro:arm/></robot>", ["xacro"]),
    "xacro that is referred to": (
        'value="2.0"/>',
        'value="${2 * w}"/><xacro:property name="w" value="1"/>',
        ["<xacro:property>", "run xacro"],
    ),
    "broken XML": ("</robot>", "", ["well-formed"]),
    "empty": (ARM, "", ["well-formed"]),
    "NUL": ("arm", "a\0m", ["well-formed"]),
    "doctype": ("<robot", '<!DOCTYPE x [<!ENTITY a "b">]><robot', ["DOCTYPE"]),
    "too many elements": ("</robot>", "<a/>" * 100_001 + "</robot>", ["100,000 elements"]),
    "too many attributes": (
        "<robot",
        "<robot " + " ".join(f'a{i}="1"' for i in range(65)),
        ["more than 64 attributes"],
    ),
    "too many shapes": (
        "</link>\n  <joint",
        "<visual><geometry><box size='1 1 1'/></geometry></visual>" * 1_000 + "</link>\n  <joint",
        ["1,002 elements <visual>"],
    ),
    "nested too deep": ("</robot>", "<a>" * 99 + "</a>" * 99 + "</robot>", ["deep"]),
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_urdf_is_refused_by_a_sentence_with_the_element(what: str) -> None:
    old, new, words = BROKEN[what]
    text = ARM.replace(old, new)
    assert text != ARM
    with pytest.raises(ModelError) as caught:
        check_urdf(text, "arm.urdf")
    message = str(caught.value)
    assert "'arm.urdf'" in message
    assert message.endswith((".", "?", "..."))
    assert "\n" not in message
    assert len(message) < 500
    for word in words:
        assert word in message


def test_the_valid_urdf_passes() -> None:
    check_urdf(ARM)


def test_every_rule_is_violated_by_some_case() -> None:
    broken = set()
    for old, new, _ in BROKEN.values():
        builder = check._Reader("robot.urdf")
        try:
            robot = builder.read(ARM.replace(old, new))
        except ModelError:
            continue
        without_harmless(robot, "robot")
        broken.update(next((rule for rule in RULES if any(rule(robot))), None) for _ in [0])
    assert set(RULES) <= broken


@pytest.mark.parametrize("mass", ["1", "+1.", ".5", "1e-3", "1E+3", " 2 ", "0"])
def test_plain_numbers_pass(mass: str) -> None:
    check_urdf(ARM.replace('value="2.0"', f'value="{mass}"'))


def test_links_are_counted_before_other_checks() -> None:
    with pytest.raises(ModelError, match="more than 1000 links"):
        check_urdf('<robot name="x">' + '<link mass="NaN"/>' * 20_000)


def test_degrees_of_freedom_are_counted_too() -> None:
    check_urdf(chain(250))
    text = chain(250).replace('name="tip_mount" type="fixed"', 'name="tip_mount" type="continuous"')
    with pytest.raises(ModelError, match="more than 250 degrees of freedom"):
        check_urdf(text)


def test_entities_are_never_expanded() -> None:
    bomb = '<!DOCTYPE r [<!ENTITY a "' + "x" * 999 + '"><!ENTITY b "&a;&a;">]><robot>&b;</robot>'
    with pytest.raises(ModelError, match="DOCTYPE"):
        check_urdf(bomb)


def test_a_missing_file_and_a_binary_file_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"'.*gone\.urdf': no such file"):
        read_urdf(tmp_path / "gone.urdf")
    with pytest.raises(ModelError, match="that is a folder"):
        read_urdf(tmp_path)
    binary = tmp_path / "binary.urdf"
    binary.write_bytes(b"<robot>\xff\xfe")
    with pytest.raises(ModelError, match=r"'binary\.urdf' is not UTF-8"):
        read_urdf(binary)


def test_reading_keeps_every_byte(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_bytes(ARM.replace("\n", "\r\n").encode())
    assert read_urdf(path).encode() == path.read_bytes()
