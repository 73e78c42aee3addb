"""A link that is added to a URDF, joined to one of its links."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence

import numpy as np
import pinocchio as pin

from hovi.robot.urdf.check import checked_urdf
from hovi.system.dataclass import dataclass

_JOINT_ENDING = "_grasp"
"""Ending of the name of the joint of a link that is added, after the name of the link."""
_COLOR = "0.30 0.55 0.35 1"
"""Of a link that is added: green."""


@dataclass(frozen=True, eq=False)
class UrdfShape:
    """A shape as URDFs name it: its element, its sizes, and its pose in the link's frame."""

    element: str
    sizes: Mapping[str, str]
    placement: pin.SE3


@dataclass(frozen=True, eq=False)
class AddedLink:
    """A link with its shapes, for contact and for viewing alike.

    parent: the link that it is joined to. placement: of its frame in that of the parent.
    body: its inertia in its own frame; None for a link without mass.
    """

    name: str
    parent: str
    placement: pin.SE3
    body: pin.Inertia | None
    shapes: Sequence[UrdfShape]


def with_link(text: str, name: str, added: AddedLink) -> str:
    """The text of a URDF with one more link. name: of the URDF in messages. Raises ModelError."""
    robot = checked_urdf(text, name)
    link = ElementTree.SubElement(robot, "link", {"name": added.name})
    if added.body is not None:
        _inertial(link, added.body)
    for shape in added.shapes:
        for kind in ("visual", "collision"):
            element = ElementTree.SubElement(link, kind)
            _origin(element, shape.placement)
            geometry = ElementTree.SubElement(element, "geometry")
            ElementTree.SubElement(geometry, shape.element, dict(shape.sizes))
            if kind == "visual":
                color = {"name": f"{added.name}_color"}
                material = ElementTree.SubElement(element, "material", color)
                ElementTree.SubElement(material, "color", {"rgba": _COLOR})
    name = added.name + _JOINT_ENDING
    joint = ElementTree.SubElement(robot, "joint", {"name": name, "type": "fixed"})
    _origin(joint, added.placement)
    ElementTree.SubElement(joint, "parent", {"link": added.parent})
    ElementTree.SubElement(joint, "child", {"link": added.name})
    return ElementTree.tostring(robot, encoding="unicode")


def _inertial(link: ElementTree.Element, body: pin.Inertia) -> None:
    inertial = ElementTree.SubElement(link, "inertial")
    _origin(inertial, pin.SE3(np.eye(3), body.lever))
    ElementTree.SubElement(inertial, "mass", {"value": repr(float(body.mass))})
    tensor = np.asarray(body.inertia)
    names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2)}
    entries = {key: repr(float(tensor[at])) for key, at in {**names, "izz": (2, 2)}.items()}
    ElementTree.SubElement(inertial, "inertia", entries)


def added_links(model: pin.Model) -> frozenset[str]:
    """Names of the links of a model that `with_link` added to its URDF."""
    frames = list(model.frames)
    return frozenset(
        str(frame.name)
        for frame in frames
        if frame.type == pin.FrameType.BODY
        and frames[frame.parentFrame].name == frame.name + _JOINT_ENDING
    )


def _origin(element: ElementTree.Element, placement: pin.SE3) -> None:
    numbers = {"xyz": placement.translation, "rpy": pin.rpy.matrixToRpy(placement.rotation)}
    texts = {key: " ".join(repr(float(x)) for x in xs) for key, xs in numbers.items()}
    ElementTree.SubElement(element, "origin", texts)
