"""The rules of a URDF, one function each, which yields a sentence for every violation.

They require what RNEA needs and no more: published robots violate the triangle inequality of the
principal inertias by factors of five, and mimic joints that do not exist; both load.
"""

from __future__ import annotations

import math
import posixpath
import re
from collections import Counter
from collections.abc import Callable, Iterator
from xml.etree.ElementTree import Element

import numpy as np

from hovi.errors import nearest
from hovi.robot.urdf.elements import NUMBERS, elements_in_use, tag_and_name
from hovi.robot.urdf.spelling import names_are_of_urdf, values_are_attributes

Rule = Callable[[Element], Iterator[str]]

MAX_MAGNITUDE = 1e12
MAX_LIMIT = 1e30
"""For limits, which are only compared; some URDFs write 1e16 for "no limit"."""

MAX_NAME = 256

MAX_SHAPES = 1_000
"""Largest number of visual shapes, and of collision shapes."""

INERTIA_TOLERANCE = 1e-7
"""Largest negative principal inertia, in [kg m^2], accepted as a rounding error of CAD exports."""

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")

_WORLD = "universe"

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)

_INERTIA = tuple(NUMBERS["inertia"])

_ONCE: dict[str, tuple[str, ...]] = {
    "link": ("inertial",),
    "inertial": ("origin", "mass", "inertia"),
    "visual": ("origin", "geometry", "material"),
    "collision": ("origin", "geometry"),
    "joint": ("origin", "axis", "parent", "child", "limit", "dynamics", "mimic"),
}
"""Children that an element has at most once: Pinocchio would ignore all but the first."""

_REQUIRED: dict[str, tuple[str, ...]] = {
    "mass": ("value",),
    "inertia": _INERTIA,
    "mesh": ("filename",),
    "mimic": ("joint",),
    "parent": ("link",),
    "child": ("link",),
    "limit": ("effort", "velocity"),
    "safety_controller": ("k_velocity",),
}


def nothing_is_xacro(robot: Element) -> Iterator[str]:
    """No element of xacro is left that would have to be run."""
    for element in robot.iter():
        if element.tag.startswith("xacro:"):
            yield f"<{element.tag[:40]}> is xacro, not URDF: run xacro on the file first."


def the_robot_is_named(robot: Element) -> Iterator[str]:
    """The robot has a name."""
    name = robot.get("name", "")
    if not name.strip():
        yield "<robot> needs name=."
    elif problem := _name_problem(name):
        yield f"the name {_short(name)} of <robot> must {problem}."


def links_are_named(robot: Element) -> Iterator[str]:
    """There is a link, and the names of links are unique."""
    if robot.find("link") is None:
        yield "it has no <link>: a robot needs at least one."
    yield from _named(robot, "link")


def shapes_are_few(robot: Element) -> Iterator[str]:
    """There are not too many shapes: the time to read them grows with their cube."""
    for tag in ("visual", "collision"):
        count = sum(len(link.findall(tag)) for link in robot.iterfind("link"))
        if count > MAX_SHAPES:
            yield f"it has {count:,} elements <{tag}>, at most {MAX_SHAPES:,} are accepted."


def joints_are_named(robot: Element) -> Iterator[str]:
    """The names of joints are unique."""
    yield from _named(robot, "joint")


def joints_have_a_type(robot: Element) -> Iterator[str]:
    """The type of a joint is one that URDF defines."""
    for joint in robot.iterfind("joint"):
        kind = joint.get("type", "")
        if kind not in JOINT_TYPES:
            yield f"joint {_name(joint)} has type {_short(kind)}; {nearest(kind, JOINT_TYPES)}"


def elements_are_not_repeated(robot: Element) -> Iterator[str]:
    """Children of links and joints that may occur once occur once."""
    for owner in (*robot.iterfind("link"), *robot.iterfind("joint")):
        for element in (owner, *owner):
            for tag in _ONCE.get(element.tag, ()):
                if (count := len(element.findall(tag))) > 1:
                    yield (
                        f"<{element.tag}> of {tag_and_name(owner)} has {count} elements <{tag}>, "
                        "of which other readers take the first: keep one."
                    )


def attributes_are_there(robot: Element) -> Iterator[str]:
    """Attributes without a default are present."""
    for owner, element in elements_in_use(robot):
        for attribute in _REQUIRED.get(element.tag, ()):
            if not element.get(attribute):
                yield f"<{element.tag}> of {tag_and_name(owner)} needs {attribute}=."


def numbers_are_finite(robot: Element) -> Iterator[str]:
    """Numbers are finite decimal numbers of limited magnitude, as many as expected."""
    for owner, element in elements_in_use(robot):
        for attribute, count in NUMBERS.get(element.tag, {}).items():
            text = element.get(attribute)
            if text is not None and (problem := _number_problem(text, count, element.tag)):
                place = f"<{element.tag} {attribute}={_short(text)}> of {tag_and_name(owner)}"
                yield f"{place} must be {problem}."


