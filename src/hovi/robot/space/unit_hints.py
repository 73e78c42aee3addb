"""Ranges, masses and inertias that look as if they were in millimetres or grams.

A link is as large as the distance from its joint to its center of mass or to the next joints. Steel
that fills a cube of twice that size weighs 7,850 kg/m^3, and the radius of gyration of what is
inside is about the size at most; in kg mm^2 it is a thousand times as much.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from hovi.robot.space.joint_kinds import LENGTH, kind_of

LONG = 50.0
"""A range of a sliding joint, in [m], from which it looks like millimetres."""
DENSE = 10_000.0
"""Mass over the cube of twice the size of a link, in [kg/m^3], from which it looks like grams."""
HEAVY = 100.0
"""Mass in [kg] below which a link is never said to be in grams: small links are dense."""
WIDE = 100.0
"""Radius of gyration over the size of a link from which an inertia looks like kg mm^2 or g mm^2."""
LEAST_SIZE = 0.05
"""Size of a link at least, in [m], whatever its joints say."""


def unit_hints(model: pin.Model) -> Iterator[str]:
    """Hints at units, as clauses: one about each kind, with the joint that is furthest off."""
    sliding = [
        (
            float(model.upperPositionLimit[joint.idx_q])
            - float(model.lowerPositionLimit[joint.idx_q]),
            name,
        )
        for joint, name in zip(model.joints[1:], model.names[1:], strict=True)
        if kind_of(joint).units == (LENGTH,)
    ]
    if found := max(((x, name) for x, name in sliding if LONG <= x < 1e6), default=None):
        yield (
            f"the position range of {found[1]}, {found[0]:g} m, looks like millimetres: "
            f"{found[0]:g} mm are {found[0] / 1e3:g} m"
        )
    sizes = _sizes(model)
    masses = np.array([inertia.mass for inertia in model.inertias])
    density = np.where(masses >= HEAVY, masses / (2.0 * sizes) ** 3, 0.0)
    density[0] = 0.0
    body = int(np.argmax(density))
    if density[body] > DENSE:
        yield (
            f"the mass behind joint {model.names[body]}, {masses[body]:g} kg on some "
            f"{sizes[body]:.2g} m, looks like grams: {masses[body]:g} g are "
            f"{masses[body] / 1e3:g} kg"
        )
    wide = np.array([_gyration(inertia) for inertia in model.inertias]) / sizes
    wide[0] = 0.0
    body = int(np.argmax(wide))
    if wide[body] > WIDE:
        largest = np.linalg.eigvalsh(model.inertias[body].inertia)[-1]
        yield (
            f"the inertia behind joint {model.names[body]}, {largest:.3g} kg m^2 for "
            f"{masses[body]:g} kg on some {sizes[body]:.2g} m, looks like kg mm^2 or g mm^2"
        )


def _sizes(model: pin.Model) -> np.ndarray:
    """How large the bodies of joints are, in [m]."""
    sizes = np.array([max(LEAST_SIZE, np.linalg.norm(each.lever)) for each in model.inertias])
    for joint, (parent, placement) in enumerate(
        zip(model.parents, model.jointPlacements, strict=True)
    ):
        if joint:
            sizes[parent] = max(sizes[parent], np.linalg.norm(placement.translation))
    return sizes


def _gyration(inertia: pin.Inertia) -> float:
    """The largest radius of gyration about the center of mass, in [m]; 0 without mass."""
    if inertia.mass <= 0.0:
        return 0.0
    return float(np.sqrt(max(np.linalg.eigvalsh(inertia.inertia)[-1], 0.0) / inertia.mass))
