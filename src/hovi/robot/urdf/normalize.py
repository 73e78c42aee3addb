"""Rewrites a checked URDF in a form that Pinocchio reads as the check does.

Pinocchio's parser reads the mass " 1.5" as 0, does not accept tabs between numbers and stops at
processing instructions. The rewritten text has single spaces between numbers, all their digits, and
only the elements that Pinocchio uses.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

from hovi.robot.urdf.check import checked_urdf
from hovi.robot.urdf.elements import NUMBERS, elements_in_use

_PARTS = {
    "link": ("inertial",),
    "joint": ("origin", "axis", "parent", "child", "limit", "dynamics"),
}


def plain_urdf(text: str, name: str = "robot.urdf") -> str:
    """The URDF with its links' inertias and its joints, without geometry.

    text: of the URDF. name: for messages. Raises ModelError as check_urdf does.
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
    """Rewrite every number of a checked URDF with all digits and single spaces, in place.

    Text is removed, and so is an empty <dynamics/>, since Pinocchio's parser stops at it.
    """
    for element in robot.iter():
        element.text = element.tail = None
    for joint in robot.iterfind("joint"):
        for dynamics in joint.findall("dynamics"):
            if {"damping", "friction"}.isdisjoint(dynamics.attrib):
                joint.remove(dynamics)
    for _, element in elements_in_use(robot):
        for attribute in NUMBERS.get(element.tag, {}):
            if (text := element.get(attribute)) is not None:
                element.set(attribute, " ".join(repr(float(word)) for word in text.split()))
