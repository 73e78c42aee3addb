"""Inertias of the bodies of an MJCF, from <inertial> or from geoms of uniform density."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pinocchio as pin

from hovi.robot.formats.mjcf_assets import Meshes
from hovi.robot.formats.mjcf_defaults import Compiler
from hovi.robot.formats.mjcf_poses import ORIENTATIONS, from_z, pose_of, unit
from hovi.robot.formats.mjcf_text import Array, MjcfError, number, numbers
from hovi.robot.meshes.triangles import Triangles
from hovi.system.dataclass import dataclass

DENSITY = 1000.0
"""Of a geom that names none, in [kg/m^3]."""
SIZES = {"sphere": 1, "capsule": 2, "ellipsoid": 3, "cylinder": 2, "box": 3}
"""Number of sizes of each kind of geom with a volume; with fromto= a radius is enough."""
WITHOUT_MASS = "plane", "hfield"
TOLERANCE = 1e-7
"""Largest negative principal inertia, in [kg m^2], accepted as a rounding error of CAD exports."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A geom's kind, sizes in [m] (radius; then half lengths), and pose in its body."""

    kind: str
    size: Array
    pose: pin.SE3


def solid_of(given: dict[str, str], where: str, compiler: Compiler) -> Solid:
    """A geom with a shape of its own. Raises MjcfError."""
    kind = given.get("type", "sphere")
    ends, count = numbers(given, "fromto", where, 6), SIZES.get(kind, 0)
    if ends is None or kind not in SIZES or kind == "sphere":
        size = np.ones(3) if not count else _size(given, where, count)
        return Solid(kind, size, pose_of(given, where, compiler.angles))
    radius = _size(given, where, 1)[:1]
    half = 0.5 * float(np.linalg.norm(ends[3:] - ends[:3]))
    rotation = from_z(unit(ends[:3] - ends[3:], f"the length by fromto of {where}"))
    size = np.append(radius, half if count == 2 else [radius[0], half])
    return Solid(kind, size, pin.SE3(rotation, 0.5 * (ends[:3] + ends[3:])))


def _size(given: dict[str, str], where: str, count: int) -> Array:
    size = numbers(given, "size", where, count, 3)
    if size is None or not (size[:count] > 0.0).all():
        raise MjcfError(f"{where} needs {count} positive number{'s' * (count > 1)} as size=.")
    return size[:count]


def inertia_of_geom(
    given: dict[str, str], where: str, compiler: Compiler, meshes: Meshes
) -> pin.Inertia:
    """Of a geom in the frame of its body. Raises MjcfError."""
    if given.get("shellinertia", "false") != "false":
        raise MjcfError(f"{where} has shellinertia=, which hovi does not read: add an <inertial>.")
    solid = solid_of(given, where, compiler)
    if solid.kind in WITHOUT_MASS:
        return pin.Inertia.Zero()
    if solid.kind in SIZES and "mesh" not in given:
        volume, center, tensor = _SOLIDS[solid.kind](solid.size)
    elif solid.kind == "mesh":
        volume, center, tensor = _of_mesh(meshes.read(given.get("mesh", "")), where)
    else:
        raise MjcfError(f"{where} has type {solid.kind[:40]!r} and a mass: add an <inertial>.")
    mass = number(given, "mass", where, -1.0)
    density = number(given, "density", where, DENSITY)
    mass = mass if "mass" in given else density * volume
    if mass < 0.0:
        raise MjcfError(f"{where} has a negative mass or density: give 0 or more.")
    inertia = pin.Inertia(mass, center, mass / volume * tensor if volume else tensor)
    return solid.pose.act(inertia)


def inertial_of(given: dict[str, str], where: str, compiler: Compiler) -> pin.Inertia:
    """Of an element <inertial>, in the frame of its body. Raises MjcfError."""
    if "mass" not in given or not {"diaginertia", "fullinertia"} & given.keys():
        raise MjcfError(f"{where} needs mass=, and diaginertia= or fullinertia=.")
    mass = number(given, "mass", where, 0.0)
    full, diagonal = (
        numbers(given, "fullinertia", where, 6),
        numbers(given, "diaginertia", where, 3),
    )
    turned = [key for key in ORIENTATIONS if key in given]
    if full is not None and (diagonal is not None or turned):
        raise MjcfError(
            f"{where} has fullinertia= and {(turned or ['diaginertia'])[0]}=: keep one."
        )
    if full is None:
        tensor = np.diag(np.zeros(3) if diagonal is None else diagonal)
    else:
        tensor = full[[[0, 3, 4], [3, 1, 5], [4, 5, 2]]]
    least = float(np.linalg.eigvalsh(tensor)[0])
    if mass < 0.0 or least < -TOLERANCE:
        what = f"mass {mass:g} kg" if mass < 0.0 else f"a principal inertia of {least:.3g} kg m^2"
        raise MjcfError(f"{where} has {what}: give 0 or more.")
    pose = pose_of(given, where, compiler.angles)
    return pin.Inertia(mass, pose.translation, pose.rotation @ tensor @ pose.rotation.T)


