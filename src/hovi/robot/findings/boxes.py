"""The shapes of a URDF by their bounding boxes, which give sizes without a mesh library."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import ModelError
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Bounds = tuple[Array, Array]
"""Least and largest coordinates, (3,) each, in [m]."""


@dataclass(frozen=True, eq=False)
class ShapeBox:
    """A shape of a link.

    link: its name. kind: "visual" or "collision". number: among those of the link, from 1.
    corners: of its box in the frame of the link, (8, 3), in [m]; (0, 3) with a problem.
    mesh: the name of its file, "" for others. scale: of the mesh, (3,).
    problem: why its mesh cannot be used, as a sentence, or "".
    """

    link: str
    kind: str
    number: int
    corners: Array
    mesh: str = ""
    scale: tuple[float, ...] = ()
    problem: str = ""

    @property
    def where(self) -> str:
        """The path of its <geometry>."""
        return f"link[@name={quoted(self.link)}]/{self.kind}[{self.number}]/geometry"

    @property
    def extent(self) -> float:
        """Its largest side, in [m]; 0 with a problem."""
        return float(np.ptp(self.corners, axis=0).max()) if len(self.corners) else 0.0


def quoted(name: str) -> str:
    """A name in quotes, as XPath has them."""
    return f'"{name}"' if "'" in name else f"'{name}'"


def shape_boxes(robot: Element, bounds: Callable[[str], Bounds]) -> Iterator[ShapeBox]:
    """The shapes of a checked URDF. bounds: of a mesh by the name of its file, or ModelError."""
    for link in robot.iterfind("link"):
        for kind in ("visual", "collision"):
            for number, shape in enumerate(link.iterfind(kind), 1):
                yield _box(link.get("name", ""), kind, number, shape, bounds)


def _box(
    link: str, kind: str, number: int, shape: Element, bounds: Callable[[str], Bounds]
) -> ShapeBox:
    mesh = shape.find("geometry/mesh")
    file = "" if mesh is None else mesh.get("filename", "")
    scale = (1.0,) * 3 if mesh is None else tuple(_numbers(mesh, "scale", "1 1 1"))
    try:
        low, high = _primitive(shape) if mesh is None else bounds(file)
    except ModelError as error:
        return ShapeBox(link, kind, number, np.empty((0, 3)), file, scale, str(error))
    inner = np.array(list(itertools.product(*zip(low * scale, high * scale, strict=True))))
    origin = shape.find("origin")
    at = Element("origin") if origin is None else origin
    rotation = pin.rpy.rpyToMatrix(np.array(_numbers(at, "rpy", "0 0 0")))
    corners = inner @ rotation.T + _numbers(at, "xyz", "0 0 0")
    return ShapeBox(link, kind, number, corners, file, scale)


def _primitive(shape: Element) -> Bounds:
    half = np.zeros(3)
    for each in shape.iterfind("geometry/*"):
        if each.tag == "box":
            half = np.array(_numbers(each, "size", "0 0 0")) / 2
        elif each.tag in ("sphere", "cylinder", "capsule"):
            radius, length = (float(each.get(key, "0")) for key in ("radius", "length"))
            ends = {"sphere": radius, "cylinder": length / 2, "capsule": length / 2 + radius}
            half = np.array([radius, radius, ends[each.tag]])
    return -half, half


def _numbers(element: Element, key: str, default: str) -> list[float]:
    return [float(word) for word in element.get(key, default).split()]
