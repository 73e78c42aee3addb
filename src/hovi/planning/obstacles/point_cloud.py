"""Point clouds as spheres."""

from __future__ import annotations

from functools import cached_property

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.arguments import check_arguments_except
from hovi.errors import InputError
from hovi.planning.obstacles.obstacle import MIN_LENGTH, Body, Obstacle, pose_of
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

MAX_SPHERES = 1_000
"""Maximum number of spheres of a cloud."""
MAX_CLOUD_POINTS = 1_000_000
"""Maximum number of points of a cloud."""
CELL_GROWTH = 1.3
"""Ratio of two successive edges of cells that are tried until there are few enough spheres."""
_ORIGIN = (0.0, 0.0, 0.0)


@check_arguments_except("points", "radius", "cell", "position", "rpy", "path")
@dataclass(frozen=True)
class PointCloud(Obstacle):
    """A sphere about every point, or about all points of a cell.

    points: in the cloud's frame, shape (M, 3), in [m]. radius: around each point, in [m].
    cell: edge of the cubes of which each has one sphere around all of its points and their
        radius, in [m]; 0 for a sphere around each point.
    position: of the frame, shape (3,), in [m].
    rpy: roll, pitch and yaw about the world's axes, as in a URDF, shape (3,), in [rad].
    Raises InputError for other shapes, and for more than a thousand spheres.
    """

    points: npt.ArrayLike
    radius: float
    cell: float = 0.0
    position: npt.ArrayLike = _ORIGIN
    rpy: npt.ArrayLike = _ORIGIN

    def __post_init__(self) -> None:
        super().__post_init__()
        self._keep("points", (None, 3))
        self._keep_lengths("radius", ())
        self._keep("cell", ())
        self._keep("position", (3,))
        self._keep("rpy", (3,))
        count = len(np.asarray(self.points))
        if not 0 < count <= MAX_CLOUD_POINTS:
            raise InputError(
                f"`points` of a point cloud must be 1 to {MAX_CLOUD_POINTS:,} points, got {count}."
            )
        if self.cell != 0.0 and self.cell < MIN_LENGTH:
            raise InputError(
                f"`cell` of a point cloud must be 0 or a length of at least {MIN_LENGTH:g} m, got "
                f"{self.cell!r}."
            )
        if len(self.spheres) > MAX_SPHERES:
            raise InputError(
                f"a point cloud may have at most {MAX_SPHERES:,} spheres, got "
                f"{len(self.spheres):,}: put the points of larger cells into one, such as "
                f"cell={self._enough():.2g}."
            )

    @cached_property
    def spheres(self) -> Array:
        """Center in the cloud's frame and radius of every sphere, shape (S, 4), in [m]."""
        points = np.unique(np.asarray(self.points, dtype=np.float64), axis=0)
        if not self.cell:
            return np.column_stack([points, np.full(len(points), self.radius)])
        return _around_cells(points, float(self.cell), float(self.radius))

    def bodies(self) -> tuple[Body, ...]:
        """A ball for each sphere."""
        frame = pose_of(self.position, self.rpy)
        return tuple(
            Body(coal.Sphere(r), frame * pin.SE3(np.eye(3), np.array([x, y, z])))
            for x, y, z, r in self.spheres.tolist()
        )

    def _enough(self) -> float:
        """An edge of cells, in [m], with which the cloud has few enough spheres."""
        points = np.asarray(self.points, dtype=np.float64)
        edge = max(float(np.ptp(points, axis=0).max()) / MAX_SPHERES, MIN_LENGTH)
        while len(np.unique(np.floor(points / edge), axis=0)) > MAX_SPHERES:
            edge *= CELL_GROWTH
        return edge


def _around_cells(points: Array, edge: float, radius: float) -> Array:
    """Spheres (S, 4) around the middles of the points of each cell."""
    _, cell = np.unique(np.floor(points / edge), axis=0, return_inverse=True)
    order = np.argsort(cell.reshape(-1), kind="stable")
    ends = np.flatnonzero(np.diff(cell.reshape(-1)[order])) + 1
    spheres = []
    for some in np.split(points[order], ends):
        center = 0.5 * (some.min(axis=0) + some.max(axis=0))
        spheres.append([*center, radius + np.linalg.norm(some - center, axis=1).max()])
    return np.array(spheres)
