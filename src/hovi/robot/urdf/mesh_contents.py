"""Finds unusable meshes one by one, so that the robot keeps all other shapes."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin

MAX_COORDINATE = 1e9
"""Largest coordinate of a vertex, in [m]."""


def without_unreadable_meshes(text: str, kind: str) -> tuple[str, list[str]]:
    """A URDF without the shapes whose mesh cannot be read, and the reasons, one for each link.

    text: with absolute paths of meshes. kind: "visual" or "collision".
    """
    robot, problems = ElementTree.fromstring(text), []
    for link in robot.iterfind("link"):
        for shape in link.findall(kind):
            if problem := next(_problems_of(shape), ""):
                problems.append(f"link {link.get('name')!r}: {problem}")
                link.remove(shape)
    return ElementTree.tostring(robot, encoding="unicode"), problems


def remove_unusable_shapes(geometry: pin.GeometryModel, model: pin.Model) -> list[str]:
    """Remove meshes with coordinates that are not finite or too large; returns the reasons."""
    # All names are read before any removal, which moves the objects behind it in memory.
    unusable = {
        str(item.name): f"link {model.frames[item.parentFrame].name!r}: mesh "
        f"{Path(item.meshPath).name!r} has coordinates that are not finite, or larger than "
        f"{MAX_COORDINATE:g} m."
        for item in geometry.geometryObjects
        if isinstance(item.geometry, coal.BVHModelBase) and not _is_usable(item.geometry)
    }
    for name in unusable:
        geometry.removeGeometryObject(name)
    return list(unusable.values())


def _problems_of(shape: ElementTree.Element) -> Iterator[str]:
    for mesh in shape.iter("mesh"):
        path = Path(mesh.get("filename", "").removeprefix("file://"))
        try:
            coal.MeshLoader().load(str(path), np.ones(3))
        except (ValueError, RuntimeError) as error:
            yield f"mesh {path.name!r} cannot be read: {one_line(error)}."


def one_line(error: Exception) -> str:
    """Coal's last line about a file that is not a hint: those before are places in its source."""
    lines = [line.strip(" .") for line in str(error).splitlines()]
    lines = [line for line in lines if line and not line.startswith("Hint:")]
    return lines[-1] if lines else type(error).__name__


def _is_usable(shape: coal.BVHModelBase) -> bool:
    vertices = np.array(shape.vertices())
    return bool((np.abs(vertices) <= MAX_COORDINATE).all())  # false for what is not a number
