"""Meshes that are missing, or in millimetres."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from xml.etree.ElementTree import Element, tostring

from hovi.errors import some_of
from hovi.robot.findings.boxes import ShapeBox, quoted
from hovi.robot.findings.finding import COMMAND_LINE, Finding, Line, Severity, element
from hovi.robot.findings.subject import Subject

NOWHERE = "any package folder"
"""Where a mesh was looked for whose package is not known."""
HUGE = 20.0
"""Size of a mesh over the reach of the robot from which it looks like millimetres."""
LEAST = 5.0
"""Size of a mesh, in [m], below which it never does."""
ODD = 2.0
"""The same ratio from which other meshes of such a robot are in the same unit."""
TINY = 0.02
"""The ratio of the largest mesh below which the unit is the centimetre."""


def missing_meshes(
    subject: Subject, folder_of: Callable[[str], str], named: bool
) -> Iterator[Finding]:
    """Shapes whose meshes cannot be used.

    folder_of: the package folder of a mesh's file, or "". named: whether package folders were.
    """
    lost = [box for box in subject.boxes if box.problem]
    if not lost:
        return
    links = tuple(dict.fromkeys(box.link for box in lost))
    collide = sum(box.kind == "collision" for box in lost)
    effect = "links are drawn without them"
    if collide:
        effect = "links are not kept apart, and obstacles are refused"
    problem = lost[0].problem.removesuffix(".")
    yield Finding(
        Severity.MISLEADS if collide else Severity.HINT,
        "mesh",
        links,
        f"{len(lost)} of {sum(bool(box.mesh) for box in subject.boxes)} meshes cannot be used, so "
        f"that {effect}, at {some_of(links)}: {problem}",
        tuple(dict.fromkeys(line for box in lost for line in _folder_line(box, folder_of, named))),
    )


def _folder_line(box: ShapeBox, folder_of: Callable[[str], str], named: bool) -> Iterator[Line]:
    """The option for a mesh that is elsewhere; none if the folder that was named lacks it."""
    package = box.mesh.partition("://")[2].lstrip("/").partition("/")[0]
    if "was not found" not in box.problem:
        return
    folder = folder_of(box.mesh)
    if NOWHERE in box.problem or not package or not named:
        folder = folder or (f"FOLDER_THAT_HOLDS_{package}" if package else "FOLDER")
    if folder:
        yield Line(COMMAND_LINE, f"--package-dir {folder}")


def large_meshes(subject: Subject) -> Iterator[Finding]:
    """Meshes that are many times as large as the arm."""
    reach = subject.reach
    meshes = [box for box in subject.boxes if box.mesh]
    largest = max(meshes, key=lambda box: box.extent, default=None)
    if largest is None or not 0.0 < max(HUGE * reach, LEAST) < largest.extent or not reach:
        return
    factor, unit = 1e-3, "millimetres"
    if largest.extent * factor < TINY * reach:
        factor, unit = 1e-2, "centimetres"
    odd = [box for box in meshes if box.extent > ODD * reach]
    yield Finding(
        Severity.MISLEADS,
        "mesh-unit",
        tuple(dict.fromkeys(box.link for box in odd)),
        f"the mesh of {largest.link}, {largest.extent:.3g} m on a robot that reaches "
        f"{reach:.2g} m, looks like {unit}: write its scale",
        tuple(_scale_line(box, factor) for box in odd),
    )


def _scale_line(box: ShapeBox, factor: float) -> Line:
    scale = " ".join(f"{factor * x:g}" for x in box.scale)
    return Line(box.where, element("mesh", {"filename": box.mesh, "scale": scale}))


def no_shapes(subject: Subject) -> Iterator[Finding]:
    """A robot without collision shapes cannot be kept from obstacles, nor its links apart."""
    if subject.urdf is None or any(box.kind == "collision" for box in subject.boxes):
        return
    shown = [box for box in subject.boxes if len(box.corners)]
    lines = [Line(f"link[@name={quoted(x.link)}]", _collision(subject, x)) for x in shown]
    moved = next((names[0] for i, names in subject.bodies.items() if i), "")
    example = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
    yield Finding(
        Severity.HINT,
        "no-collision-shapes",
        (),
        "no link has <collision>: links are not kept apart, and obstacles are refused",
        tuple(lines) or (Line(f"link[@name={quoted(moved)}]", example),),
    )


def _collision(subject: Subject, box: ShapeBox) -> str:
    """The visual shape of a link as a collision shape."""
    collision = Element("collision")
    for part in subject.links[box.link].findall("visual")[box.number - 1]:
        if part.tag in ("origin", "geometry"):
            collision.append(part)
    return " ".join(tostring(collision, encoding="unicode").split())
