"""What real files have besides URDF, or against its rules, and what changes no robot.

It is taken out of the tree before the rules are checked, so that everything else may rely on them,
and `hovi info` notes it. Where it could change the dynamics, a limit or a shape it stays, and is
refused by a rule.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from xml.etree.ElementTree import Element

from hovi.robot.urdf.elements import NUMBERS, tag_and_name

XACRO = "xacro:"
DEFINITIONS = tuple(XACRO + each for each in ("property", "arg", "macro"))
"""Elements of xacro that do nothing where nothing refers to them."""
_INSERTED = "${", "$("
_TWICE = {"ixy": "iyx", "ixz": "izx", "iyz": "izy"}
"""The other names of what a symmetric matrix has twice."""

Notes = dict[str, list[str]]
"""Of each kind of note, a sentence without its beginning, the names that it is about."""


def without_harmless(robot: Element, stem: str) -> Notes:
    """Take out what changes nothing; returns the notes. stem: of the file's name."""
    notes: Notes = {}
    for step in _STEPS:
        for name, note in step(robot, stem):
            notes.setdefault(note, []).append(name)
    return notes


def _name(robot: Element, stem: str) -> Iterator[tuple[str, str]]:
    """A robot without a name has that of its file."""
    if not robot.get("name", "").strip():
        robot.set("name", stem)
        yield repr(stem), "the name of the file, as <robot> has none"


def _definitions(robot: Element, _: str) -> Iterator[tuple[str, str]]:
    """Definitions of xacro that nothing refers to are none."""
    values = [x for each in robot.iter() if XACRO not in each.tag for x in each.attrib.values()]
    if any(each in value for value in values for each in _INSERTED):
        return
    for parent in list(robot.iter()):
        for child in [each for each in parent if each.tag in DEFINITIONS]:
            parent.remove(child)
            yield f"<{child.tag}> {child.get('name', '')!r}", "ignored, since nothing refers to it"


def _materials(robot: Element, _: str) -> Iterator[tuple[str, str]]:
    """Of several materials of a shape the first is taken, as other readers do."""
    for link in robot.iterfind("link"):
        for shape in link.iterfind("visual"):
            for material in shape.findall("material")[1:]:
                shape.remove(material)
                yield tag_and_name(link), "of several <material> of a shape the first is taken"


def _transposed(robot: Element, _: str) -> Iterator[tuple[str, str]]:
    """The lower triangle of an inertia that agrees with the upper one says nothing new."""
    for link in robot.iterfind("link"):
        for inertia in link.iterfind("inertial/inertia"):
            both = {low: inertia.get(up) for up, low in _TWICE.items() if low in inertia.attrib}
            whole = all(up in inertia.attrib for up in _TWICE)
            if (
                both
                and whole
                and all(_number(inertia.attrib[low]) == _number(up) for low, up in both.items())
            ):
                for low in both:
                    del inertia.attrib[low]
                yield tag_and_name(link), f"{', '.join(both)} agree with the upper triangle"


def _fixed_axes(robot: Element, _: str) -> Iterator[tuple[str, str]]:
    """A fixed joint has no axis."""
    for joint in robot.iterfind("joint"):
        if joint.get("type") == "fixed":
            for axis in joint.findall("axis"):
                joint.remove(axis)
                if set(axis.attrib) != {"xyz"}:
                    yield tag_and_name(joint), "the <axis> of a fixed joint is ignored"


def _points(robot: Element, _: str) -> Iterator[tuple[str, str]]:
    """A mass without an inertia, on a link that is fixed to another one, is that of a point."""
    fixed = {
        child.get("link")
        for joint in robot.iterfind("joint")
        for child in joint.iterfind("child")
        if joint.get("type") == "fixed"
    }
    for link in robot.iterfind("link"):
        inertial = link.find("inertial")
        if inertial is None or link.get("name") not in fixed:
            continue
        if inertial.find("mass") is not None and inertial.find("inertia") is None:
            inertial.append(Element("inertia", dict.fromkeys(NUMBERS["inertia"], "0")))
            yield tag_and_name(link), "a mass without <inertia> is that of a point"


def _scales(robot: Element, _: str) -> Iterator[tuple[str, str]]:
    """One number as the scale of a mesh counts for all axes."""
    for link in robot.iterfind("link"):
        for mesh in link.iter("mesh"):
            scale = mesh.get("scale", "").split()
            if len(scale) == 1:
                mesh.set("scale", " ".join(3 * scale))
                yield tag_and_name(link), "one number as scale= counts for all axes of a mesh"


def _followers(robot: Element, _: str) -> Iterator[tuple[str, str]]:
    """Where a joint follows another one backwards, its limits are written in the other's order."""
    for joint in robot.iterfind("joint"):
        limit = joint.find("limit")
        if limit is None or joint.find("mimic") is None:
            continue
        lower, upper = limit.get("lower", "0"), limit.get("upper", "0")
        if _number(lower) > _number(upper):
            limit.attrib |= {"lower": upper, "upper": lower}
            yield tag_and_name(joint), "its limits are swapped, as it mimics another joint"


_STEPS = (
    _name,
    _definitions,
    _materials,
    _transposed,
    _fixed_axes,
    _points,
    _scales,
    _followers,
)


def _number(text: str | None) -> float:
    """The number that a text is; NaN for any other text."""
    try:
        return math.nan if text is None else float(text)
    except ValueError:
        return math.nan
