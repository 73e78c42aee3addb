"""A checked URDF written again, plainly, so that Pinocchio reads what the check has read.

Its parser takes the mass " 1.5" for 0, knows no tab between two numbers and stops at instructions
to other programs. What it gets has one space between numbers, each with every digit, and nothing
that it would not use.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

from hovi.robot.urdf.check import checked_urdf
from hovi.robot.urdf.rules import NUMBERS, elements_in_use

_PARTS = {
    "link": ("inertial",),
    "joint": ("origin", "axis", "parent", "child", "limit", "dynamics"),
}


def plain_urdf(text: str, name: str = "robot.urdf") -> str:
    """Links with their inertias and joints, without shapes.

    text: of the URDF. name: what to call it in a message. Raises ModelError as check_urdf does.
    """
    robot = checked_urdf(text, name)
    plain = ElementTree.Element("robot", name=robot.get("name", ""))
    for element in robot:
        if element.tag in _PARTS:
            copy = ElementTree.SubElement(plain, element.tag, dict(element.attrib))
            copy.extend(part for part in element if part.tag in _PARTS[element.tag])
    make_plain(plain)
    return ElementTree.tostring(plain, encoding="unicode")


def make_plain(robot: ElementTree.Element) -> None:
    """Every number of a checked URDF with all its digits and single spaces between, in place.

    A <dynamics/> that says nothing goes, since Pinocchio's parser stops at it.
    """
    for joint in robot.iterfind("joint"):
        for dynamics in joint.findall("dynamics"):
            if {"damping", "friction"}.isdisjoint(dynamics.attrib):
                joint.remove(dynamics)
    for _, element in elements_in_use(robot):
        for attribute in NUMBERS.get(element.tag, {}):
            if (text := element.get(attribute)) is not None:
                element.set(attribute, " ".join(repr(float(word)) for word in text.split()))