def joints_connect_links(robot: Element) -> Iterator[str]:
    """Both ends of a joint are links of this robot."""
    links = {link.get("name", "") for link in robot.iterfind("link")}
    for joint in robot.iterfind("joint"):
        for end in ("parent", "child"):
            link = _end(joint, end)
            if not link:
                yield f"joint {_name(joint)} needs <{end} link=...>."
            elif link not in links:
                yield (
                    f"joint {_name(joint)} has {end} link {_short(link)}, which does not exist: "
                    + (nearest(link, links))
                )


def links_have_one_parent(robot: Element) -> Iterator[str]:
    """A link is the child of at most one joint."""
    parents: dict[str, str] = {}
    for joint in robot.iterfind("joint"):
        child = _end(joint, "child")
        if child in parents:
            yield (
                f"link {child!r} is the child of two joints, {parents[child]} and {_name(joint)}: "
                "a URDF is a tree, so cut the loop at one of them."
            )
        parents[child] = _name(joint)


def links_form_one_tree(robot: Element) -> Iterator[str]:
    """There is no cycle, and one root."""
    parent = {_end(j, "child"): _end(j, "parent") for j in robot.iterfind("joint")}
    links = [link.get("name", "") for link in robot.iterfind("link")]
    grounded = set(links) - set(parent)
    for link in links:
        walked: dict[str, None] = {}
        while link not in grounded and link not in walked:
            walked[link] = None
            link = parent[link]
        if link in walked:
            yield f"link {link!r} is its own ancestor: a URDF is a tree, so cut that cycle."
            return
        grounded.update(walked)
    roots = [link for link in links if link not in parent]
    if len(roots) > 1:
        yield (
            f"it has {len(roots)} root links ({', '.join(map(repr, roots[:4]))}): "
            "connect all but one to the tree with a joint."
        )


def masses_are_not_negative(robot: Element) -> Iterator[str]:
    """Masses are 0 or more."""
    for link in robot.iterfind("link"):
        for mass in link.iterfind("inertial/mass"):
            if float(mass.get("value", "0")) < 0.0:
                yield f"link {_name(link)} has mass {mass.get('value')} kg: give 0 or more."


def inertias_are_complete(robot: Element) -> Iterator[str]:
    """An inertial element has both a mass and an inertia."""
    for link in robot.iterfind("link"):
        for inertial in link.iterfind("inertial"):
            for tag in ("mass", "inertia"):
                if inertial.find(tag) is None:
                    yield f"<inertial> of link {_name(link)} needs a <{tag}>."


def inertias_are_positive(robot: Element) -> Iterator[str]:
    """Inertia tensors are positive semi-definite, up to the rounding of CAD exports."""
    for link in robot.iterfind("link"):
        for inertia in link.iterfind("inertial/inertia"):
            xx, xy, xz, yy, yz, zz = (float(inertia.get(key, "0")) for key in _INERTIA)
            values = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            if values[0] < -INERTIA_TOLERANCE - 1e-6 * abs(values[-1]):
                yield (
                    f"link {_name(link)} has a principal inertia of {values[0]:.3g} kg m^2: "
                    "the inertia tensor must be positive semi-definite; check ixx ... izz."
                )


def shapes_have_a_size(robot: Element) -> Iterator[str]:
    """Sizes of shapes are not negative."""
    for owner, element in elements_in_use(robot):
        for attribute in ("size", "radius", "length"):
            text = element.get(attribute) if element.tag in NUMBERS else None
            if text is not None and min(map(float, text.split())) < 0.0:
                place = f"<{element.tag} {attribute}={_short(text)}> of {tag_and_name(owner)}"
                yield f"{place} is negative."


def axes_are_not_zero(robot: Element) -> Iterator[str]:
    """The axis of a joint is not zero."""
    for joint in robot.iterfind("joint"):
        axis = joint.find("axis")
        if axis is None or joint.get("type") in ("fixed", "floating"):
            continue
        if math.hypot(*map(float, axis.get("xyz", "1 0 0").split())) < 1e-9:
            yield f"joint {_name(joint)} has the axis {axis.get('xyz')!r}: give a nonzero vector."


def planes_are_level(robot: Element) -> Iterator[str]:
    """The normal of a planar joint is +z, the only one that Pinocchio supports."""
    for joint in robot.iterfind("joint"):
        axis = joint.find("axis")
        xyz = "1 0 0" if axis is None else axis.get("xyz", "1 0 0")
        x, y, z = map(float, xyz.split())
        if joint.get("type") == "planar" and math.hypot(x, y) > 1e-9 * z:
            yield (
                f"joint {_name(joint)} is planar with the normal {_short(xyz)}, and only the "
                'normal +z is supported: write <axis xyz="0 0 1"/> and rotate its <origin>.'
            )


