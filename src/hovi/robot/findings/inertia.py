"""Inertias: none, those of no body, and those of links that are far lighter than the arm."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt

from hovi.errors import some_of
from hovi.robot.findings.boxes import ShapeBox, quoted
from hovi.robot.findings.finding import PYTHON, Finding, Line, Severity, element
from hovi.robot.findings.subject import Subject

Array = npt.NDArray[np.float64]

DENSITY = 1_000.0
"""Density of the boxes of which an example of an inertia is made, in [kg/m^3]."""
LEAST_SIDE = 0.05
"""Least side of the cube that stands for a link without shapes, in [m]."""
MATTERS = 0.01
"""By this fraction of its body's largest inertia an inertia violates the triangle inequality where
it is a finding."""
MANY = 4
"""Number of light joints beyond which all joints get the same rotor."""
_AT = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


def no_inertia(subject: Subject) -> Iterator[Finding]:
    """Joints without inertia, at which there are no torques."""
    if not subject.massless:
        return
    joints = tuple(str(subject.model.names[i]) for i in subject.massless)
    lines = tuple(
        _inertial(subject, link, joint)
        for joint in subject.massless
        for link in subject.bodies.get(joint, ())[:1]
    )
    yield Finding(
        Severity.STOPS,
        "no-inertia",
        joints,
        f"no inertia at {some_of(joints)}: there are no torques; give the links that they move a "
        "mass and an inertia, as here those of boxes around their shapes at 1,000 kg/m^3, or plan "
        'with objective = "acceleration"',
        lines or (Line(PYTHON, 'objective="acceleration"'),),
    )


def bare_links(subject: Subject) -> Iterator[Finding]:
    """Links that move without <inertial>, whatever they are fixed to."""
    if found := _bare(subject):
        yield _without_inertial(Severity.NOTE, found, ())


def massless_links(subject: Subject) -> Iterator[Finding]:
    """Bare links of bodies without mass, whose joints have the inertia of links further out."""
    bare = set(_bare(subject))
    found = {
        link: joint
        for joint, links in subject.bodies.items()
        for link in links
        if joint not in subject.massless and not subject.model.inertias[joint].mass > 0.0
        if link in bare
    }
    if found:
        lines = tuple(_inertial(subject, link, joint) for link, joint in found.items())
        yield _without_inertial(Severity.HINT, list(found), lines)


def _bare(subject: Subject) -> list[str]:
    return [x.get("name", "") for x in subject.moving_links() if x.find("inertial") is None]


def _without_inertial(severity: Severity, links: list[str], lines: tuple[Line, ...]) -> Finding:
    sentence = f"{some_of(links)}: moving without <inertial>, so without mass and inertia"
    return Finding(severity, "no-inertial", tuple(links), sentence, lines)


def points(subject: Subject) -> Iterator[Finding]:
    """Links with a mass and no inertia, with nothing fixed to them that has one."""
    found = dict[str, int]()
    for joint, links in subject.bodies.items():
        body = subject.model.inertias[joint]
        if joint and joint not in subject.massless and body.mass > 0.0 and not body.inertia.any():
            found.update((x, joint) for x in links if tensor_of(subject.links[x]) is not None)
    if found:
        yield Finding(
            Severity.HINT,
            "point-mass",
            tuple(found),
            f"the inertia of {some_of(found)} is 0, as if the mass were in a point",
            tuple(_inertial(subject, link, joint) for link, joint in found.items()),
        )


def impossible(subject: Subject) -> Iterator[Finding]:
    """Inertias that no body has: a principal one exceeds the sum of the others."""
    if found := _impossible(subject):
        yield _violating(Severity.NOTE, list(found), ())


def harmful(subject: Subject) -> Iterator[Finding]:
    """Inertias of no body that the rest of the link's body does not outweigh."""
    odd = _impossible(subject)
    found = [name for name, much in odd.items() if much > MATTERS * _largest_around(subject, name)]
    if found:
        lines = tuple(_possible(name, tensor_of(subject.links[name])) for name in found)
        yield _violating(Severity.MISLEADS, found, lines)


def _impossible(subject: Subject) -> dict[str, float]:
    """By how much links violate the triangle inequality, in [kg m^2]."""
    tensors = {name: tensor_of(link) for name, link in subject.links.items()}
    excess = {name: _excess(tensor) for name, tensor in tensors.items() if tensor is not None}
    return {name: much for name, much in excess.items() if much > 0.0}


def _violating(severity: Severity, links: list[str], lines: tuple[Line, ...]) -> Finding:
    sentence = f"the principal inertias of {some_of(links)} violate the triangle inequality"
    return Finding(severity, "impossible-inertia", tuple(links), sentence, lines)


