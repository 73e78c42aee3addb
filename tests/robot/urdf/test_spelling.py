"""Misspelt and misplaced names of a URDF are refused; unknown names are ignored and reported."""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import pytest

from hovi.errors import ModelError
from hovi.robot.loading import load_robot
from hovi.robot.urdf.check import check_urdf
from hovi.robot.urdf.elements import CHILDREN, EXTENSIONS, PARENTS, attributes_of
from hovi.robot.urdf.planar_chain import chain
from hovi.robot.urdf.spelling import MAX_UNKNOWN, is_near

FULL = """<robot name="full" version="1.0">
  <material name="red"><color rgba="1 0 0 1"/><texture filename="red.png"/></material>
  <link name="base"/>
  <link name="rod">
    <inertial>
      <origin xyz="0.5 0 0" rpy="0 0 0"/>
      <mass value="2.0"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/>
    </inertial>
    <visual name="a"><origin xyz="0 0 0" rpy="0 0 0"/><geometry><box size="1 1 1"/></geometry>
      <material name="red"/></visual>
    <visual><geometry><mesh filename="package://a/rod.stl" scale="1 1 1"/></geometry></visual>
    <collision name="b"><origin xyz="0 0 0" rpy="0 0 0"/>
      <geometry><cylinder radius="1" length="1"/></geometry></collision>
    <collision><geometry><sphere radius="1"/></geometry></collision>
    <collision><geometry><capsule radius="1" length="1"/></geometry></collision>
  </link>
  <link name="other"/>
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="rod"/>
    <origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="10" velocity="3"/>
    <dynamics damping="1" friction="1"/>
    <calibration rising="0" falling="1" reference_position="0"/>
    <safety_controller k_velocity="1" k_position="1" soft_lower_limit="0" soft_upper_limit="1"/>
  </joint>
  <joint name="second" type="continuous">
    <parent link="rod"/><child link="other"/><mimic joint="hinge" multiplier="1" offset="0"/>
  </joint>
</robot>"""


def without_letter(name: str) -> Iterator[str]:
    yield from (name[:i] + name[i + 1 :] for i in range(len(name)))


def with_a_letter(name: str) -> Iterator[str]:
    yield from (name[:i] + letter + name[i:] for i in range(len(name) + 1) for letter in "ax_")


def with_another_letter(name: str) -> Iterator[str]:
    yield from (name[:i] + letter + name[i + 1 :] for i in range(len(name)) for letter in "ax_")


def with_two_swapped(name: str) -> Iterator[str]:
    yield from (name[:i] + name[i + 1] + name[i] + name[i + 2 :] for i in range(len(name) - 1))


def in_another_case(name: str) -> Iterator[str]:
    yield from (name.capitalize(), name.upper(), name[:-1] + name[-1].upper())


EDITS = (without_letter, with_a_letter, with_another_letter, with_two_swapped, in_another_case)


def places() -> Iterator[tuple[int, str | None]]:
    """(number of an element in FULL, attribute or None for the element's own name)."""
    for number, element in enumerate(ElementTree.fromstring(FULL).iter()):
        if number:
            yield number, None
        yield from ((number, attribute) for attribute in element.attrib)


def renamed(number: int, attribute: str | None, name: str) -> str:
    """FULL with a name changed."""
    robot = ElementTree.fromstring(FULL)
    element = list(robot.iter())[number]
    if attribute is None:
        element.tag = name
    else:
        element.set(name, element.attrib.pop(attribute))
    return ElementTree.tostring(robot, encoding="unicode")


def known_beside(number: int, attribute: str | None) -> set[str]:
    """Names that are known at the place."""
    robot = ElementTree.fromstring(FULL)
    element = list(robot.iter())[number]
    if attribute is not None:
        return set(attributes_of(element.tag))
    parent = next(each for each in robot.iter() if element in list(each))
    return {*CHILDREN[parent.tag], *EXTENSIONS.get(parent.tag, ())}


def test_a_urdf_with_every_name_is_accepted() -> None:
    check_urdf(FULL)
    robot = ElementTree.fromstring(FULL)
    assert {element.tag for element in robot.iter()} >= {*CHILDREN, *PARENTS}
    for element in list(robot.iter()):
        assert set(element.attrib) <= set(attributes_of(element.tag))


