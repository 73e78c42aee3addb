"""Mutated URDFs, and the properties of those that load.

The loaded robot must agree with the text, which is read here independently by an XML parser and
`float`. If a motion can be planned on it, its mass matrix, computed by RNEA rather than by the
routine of the check, must be positive definite.
"""

from __future__ import annotations

import contextlib
import copy
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin

from hard.mutated_bytes import mutated_bytes
from hard.verdict import Mutant, Verdict, judge
from hovi.cli.reports.findings import findings_of
from hovi.errors import HoviError
from hovi.robot.bundled_models import example
from hovi.robot.example_robots import example_robot
from hovi.robot.findings.finding import COMMAND_LINE, PYTHON, SRDF
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot

UNUSUAL_NUMBERS = (
    *("NaN", "-nan", "inf", "-inf", "1,5", "1abc", "0x10", "1_0", "1e308", "-1e308", "1e999"),
    *("1e-320", "1e-400", "-1", "0", "-0", "", " ", " 2 ", "\t3", "1 2", "1e", "--1", "٣", "1."),
    *(".5", "+.5", "1e12", "1e13", "1E-9", "9" * 400, "0." + "0" * 400 + "1", "1e+1", "1d0"),
)
NOT_A_MASS = ("NaN", "inf", "-inf", "1,5", "1abc", "0x10", "1_0", "1e308", "1e999", "-1", "", "1 2")
TOKENS = (
    *(b"<link/>", b"<joint>", b"</robot>", b"</link>", b"<!--", b"-->", b"<![CDATA[", b"]]>"),
    *(b'<!DOCTYPE a [<!ENTITY b "c">]>', b"&b;", b"&#0;", b"&#x9b;", b"<?a b?>", b"\xff\xfe"),
    *(b"\0", b'"', b"'", b"NaN", b"1,5", b"-1", b"1e308", b"../../..", b"\xef\xbb\xbf", b"="),
    *(b'<?xml version="1.0" encoding="klingon"?>', b"<a>" * 70, b"revolute", b"floating", b"0"),
)

Change = Callable[[Element, Random], None]


@cache
def _originals() -> tuple[str, ...]:
    shipped = [example(name).read_text() for name in ("two_link.urdf", "pendulum.urdf")]
    return (*shipped, *(example_robot(n).urdf.read_text() for n in ("double_pendulum", "ur5")))


def mutate(random: Random) -> Mutant:
    """A changed URDF: in its bytes, in its tree, or with an invalidating change."""
    text = random.choice(_originals())
    kind = random.random()
    if kind < 0.3:
        return Mutant(mutated_bytes(text.encode(), random, TOKENS))
    robot = ElementTree.fromstring(text)
    if kind < 0.65:
        for _ in range(random.randint(1, 3)):
            random.choice(_CHANGES)(robot, random)
        return Mutant(ElementTree.tostring(robot))
    change = random.choice(_INVALIDATING_CHANGES)
    change(robot, random)
    return Mutant(ElementTree.tostring(robot), (change.__doc__ or "").split("\n")[0])


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Load it from a file in `folder`."""
    path = folder / "robot.urdf"
    path.write_bytes(mutant.content)
    return judge(lambda: load_robot(path), error_in, mutant.reason)


def error_in(robot: Robot) -> str:
    """The error in a loaded robot; "" if there is none."""
    assert robot.source.urdf is not None
    robot.describe()
    text = ElementTree.fromstring(robot.source.urdf)
    return _number_error(robot, text) or _mass_matrix_error(robot) or _line_error(robot, text)


def _line_error(robot: Robot, text: Element) -> str:
    """Lines that would mend the file are elements, and have a place in it."""
    for line in (line for found in findings_of(robot) for line in found.lines):
        if line.where in (SRDF, PYTHON, COMMAND_LINE):
            continue
        ElementTree.fromstring(line.text)
        if text.find(line.where) is None:
            return f"there is no {line.where} for {line.text}"
    return ""


def _number_error(robot: Robot, text: Element) -> str:
    model = robot.model
    masses = {
        link.get("name"): float(link.find("inertial/mass").get("value"))  # type: ignore[union-attr, arg-type]
        for link in text.iterfind("link")
        if link.find("inertial") is not None
    }
    children = {joint.find("child").get("link") for joint in text.iterfind("joint")}  # type: ignore[union-attr]
    moved = sum(mass for link, mass in masses.items() if link in children)
    read = sum(inertia.mass for inertia in model.inertias)
    whole = sum(masses.values())
    if not min(abs(read - moved), abs(read - whole)) <= 1e-12 * abs(read):
        return f"its masses are {moved} kg (with the base {whole} kg), and {read} kg were read"
    for joint in text.iterfind("joint"):
        if joint.get("type") in ("revolute", "prismatic"):
            limit, read = joint.find("limit"), model.joints[model.getJointId(joint.get("name"))]
            wanted = [float(limit.get(key, "0")) for key in ("lower", "upper", "effort")]  # type: ignore[union-attr]
            got = (robot.lower[read.idx_q], robot.upper[read.idx_q], robot.effort_limit[read.idx_v])
            if wanted != list(got):
                return f"joint {joint.get('name')!r} has limits {wanted}, and {got} were read"
    numbers = [*np.concatenate([i.toDynamicParameters() for i in model.inertias])]
    numbers += [x for place in model.jointPlacements for x in place.homogeneous.ravel()]
    return "" if np.isfinite(numbers).all() else "it holds numbers that are not finite"


def _mass_matrix_error(robot: Robot) -> str:
    """Check M from columns of RNEA, at configurations that the library's check does not use."""
    try:
        robot.check_mass_matrix()
    except HoviError:
        return ""  # no motion can be planned on it
    model, data = robot.model, robot.model.createData()
    model = model.copy()
    model.gravity = pin.Motion.Zero()
    rng, zero = np.random.default_rng(77), np.zeros(model.nv)
    for _ in range(3):
        q = pin.integrate(model, pin.neutral(model), rng.uniform(-3.0, 3.0, model.nv))
        columns = [pin.rnea(model, data, q, zero, e).copy() for e in np.eye(model.nv)]
        M = np.array(columns).reshape(model.nv, model.nv)
        scale = 1 / np.sqrt(np.clip(np.diagonal(M), 1e-300, None))
        values = np.linalg.eigvalsh(scale[:, None] * (M + M.T) / 2 * scale)
        if not (np.isfinite(M).all() and (model.nv == 0 or values[0] > 0.0)):
            return f"its mass matrix is not positive definite: {values[0]}"
    return ""


