"""Obstacles of one or more convex hulls: those of a mesh file, and those of a recorded motion."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.arguments import check_arguments_except
from hovi.errors import InputError, warn
from hovi.planning.obstacles.convex_parts import MAX_PARTS, convex_parts, uncovered
from hovi.planning.obstacles.hull import hull_of
from hovi.planning.obstacles.obstacle import Body, Obstacle, pose_of
from hovi.planning.obstacles.primitives import ConvexHull
from hovi.planning.obstacles.triangle_mesh import TriangleMesh, read_mesh
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

FILLED = 1.01
"""Ratio of the volumes of a hull and its mesh from which a message says what the hull fills."""
_ORIGIN = (0.0, 0.0, 0.0)


@check_arguments_except("parts", "radius", "position", "rpy", "path")
@dataclass(frozen=True)
class ConvexParts(Obstacle):
    """Several convex hulls, such as the parts of a mesh.

    parts: the points of each hull in a common frame, each of shape (M, 3), in [m].
    radius: by which every hull is larger on all sides, 0 or more, in [m].
    position: of the frame, shape (3,), in [m].
    rpy: roll, pitch and yaw about the world's axes, as in a URDF, shape (3,), in [rad].
    Raises InputError for other shapes, and points that span no volume.
    """

    parts: Sequence[npt.ArrayLike]
    radius: float = 0.0
    position: npt.ArrayLike = _ORIGIN
    rpy: npt.ArrayLike = _ORIGIN

    def __post_init__(self) -> None:
        super().__post_init__()
        self._keep("radius", ())
        self._keep("position", (3,))
        self._keep("rpy", (3,))
        if self.radius < 0:
            raise InputError(
                f"`radius` of convex parts must be a length of 0 or more, got {self.radius!r}."
            )
        given = self.parts
        listed = isinstance(given, Sequence) or (isinstance(given, np.ndarray) and given.ndim > 0)
        if not listed or not 0 < len(given) <= MAX_PARTS:
            raise InputError(f"`parts` of convex parts must be 1 to {MAX_PARTS} lists of points.")
        object.__setattr__(self, "parts", tuple(ConvexHull(each).points for each in given))

    def bodies(self) -> tuple[Body, ...]:
        """A hull for each part."""
        parts = [np.asarray(part, dtype=np.float64) for part in self.parts]
        return _hulls(parts, self.radius, pose_of(self.position, self.rpy))


@check_arguments_except("position", "rpy", "scale", "path")
@dataclass(frozen=True)
class Mesh(Obstacle):
    """A mesh file: its convex hull, or convex parts that together cover it.

    A hull that fills more than the mesh, such as that of a shelf, is named in a warning. Parts are
    found by CoACD (`pip install 'hovi[convex]'`), once for each mesh; where they leave a triangle
    outside, all of them are larger by that distance.

    file: path of an .stl, .obj, .dae, .ply or .off file, in [m].
    position: of the mesh's frame, shape (3,), in [m].
    rpy: roll, pitch and yaw about the world's axes, as in a URDF, shape (3,), in [rad].
    scale: factors of its coordinates, one or three; 0.001 for a mesh in millimetres.
    convex_parts: whether to divide the mesh.
    Raises InputError for other shapes, a file that cannot be read, and a mesh without volume.
    """

    file: str | Path
    position: npt.ArrayLike = _ORIGIN
    rpy: npt.ArrayLike = _ORIGIN
    scale: npt.ArrayLike = 1.0
    convex_parts: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "file", str(Path(self.file).absolute()))
        self._keep("position", (3,))
        self._keep("rpy", (3,))
        self._keep_lengths("scale", (3,) if isinstance(self.scale, Sequence | np.ndarray) else ())
        _ = self.recorded()

    def recorded(self) -> ConvexParts:
        """The hulls themselves, so that no file is needed to replay a motion."""
        mesh, scale = read_mesh(str(self.file)), np.asarray(self.scale)
        given, outside = parts_of(mesh, self.convex_parts)
        parts, radius = [(part * scale).tolist() for part in given], outside * float(scale.max())
        return ConvexParts(parts, radius, self.position, self.rpy, name=self.name, path=self.path)

    def bodies(self) -> tuple[Body, ...]:
        """The hull, or those of the parts."""
        return self.recorded().bodies()


def parts_of(mesh: TriangleMesh, divided: bool) -> tuple[tuple[Array, ...], float]:
    """The points of the convex parts of a mesh, or of its hull, and how far it lies outside them.

    Raises InputError for a mesh without volume.
    """
    return _divided(mesh) if divided else ((_hull_points(mesh),), 0.0)


def _hulls(parts: Sequence[Array], radius: float, placement: pin.SE3) -> tuple[Body, ...]:
    hulls = [hull for part in parts if (hull := hull_of(part)) is not None]
    for hull in hulls:
        hull.setSweptSphereRadius(radius)
    return tuple(Body(hull, placement) for hull in hulls)


@lru_cache(maxsize=64)
def _divided(mesh: TriangleMesh) -> tuple[tuple[Array, ...], float]:
    """The convex parts of a mesh that span a volume, and how far it lies outside them, in [m]."""
    parts = tuple(part for part in convex_parts(mesh) if hull_of(part) is not None)
    parts = parts or (_hull_points(mesh),)
    return parts, uncovered(mesh, parts)


@lru_cache(maxsize=64)
def _hull_points(mesh: TriangleMesh) -> Array:
    """The corners of the convex hull of a mesh, with a warning if it fills more than the mesh."""
    hull = hull_of(mesh.vertices)
    if hull is None:
        raise InputError(
            f"mesh {mesh.name!r} has no convex hull: its points must span a volume; take a box "
            "instead."
        )
    filled, volume = float(hull.computeVolume()), mesh.volume()
    if volume is None or filled > FILLED * volume:
        much = "" if volume is None else f", {filled / max(volume, 1e-300):.3g} times its volume"
        warn(
            f"mesh {mesh.name!r} is taken as its convex hull{much}: to keep what is hollow free, "
            "divide it with convex_parts=True."
        )
    return np.array(hull.points(), dtype=np.float64).reshape(-1, 3)