@pytest.mark.parametrize("edit", EDITS)
@pytest.mark.parametrize(("number", "attribute"), list(places()))
def test_every_misspelt_name_is_refused(number: int, attribute: str | None, edit: object) -> None:
    name = attribute or list(ElementTree.fromstring(FULL).iter())[number].tag
    known = known_beside(number, attribute)
    for wrong in {*edit(name)} - known:  # type: ignore[operator]
        if not wrong or wrong[0].isdigit():
            continue
        with pytest.raises(ModelError) as caught:
            check_urdf(renamed(number, attribute, wrong))
        quoted = f"<{wrong}>" if attribute is None else f"{wrong}="
        assert quoted in str(caught.value)
        assert "did you mean" in str(caught.value) or wrong in PARENTS


def distance(one: str, other: str) -> int:
    """Edits between two words (a letter more, less or another, or two swapped), by a table."""
    table = [
        [i + j if 0 in (i, j) else 0 for j in range(len(other) + 1)] for i in range(len(one) + 1)
    ]
    for i, j in itertools.product(range(1, len(one) + 1), range(1, len(other) + 1)):
        table[i][j] = min(
            table[i - 1][j] + 1,
            table[i][j - 1] + 1,
            table[i - 1][j - 1] + (one[i - 1] != other[j - 1]),
        )
        if min(i, j) > 1 and one[i - 2 : i] == other[j - 2 : j][::-1]:
            table[i][j] = min(table[i][j], table[i - 2][j - 2] + 1)
    return table[-1][-1]


def test_names_are_near_up_to_one_edit() -> None:
    words = ["".join(letters) for n in range(5) for letters in itertools.product("abB", repeat=n)]
    for one, other in itertools.product(words, words):
        assert is_near(one, other) == (distance(one.lower(), other.lower()) <= 1), (one, other)