def limits_are_ordered(robot: Element) -> Iterator[str]:
    """Limits are present where URDF requires them, ordered and not negative."""
    for joint in robot.iterfind("joint"):
        limit = joint.find("limit")
        if limit is None:
            if joint.get("type") in ("revolute", "prismatic"):
                yield (
                    f"joint {_name(joint)} is {joint.get('type')} and needs "
                    "<limit lower= upper= effort= velocity=>."
                )
            continue
        lower, upper = limit.get("lower", "0"), limit.get("upper", "0")
        if float(lower) > float(upper):
            yield (
                f"joint {_name(joint)} has limits with lower={lower} above upper={upper}, which "
                "other readers take as they are, so that no position is allowed: swap them."
            )
        for attribute in ("effort", "velocity"):
            if float(limit.get(attribute, "0")) < 0.0:
                yield f"joint {_name(joint)} has a negative {attribute} limit: give 0 or more."


def losses_are_not_negative(robot: Element) -> Iterator[str]:
    """Damping and friction are not negative."""
    for joint in robot.iterfind("joint"):
        for dynamics in joint.iterfind("dynamics"):
            for attribute in NUMBERS["dynamics"]:
                if float(dynamics.get(attribute, "0")) < 0.0:
                    yield f"joint {_name(joint)} has a negative {attribute}: give 0 or more."


def joints_mimic_others(robot: Element) -> Iterator[str]:
    """No joint mimics itself."""
    for joint in robot.iterfind("joint"):
        for mimic in joint.iterfind("mimic"):
            if mimic.get("joint") == joint.get("name"):
                yield f"joint {_name(joint)} mimics itself: name another joint or drop <mimic>."


def meshes_stay_in_their_package(robot: Element) -> Iterator[str]:
    """A package:// path does not leave its package."""
    for owner, element in elements_in_use(robot):
        filename = element.get("filename", "") if element.tag in ("mesh", "texture") else ""
        scheme, separator, rest = filename.partition("://")
        rest = rest.lstrip("/")
        package = rest.split("/", 1)[0]
        inside = posixpath.normpath(rest).startswith(f"{package}/")
        if separator and scheme != "file" and (package in ("", ".", "..") or not inside):
            yield (
                f"{element.tag} {_short(filename)} of {tag_and_name(owner)} leaves its package: "
                "write package://<package>/<path inside it>."
            )


def is_decimal(word: str) -> bool:
    """Whether a word is a decimal number in ASCII; `float` reads 1_0 and other digits, too."""
    return _NUMBER.fullmatch(word) is not None


RULES: tuple[Rule, ...] = (
    nothing_is_xacro,
    names_are_of_urdf,
    values_are_attributes,
    the_robot_is_named,
    links_are_named,
    shapes_are_few,
    joints_are_named,
    joints_have_a_type,
    elements_are_not_repeated,
    attributes_are_there,
    numbers_are_finite,
    joints_connect_links,
    links_have_one_parent,
    links_form_one_tree,
    inertias_are_complete,
    masses_are_not_negative,
    inertias_are_positive,
    shapes_have_a_size,
    axes_are_not_zero,
    planes_are_level,
    limits_are_ordered,
    losses_are_not_negative,
    joints_mimic_others,
    meshes_stay_in_their_package,
)
"""Checked in this order: a rule may rely on those before it."""


def _named(robot: Element, tag: str) -> Iterator[str]:
    names = Counter(element.get("name", "") for element in robot.iterfind(tag))
    for name, count in names.items():
        if not name.strip():
            yield f"a <{tag}> has no name: every {tag} needs name=."
        elif problem := _name_problem(name):
            yield f"the name {_short(name)} of a {tag} must {problem}."
        elif name == _WORLD:
            yield f"a {tag} cannot be named {name!r}, Pinocchio's name for the world frame."
        elif count > 1:
            yield f"{tag} {name!r} occurs {count} times: {tag} names must be unique."


def _number_problem(text: str, count: int, tag: str) -> str:
    words = text.split()
    largest = MAX_LIMIT if tag in ("limit", "safety_controller") else MAX_MAGNITUDE
    if len(words) != count:
        return "one number" if count == 1 else f"{count} numbers separated by spaces"
    if not all(map(is_decimal, words)):
        return "a plain finite number such as 1.5 (decimal point, no units)"
    if max(abs(float(word)) for word in words) > largest:
        return f"at most {largest:g} in magnitude"
    return ""


def _name_problem(name: str) -> str:
    if len(name) > MAX_NAME:
        return f"have at most {MAX_NAME} characters"
    return "" if name.isprintable() else "contain printable characters only"


def _end(joint: Element, tag: str) -> str:
    element = joint.find(tag)
    return "" if element is None else element.get("link", "")


def _name(element: Element) -> str:
    return repr(element.get("name", ""))


def _short(text: str) -> str:
    return repr(text if len(text) <= 60 else text[:57] + "...")
