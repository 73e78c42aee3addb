"""Masses and inertias that look as if they were in grams or millimetres.

A link is as large as the distance from its joint to its center of mass or to the next joints. Steel
that fills a cube of twice that size weighs 7,850 kg/m^3, and the radius of gyration of what is
inside is about the size at most; in kg mm^2 it is a thousand times as much.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pinocchio as pin

from hovi.robot.findings.boxes import quoted
from hovi.robot.findings.finding import Finding, Line, Severity, element
from hovi.robot.findings.inertia import inertia_text, tensor_of
from hovi.robot.findings.subject import Subject

DENSE = 10_000.0
"""Mass over the cube of twice the size of a link, in [kg/m^3], from which it looks like grams."""
HEAVY = 100.0
"""Mass in [kg] below which a link is never said to be in grams: small links are dense."""
WIDE = 100.0
"""Radius of gyration over the size of a link from which an inertia looks like kg mm^2 or g mm^2."""
USUAL = 0.4
"""A usual radius of gyration over the size of a link."""


def grams(subject: Subject) -> Iterator[Finding]:
    """Masses in grams, with the joint that is furthest off."""
    masses = np.array([inertia.mass for inertia in subject.model.inertias])
    density = np.where(masses >= HEAVY, masses / (2.0 * subject.sizes) ** 3, 0.0)
    density[0] = 0.0
    body = int(np.argmax(density))
    if density[body] <= DENSE:
        return

    def line(link: str) -> Iterator[Line]:
        mass = float(subject.inertial(link, "mass", "value"))
        if mass >= HEAVY / 10:
            yield Line(f"{_link(link)}/inertial", _mass(mass / 1e3))

    yield Finding(
        Severity.MISLEADS,
        "mass-in-grams",
        _joints(subject, density > DENSE),
        f"the mass behind joint {subject.model.names[body]}, {masses[body]:g} kg on some "
        f"{subject.sizes[body]:.2g} m, looks like grams: {masses[body]:g} g are "
        f"{masses[body] / 1e3:g} kg",
        _lines(subject, density > DENSE, line),
    )


def square_millimetres(subject: Subject) -> Iterator[Finding]:
    """Inertias in kg mm^2 or g mm^2, with the joint that is furthest off."""
    model = subject.model
    wide = np.array([_gyration(inertia) for inertia in model.inertias]) / subject.sizes
    wide[0] = 0.0
    body = int(np.argmax(wide))
    if wide[body] <= WIDE:
        return
    factor = min((1e-6, 1e-9), key=lambda x: abs(np.log(wide[body] * np.sqrt(x) / USUAL)))

    def line(link: str) -> Iterator[Line]:
        tensor, mass = tensor_of(subject.links[link]), subject.inertial(link, "mass", "value")
        size = WIDE / 10 * subject.sizes[model.frames[model.getFrameId(link)].parentJoint]
        if tensor is not None and np.trace(tensor) > float(mass) * size**2:
            yield Line(f"{_link(link)}/inertial", inertia_text(factor * tensor))

    largest = np.linalg.eigvalsh(model.inertias[body].inertia)[-1]
    yield Finding(
        Severity.MISLEADS,
        "inertia-in-square-millimetres",
        _joints(subject, wide > WIDE),
        f"the inertia behind joint {model.names[body]}, {largest:.3g} kg m^2 for "
        f"{model.inertias[body].mass:g} kg on some {subject.sizes[body]:.2g} m, looks like kg mm^2 "
        "or g mm^2",
        _lines(subject, wide > WIDE, line),
    )


def _joints(subject: Subject, found: np.ndarray) -> tuple[str, ...]:
    return tuple(str(subject.model.names[int(i)]) for i in np.flatnonzero(found))


def _lines(
    subject: Subject, found: np.ndarray, line: Callable[[str], Iterator[Line]]
) -> tuple[Line, ...]:
    """The lines of the links of bodies."""
    links = [link for i in np.flatnonzero(found) for link in subject.bodies.get(int(i), ())]
    return tuple(each for link in links for each in line(link))


def _mass(value: float) -> str:
    return element("mass", {"value": f"{value:.6g}"})


def _link(name: str) -> str:
    return f"link[@name={quoted(name)}]"


def _gyration(inertia: pin.Inertia) -> float:
    """The largest radius of gyration about the center of mass, in [m]; 0 without mass."""
    if inertia.mass <= 0.0:
        return 0.0
    largest = max(float(np.linalg.eigvalsh(inertia.inertia)[-1]), 0.0)
    return float(np.sqrt(largest) / np.sqrt(inertia.mass))