# Changes after which the file may or may not be valid


def _number(robot: Element, random: Random) -> None:
    holders = [e for e in robot.iter() if e.attrib]
    element = random.choice(holders)
    element.set(random.choice(list(element.attrib)), random.choice(UNUSUAL_NUMBERS))


def _component(robot: Element, random: Random) -> None:
    vectors = [(e, k) for e in robot.iter() for k in ("xyz", "rpy", "size") if e.get(k, "").split()]
    element, key = random.choice(vectors)
    words = element.get(key, "").split()
    words[random.randrange(len(words))] = random.choice(UNUSUAL_NUMBERS)
    element.set(key, random.choice((" ", "  ", "\t", "\n", ",")).join(words))


def _remove(robot: Element, random: Random) -> None:
    parent = random.choice([e for e in robot.iter() if len(e)])
    parent.remove(random.choice(list(parent)))


def _repeat(robot: Element, random: Random) -> None:
    parent = random.choice([e for e in robot.iter() if len(e)])
    parent.append(copy.deepcopy(random.choice(list(parent))))


def _move(robot: Element, random: Random) -> None:
    parent, other = random.choices([e for e in robot.iter() if len(e)], k=2)
    other.append(copy.deepcopy(random.choice(list(parent))))


def _rename(robot: Element, random: Random) -> None:
    names = [e for e in robot.iter() if e.get("name") or e.get("link")]
    element, other = random.choices(names, k=2)
    key = "name" if element.get("name") else "link"
    unusual = ("", " ", "universe", "a" * 300, "\x85", "ä", "root_joint", "x\ny")
    element.set(key, random.choice((other.get("name") or other.get("link") or "", *unusual)))


def _retype(robot: Element, random: Random) -> None:
    types = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar", "screw", "")
    random.choice(robot.findall("joint")).set("type", random.choice(types))


def _scale(robot: Element, random: Random) -> None:
    key = random.choice(("value", "ixx", "iyy", "izz"))
    factor = 10.0 ** random.randint(-30, 14)
    for element in robot.iter():
        if element.get(key) and element.tag in ("mass", "inertia"):
            with contextlib.suppress(ValueError):  # an earlier change has put in no number
                element.set(key, repr(float(element.get(key, "0")) * factor))