def _largest_around(subject: Subject, link: str) -> float:
    """The largest inertia of the body that a link belongs to, in [kg m^2]; infinite if fixed."""
    joint = next((i for i, links in subject.bodies.items() if link in links), 0)
    if not joint:
        return float("inf")
    return float(np.linalg.eigvalsh(subject.model.inertias[joint].inertia)[-1])


def light_joints(subject: Subject) -> Iterator[Finding]:
    """Joints with so little inertia that costs range over many decades."""
    none = {str(subject.model.names[i]) for i in subject.massless}
    light = {name: each for name, each in subject.light.items() if name not in none}
    if light:
        shown = some_of([f"{name} ({each.inertia:.2g} kg m^2)" for name, each in light.items()])
        rotors = ", ".join(f"{name!r}: {_above(each.armature):g}" for name, each in light.items())
        rotors = f"{{{rotors}}}"
        if len(light) > MANY:
            rotors = f"{_above(max(each.armature for each in light.values())):g}"
        yield Finding(
            Severity.HINT,
            "light-joint",
            tuple(light),
            f"little inertia about {shown}: without limits or the effects armature and "
            "acceleration_cost a least-torque motion may spin there",
            (Line(PYTHON, f"hovi.effects.Armature({rotors})"),),
        )


def tensor_of(link: Element) -> Array | None:
    """The inertia tensor of a link of the URDF, (3, 3), in [kg m^2]."""
    inertia = link.find("inertial/inertia")
    if inertia is None:
        return None
    tensor = np.zeros((3, 3))
    for key, (i, j) in _AT.items():
        tensor[i, j] = tensor[j, i] = float(inertia.get(key, "0"))
    return tensor


def inertia_text(tensor: Array) -> str:
    """An inertia tensor as <inertia>."""
    return element("inertia", {key: f"{tensor[at]:.6g}" for key, at in _AT.items()})


def _excess(tensor: Array) -> float:
    """By how much a principal inertia exceeds the sum of the others, 0 within 1 %, in [kg m^2]."""
    low, middle, high = np.linalg.eigvalsh(tensor)
    return float(high - low - middle) if high > 1.01 * (low + middle) + 1e-9 else 0.0


def _possible(link: str, tensor: Array | None) -> Line:
    """The inertia of the nearest distribution of mass P >= 0, with I = tr(P) 1 - P."""
    given = np.zeros((3, 3)) if tensor is None else tensor
    values, axes = np.linalg.eigh(np.trace(given) / 2 * np.eye(3) - given)
    spread = (axes * np.maximum(values, 0.0)) @ axes.T
    possible = np.asarray(np.trace(spread) * np.eye(3) - spread)
    return Line(f"link[@name={quoted(link)}]/inertial", inertia_text(possible))


def _inertial(subject: Subject, link: str, joint: int) -> Line:
    """An example of a link's <inertial>: boxes around its shapes, of its mass or else of DENSITY.

    joint: that moves it, whose body has the size of a link without shapes.
    """
    boxes = [x for x in subject.boxes if x.link == link and len(x.corners)]
    kind = "collision" if any(x.kind == "collision" for x in boxes) else "visual"
    side = max(subject.sizes[joint] / 2, LEAST_SIDE)
    mass, center, tensor = _solid([x for x in boxes if x.kind == kind], float(side))
    stated = float(subject.inertial(link, "mass", "value"))
    if stated > 0.0:
        mass, tensor = stated, tensor * (stated / mass)
    at = " ".join(f"{x:.4g}" for x in center)
    parts = element("origin", {"xyz": at}), element("mass", {"value": f"{mass:.4g}"})
    text = element("inertial", {}, *parts, inertia_text(tensor))
    return Line(f"link[@name={quoted(link)}]", text)


def _solid(boxes: Iterable[ShapeBox], side: float) -> tuple[float, Array, Array]:
    """Mass, center (3,) and inertia (3, 3) about it of boxes along the axes of a link.

    side: of a cube instead of boxes without volume, in [m].
    """
    sides = [(x.corners.min(axis=0), x.corners.max(axis=0)) for x in boxes]
    half = side / 2 * np.ones(3)
    sides = [(low, high) for low, high in sides if np.prod(high - low) > 1e-9] or [(-half, half)]
    masses = np.array([DENSITY * np.prod(high - low) for low, high in sides])
    middles = np.array([(low + high) / 2 for low, high in sides])
    center, tensor = masses @ middles / masses.sum(), np.zeros((3, 3))
    for mass, middle, (low, high) in zip(masses, middles, sides, strict=True):
        spread = np.outer(middle - center, middle - center) + np.diag((high - low) ** 2 / 12)
        tensor += mass * (np.trace(spread) * np.eye(3) - spread)
    return float(masses.sum()), np.asarray(center), tensor


def _above(value: float) -> float:
    """The next larger number of two digits."""
    step = 10.0 ** (np.floor(np.log10(value)) - 1) if value > 0 else 1.0
    return float(np.ceil(value / step) * step)