def bounded(inertia: pin.Inertia, compiler: Compiler, where: str) -> pin.Inertia:
    """An inertia with the least values and the balance that <compiler> asks for."""
    if compiler.mass <= 0.0 and compiler.inertia <= 0.0 and not compiler.balance:
        return inertia
    values, axes = np.linalg.eigh(inertia.inertia)
    values = np.maximum(values, compiler.inertia) if compiler.inertia > 0.0 else values
    if compiler.balance and values[0] + values[1] < values[2]:
        values = np.full(3, values.mean())
    mass = max(inertia.mass, compiler.mass) if compiler.mass > 0.0 else inertia.mass
    return pin.Inertia(mass, inertia.lever, axes @ np.diag(values) @ axes.T)


# Volume, center and inertia of a solid of density 1 about its center

Properties = tuple[float, Array, Array]


def _sphere(size: Array) -> Properties:
    volume = 4.0 / 3.0 * math.pi * size[0] ** 3
    return volume, np.zeros(3), volume * 0.4 * size[0] ** 2 * np.eye(3)


def _ellipsoid(size: Array) -> Properties:
    volume, (x, y, z) = 4.0 / 3.0 * math.pi * size.prod(), size**2
    return volume, np.zeros(3), volume / 5.0 * np.diag([y + z, x + z, x + y])


def _box(size: Array) -> Properties:
    volume, (x, y, z) = 8.0 * size.prod(), size**2
    return volume, np.zeros(3), volume / 3.0 * np.diag([y + z, x + z, x + y])


def _cylinder(size: Array) -> Properties:
    r, half = size
    volume = 2.0 * math.pi * r**2 * half
    across = volume * (r**2 / 4.0 + half**2 / 3.0)
    return volume, np.zeros(3), np.diag([across, across, volume * r**2 / 2.0])


def _capsule(size: Array) -> Properties:
    """A cylinder between two half balls, whose centers of mass are 3/8 r beyond its ends."""
    (r, half), (barrel, _, tensor) = size, _cylinder(size)
    ball = 4.0 / 3.0 * math.pi * r**3
    across = ball * (0.4 * r**2 + half**2 + 0.75 * r * half)
    caps = np.diag([across, across, ball * 0.4 * r**2])
    return barrel + ball, np.zeros(3), tensor + caps


_SOLIDS: dict[str, Callable[[Array], Properties]] = {
    **{"sphere": _sphere, "ellipsoid": _ellipsoid, "box": _box},
    **{"cylinder": _cylinder, "capsule": _capsule},
}


def _of_mesh(mesh: Triangles, where: str) -> Properties:
    """Of a closed surface, by the tetrahedra between its triangles and one point.

    MuJoCo adds up the volumes of the tetrahedra without their signs by default, which is the same
    where all have one sign; others are refused.
    """
    middle = mesh.vertices.mean(axis=0)
    a, b, c = ((mesh.vertices - middle)[mesh.triangles[:, i]] for i in range(3))
    volumes = np.vecdot(a, np.cross(b, c)) / 6.0
    total = float(volumes.sum())
    if not abs(total) >= (1.0 - 1e-3) * float(np.abs(volumes).sum()) > 0.0:
        raise MjcfError(
            f"{where} is a mesh with a mass that is not nearly convex and closed: add an "
            "<inertial> to its body."
        )
    center = np.einsum("k,ki->i", volumes, a + b + c) / (4.0 * total)
    corners = np.stack([a, b, c, np.zeros_like(a)], axis=1) - center  # (K, 4, 3)
    sums = corners.sum(axis=1)
    second = np.einsum("k,kni,knj->ij", volumes, corners, corners)
    second = (second + np.einsum("k,ki,kj->ij", volumes, sums, sums)) / 20.0
    second *= np.sign(total)
    return abs(total), middle + center, np.trace(second) * np.eye(3) - second