def _lengthen(robot: Element, random: Random) -> None:
    parent = robot.findall("link")[-1].get("name", "")
    for i in range(random.choice((1, 3, 30, 300))):
        link = ElementTree.SubElement(robot, "link", name=f"more{i}")
        link.extend(copy.deepcopy(e) for e in robot.findall("link/inertial")[:1])
        joint = ElementTree.SubElement(robot, "joint", name=f"more{i}_joint", type="continuous")
        ElementTree.SubElement(joint, "parent", link=parent)
        ElementTree.SubElement(joint, "child", link=link.get("name", ""))
        ElementTree.SubElement(joint, "axis", xyz="0 0 1")
        parent = link.get("name", "")


_CHANGES: tuple[Change, ...] = (
    *(_number, _number, _component, _remove, _repeat, _move, _rename, _retype, _scale, _lengthen),
)

# Changes that make the file invalid; the docstring is the reason


def _mass(robot: Element, random: Random) -> None:
    """a mass is not a number of kilograms"""
    random.choice(robot.findall("link/inertial/mass")).set("value", random.choice(NOT_A_MASS))


def _inertia(robot: Element, random: Random) -> None:
    """a principal inertia is negative"""
    key = random.choice(("ixx", "iyy", "izz"))
    random.choice(robot.findall("link/inertial/inertia")).set(key, random.choice(("-1", "-1e-3")))


def _axis(robot: Element, random: Random) -> None:
    """an axis is zero"""
    moving = [j for j in robot.iterfind("joint[axis]") if j.get("type") != "fixed"]
    axis = random.choice(moving).find("axis")
    assert axis is not None
    axis.set("xyz", random.choice(("0 0 0", "0 -0 0.0", "0 0 1e-300")))


def _limits(robot: Element, random: Random) -> None:
    """a lower limit is above the upper one"""
    random.choice(robot.findall("joint/limit")).attrib.update(lower="1e3", upper="-1e-3")


def _mimic(robot: Element, random: Random) -> None:
    """a joint mimics itself"""
    joint = random.choice(robot.findall("joint"))
    ElementTree.SubElement(joint, "mimic", joint=joint.get("name", ""))


def _cycle(robot: Element, random: Random) -> None:
    """the links form a cycle"""
    joint, *_ = robot.findall("joint")
    parent, child = joint.find("parent"), joint.find("child")
    assert parent is not None
    assert child is not None
    parent.set("link", child.get("link", ""))


def _twice(robot: Element, random: Random) -> None:
    """a link or joint is there twice"""
    element = random.choice(robot.findall(random.choice(("link", "joint"))))
    robot.insert(random.randrange(len(robot)), copy.deepcopy(element))


def _mesh(robot: Element, random: Random) -> None:
    """a mesh lies outside its package"""
    visual = ElementTree.SubElement(random.choice(robot.findall("link")), "visual")
    shape = ElementTree.SubElement(visual, "geometry")
    name = random.choice(("../../etc/passwd", "a/../../b", "..", "./../x.stl", ""))
    ElementTree.SubElement(shape, "mesh", filename=f"package://{name}")


def _many(robot: Element, random: Random) -> None:
    """there are too many links"""
    for i in range(random.choice((1_000, 3_000, 20_000))):
        ElementTree.SubElement(robot, "link", name=f"more{i}")


def _misspell(robot: Element, random: Random) -> None:
    """a name is misspelt"""
    parts = [element for tag in ("link", "joint") for element in robot.iterfind(f"{tag}//*")]
    element = random.choice(parts)
    names = [None, *element.attrib]
    name = random.choice(names)
    wrong = _misspelt(name or element.tag, random)
    if name is None:
        element.tag = wrong
    elif wrong in element.attrib:  # as ixy for ixx
        _misspell(robot, random)
    else:
        element.set(wrong, element.attrib.pop(name))


def _misspelt(name: str, random: Random) -> str:
    at = random.randrange(len(name) - 1)
    ways = (name[:at] + name[at + 1 :], name[:at] + "q" + name[at:], name.capitalize())
    swapped = name[:at] + name[at + 1] + name[at] + name[at + 2 :]
    return random.choice([way for way in (*ways, swapped) if way != name])


def _misplace(robot: Element, random: Random) -> None:
    """an element is not where it belongs"""
    part = random.choice(robot.findall("link/inertial") + robot.findall("joint/axis"))
    places = robot.findall("link/visual") + robot.findall("joint/origin")
    (owner,) = (each for each in robot.iter() if part in list(each))
    owner.remove(part)
    random.choice(places).append(part)


_INVALIDATING_CHANGES: tuple[Change, ...] = (
    *(_mass, _mass, _inertia, _axis, _limits, _mimic, _cycle, _twice, _mesh, _many),
    *(_misspell, _misspell, _misplace),
)