MISTAKES = {
    "no mass by a swap": ("inertial>", "inertail>", "link 'rod' has <inertail>", "<inertial>?"),
    "no mass by a capital": ("inertial>", "Inertial>", "link 'rod' has <Inertial>", "<inertial>?"),
    "an origin": ('origin xyz="0 0 1"', 'origin xzy="0 0 1"', "of joint 'hinge' has xzy=", "xyz=?"),
    "a limit": ("lower=", "lowr=", "<limit> of joint 'hinge' has lowr=", "lower=?"),
    "an axis": ("<axis", "<axes", "joint 'hinge' has <axes>", "<axis>?"),
    "a joint": ("joint", "Joint", "<robot> has <Joint>", "<joint>?"),
    "an inertia": ("iyz=", "izy=", "<inertia> of link 'rod' has izy=", "or iyz="),
    "a value as text": (
        '<axis xyz="0 1 0"/>',
        "<axis>0 1 0</axis>",
        "<axis> of joint 'hinge' has the text '0 1 0'",
        "as attributes, such as xyz=",
    ),
    "a mirrored plane": (
        'type="revolute">',
        'type="planar"><axis xyz="0 0 -1"/>',
        "joint 'hinge' is planar with the normal '0 0 -1'",
        "only the normal +z",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_that_makes_another_robot_is_refused(mistake: str) -> None:
    old, new, *words = MISTAKES[mistake]
    text = FULL.replace(old, new)
    if mistake == "a mirrored plane":
        text = text.replace('<axis xyz="0 1 0"/>', "")
        check_urdf(text.replace("0 0 -1", "0 0 1"))
    assert text != FULL
    with pytest.raises(ModelError) as caught:
        check_urdf(text)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("tag", PARENTS)
@pytest.mark.parametrize("place", [*CHILDREN, "mass", "origin", "limit", "box"])
def test_an_element_in_another_place_is_refused(tag: str, place: str) -> None:
    robot = ElementTree.fromstring(FULL)
    owner = robot if place == "robot" else next(robot.iter(place))
    if tag in CHILDREN.get(place, ()):
        return
    ElementTree.SubElement(owner, tag)
    words = f"has <{tag}>, which belongs in <{PARENTS[tag]}>: move it"
    with pytest.raises(ModelError, match=words):
        check_urdf(ElementTree.tostring(robot, encoding="unicode"))


# Names of other programs


def with_extensions() -> str:
    """FULL with every known extension, which have misspelt names inside."""
    robot = ElementTree.fromstring(FULL)
    for place, tags in EXTENSIONS.items():
        for owner in [robot] if place == "robot" else [*robot.iter(place)]:
            for tag in tags:
                inner = ElementTree.SubElement(owner, tag, {"reference": "rod", "Name": "x"})
                ElementTree.SubElement(inner, "inertail", {"lowr": "1"}).text = "1"
    robot.set("xmlns:xacro", "http://www.ros.org/wiki/xacro")
    return ElementTree.tostring(robot, encoding="unicode")


def notes(folder: Path, text: str) -> str:
    """The lines of `hovi info` about what is ignored or without inertia."""
    (folder / "robot.urdf").write_text(text)
    lines = load_robot(folder / "robot.urdf").describe().splitlines()
    return "\n".join(
        line.strip() for line in lines if "ignored, since" in line or "without <" in line
    )


def test_extensions_of_simulators_and_controllers_are_accepted_in_silence(tmp_path: Path) -> None:
    check_urdf(with_extensions())
    assert "ignored, since" not in notes(tmp_path, with_extensions())


def test_other_names_are_accepted_and_reported(tmp_path: Path) -> None:
    text = FULL.replace("</inertial>", "</inertial><gravity>1</gravity><origin/>")
    text = text.replace("<limit ", '<limit current="3" ').replace("<link ", '<link kind="x" ')
    text = text.replace("</robot>", '<drake:joint xmlns:drake="d"/></robot>')
    assert notes(tmp_path, text).startswith(
        "ignored, since URDF has no such elements and attributes: kind= in <link> (3 times), "
    )
    for name in ("<gravity> in <link>", "<origin> in <link>", "<drake:joint> in <robot>"):
        assert name in notes(tmp_path, text.replace('kind="x"', "").replace('current="3"', ""))


def test_long_names_are_shortened(tmp_path: Path) -> None:
    text = FULL.replace("<limit ", f'<limit {"q" * 5000}="3" ')
    assert len(notes(tmp_path, text)) < 200


def test_the_number_of_unknown_names_is_limited() -> None:
    names = "".join(f"<q{i}/>" for i in range(MAX_UNKNOWN))
    check_urdf(FULL.replace("</robot>", f"{names}</robot>"))
    with pytest.raises(ModelError, match="more than 10,000 names that URDF does not have"):
        check_urdf(FULL.replace("</robot>", f"{names}<one_more/></robot>"))


# Links without inertia


def chain_without(*links: str, shape: bool = True) -> str:
    """A chain of three rods and a frame at its tip, with some inertias taken away."""
    robot = ElementTree.fromstring(chain(3))
    for name in links:
        link = robot.find(f"link[@name='{name}']")
        assert link is not None
        for part in list(link):
            if part.tag == "inertial" or not shape:
                link.remove(part)
    return ElementTree.tostring(robot, encoding="unicode")


def test_moving_links_without_inertia_are_reported(tmp_path: Path) -> None:
    assert notes(tmp_path, chain_without()) == ""  # the tip is a frame, and the base does not move
    for shape in (True, False):
        assert notes(tmp_path, chain_without("link1", "link3", shape=shape)) == (
            "link1, link3: moving without <inertial>, so without mass and inertia"
        )


def test_a_shape_on_a_moving_frame_needs_an_inertia_too(tmp_path: Path) -> None:
    ball = (
        '<link name="tip"><collision><geometry><sphere radius="1"/></geometry></collision></link>'
    )
    text = chain_without().replace('<link name="tip" />', ball)
    assert text != chain_without()
    assert notes(tmp_path, text).startswith("tip: moving without")


def test_links_that_do_not_move_need_no_inertia(tmp_path: Path) -> None:
    (tmp_path / "chain.urdf").write_text(chain_without("link1", "link2"))
    robot = load_robot(tmp_path / "chain.urdf", locked=["joint1"])
    assert "  link2: moving without <inertial>" in robot.describe()
    floating = load_robot(tmp_path / "chain.urdf", free_flyer=True, locked=["joint1", "joint2"])
    assert "  link1, link2: moving without <inertial>" in floating.describe()
