"""Obstacles of one convex shape: spheres, capsules, boxes, cylinders, half-spaces, hulls."""

from __future__ import annotations

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.arguments import check_arguments_except
from hovi.errors import InputError
from hovi.planning.obstacles.hull import hull_of
from hovi.planning.obstacles.obstacle import MIN_LENGTH, Body, Obstacle, pose_of, turned_to
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

HALF_SPACE_SIZE = 1e3
"""Extent of a half-space in every direction from its position, in [m]; of its picture below."""
DRAWN_SIZE = 1.0
"""Half the edge of the slab that is drawn for a half-space, in [m]."""
DRAWN_THICKNESS = 0.01
"""Thickness of the slab that is drawn for a half-space, in [m]."""
MAX_POINTS = 10_000
"""Maximum number of points of a convex hull."""
_ORIGIN = (0.0, 0.0, 0.0)


@check_arguments_except("position", "radius", "path")
@dataclass(frozen=True)
class Sphere(Obstacle):
    """A ball.

    position: of its center, shape (3,), in [m]. radius: in [m].
    Raises InputError for other shapes, and a radius that is not positive.
    """

    position: npt.ArrayLike
    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        self._keep("position", (3,))
        self._keep_lengths("radius", ())

    def bodies(self) -> tuple[Body, ...]:
        """A sphere about its center."""
        return (Body(coal.Sphere(self.radius), pose_of(self.position, _ORIGIN)),)


@check_arguments_except("ends", "radius", "path")
@dataclass(frozen=True)
class Capsule(Obstacle):
    """Everything within a radius of a line segment.

    ends: of the segment, shape (2, 3), in [m]. radius: in [m].
    Raises InputError for other shapes, ends that coincide, and a radius that is not positive.
    """

    ends: npt.ArrayLike
    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        self._keep("ends", (2, 3))
        self._keep_lengths("radius", ())
        if np.linalg.norm(np.subtract(*np.asarray(self.ends))) <= MIN_LENGTH:
            raise InputError("the ends of a capsule coincide; use a sphere instead.")

    def bodies(self) -> tuple[Body, ...]:
        """A capsule about the middle of the segment, z along it."""
        first, last = np.asarray(self.ends, dtype=np.float64)
        shape = coal.Capsule(self.radius, float(np.linalg.norm(last - first)))
        return (Body(shape, pin.SE3(turned_to(last - first), 0.5 * (first + last))),)


@check_arguments_except("size", "position", "rpy", "path")
@dataclass(frozen=True)
class Box(Obstacle):
    """A cuboid.

    size: lengths of its edges, shape (3,), in [m]. position: of its center, shape (3,), in [m].
    rpy: roll, pitch and yaw about the world's axes, as in a URDF, shape (3,), in [rad].
    Raises InputError for other shapes, and edges that are not positive.
    """

    size: npt.ArrayLike
    position: npt.ArrayLike
    rpy: npt.ArrayLike = _ORIGIN

    def __post_init__(self) -> None:
        super().__post_init__()
        self._keep_lengths("size", (3,))
        self._keep("position", (3,))
        self._keep("rpy", (3,))

    def bodies(self) -> tuple[Body, ...]:
        """The box about its center, turned by rpy."""
        shape = coal.Box(*np.asarray(self.size, dtype=np.float64))
        return (Body(shape, pose_of(self.position, self.rpy)),)


@check_arguments_except("radius", "length", "position", "rpy", "path")
@dataclass(frozen=True)
class Cylinder(Obstacle):
    """A circular cylinder along the z axis of its frame.

    radius, length: in [m]. position: of its center, shape (3,), in [m].
    rpy: roll, pitch and yaw about the world's axes, as in a URDF, shape (3,), in [rad].
    Raises InputError for other shapes, and a radius or length that is not positive.
    """

    radius: float
    length: float
    position: npt.ArrayLike
    rpy: npt.ArrayLike = _ORIGIN

    def __post_init__(self) -> None:
        super().__post_init__()
        self._keep_lengths("radius", ())
        self._keep_lengths("length", ())
        self._keep("position", (3,))
        self._keep("rpy", (3,))

    def bodies(self) -> tuple[Body, ...]:
        """The cylinder about its center, turned by rpy."""
        shape = coal.Cylinder(self.radius, self.length)
        return (Body(shape, pose_of(self.position, self.rpy)),)


@check_arguments_except("normal", "position", "path")
@dataclass(frozen=True)
class HalfSpace(Obstacle):
    """Everything behind a plane, such as a floor or a wall: {x : normal . (x - position) <= 0}.

    It is taken as a box of 2 km with its face in the plane, and drawn as a slab.

    normal: into the free space, of any length but zero, shape (3,).
    position: of a point of the plane, shape (3,), in [m].
    Raises InputError for other shapes, and a normal of zero.
    """

    normal: npt.ArrayLike
    position: npt.ArrayLike = _ORIGIN

    def __post_init__(self) -> None:
        super().__post_init__()
        self._keep("normal", (3,))
        self._keep("position", (3,))
        if not np.any(np.asarray(self.normal)):
            raise InputError(
                "`normal` of a half space must be a direction out of it, got zeros; the normal of "
                "a floor is [0, 0, 1]."
            )

    def bodies(self) -> tuple[Body, ...]:
        """A large box with its upper face in the plane."""
        return (self._slab(HALF_SPACE_SIZE, 2.0 * HALF_SPACE_SIZE),)

    def drawn(self) -> tuple[Body, ...]:
        """A thin slab under the plane."""
        return (self._slab(DRAWN_SIZE, DRAWN_THICKNESS),)

    def _slab(self, half: float, thickness: float) -> Body:
        """A box under the plane. half: of its other edges."""
        normal = np.asarray(self.normal) / np.max(np.abs(self.normal))
        normal = normal / np.linalg.norm(normal)
        center = np.asarray(self.position) - 0.5 * thickness * normal
        shape = coal.Box(2.0 * half, 2.0 * half, thickness)
        return Body(shape, pin.SE3(turned_to(normal), center))


@check_arguments_except("points", "position", "rpy", "path")
@dataclass(frozen=True)
class ConvexHull(Obstacle):
    """The convex hull of points.

    points: in its frame, shape (M, 3), in [m]. position: of its frame, shape (3,), in [m].
    rpy: roll, pitch and yaw about the world's axes, as in a URDF, shape (3,), in [rad].
    Raises InputError for other shapes, and points that span no volume.
    """

    points: npt.ArrayLike
    position: npt.ArrayLike = _ORIGIN
    rpy: npt.ArrayLike = _ORIGIN

    def __post_init__(self) -> None:
        super().__post_init__()
        self._keep("points", (None, 3))
        self._keep("position", (3,))
        self._keep("rpy", (3,))
        require_volume(self.points)

    def bodies(self) -> tuple[Body, ...]:
        """The hull, turned by rpy."""
        hull = hull_of(np.asarray(self.points, dtype=np.float64))
        return (Body(hull, pose_of(self.position, self.rpy)),)


def require_volume(points: npt.ArrayLike) -> None:
    """Raise InputError for points (M, 3) without a convex hull, and for too many of them."""
    array = np.asarray(points, dtype=np.float64)
    if len(array) > MAX_POINTS:
        raise InputError(
            f"a convex hull may have at most {MAX_POINTS:,} points, got {len(array):,}: keep its "
            "corners only."
        )
    if hull_of(array) is None:
        raise InputError(
            "the points of a convex hull must span a volume: give at least four that are not in "
            "one plane."
        )
