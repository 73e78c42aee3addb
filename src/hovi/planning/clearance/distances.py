"""Distances from a robot's links to obstacles and to each other, with their derivatives in q."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import InputError, ModelError, nearest
from hovi.planning.clearance.clearance import TOUCH_DEPTH, Clearance
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.planning.clearance.pair_distances import PairDistances
from hovi.planning.clearance.self_collisions import self_collision_pairs
from hovi.planning.obstacles.obstacle_path import ObstaclePath
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Parts = tuple[tuple[float, float], ...]

SAME_TIME = 1e-9
"""Difference of times up to which they are one where a part of a motion begins or ends, in [s]."""


@dataclass(frozen=True)
class Pair:
    """Two shapes whose distance is bounded.

    link: a link of the robot. other: name of an obstacle or of another link. obstacle: which of
    the two. touching: whether they may touch.
    """

    link: str
    other: str
    obstacle: bool
    touching: bool = False

    def __str__(self) -> str:
        """The pair as messages name it."""
        what = "obstacle" if self.obstacle else "link"
        end = ", which may touch," if self.touching else ""
        return f"link {self.link!r} and {what} {self.other!r}{end}"


class Distances:
    """Signed distances of all pairs that a clearance bounds, negative where shapes overlap.

    robot: with collision shapes; meshes are replaced by their convex hulls. Shapes that no joint
        moves are not paired with obstacles.
    geometry: the shapes, obstacles included.
    pairs: the K pairs, in the order of the columns of all results.
    ends: indices of their shapes in the geometry.
    paths: along which obstacles move.
    timed: whether there are any, or `parts`: then configurations have their time as one more
        column, see `at`.
    moving: numbers of these by those of the shapes that move along them.
    parts: of each pair that is bounded in parts of the motion alone, the times at which these begin
        and end, in [s], (K,) with None for a pair that always is. At other times its distance is
        the `reach`.
    allowance: by which a pair may be closer than the margin, shape (K,), in [m]; it is added to
        the distances, so that all pairs have the same bound.
    Raises ModelError where shapes are missing, or nothing can collide, and InputError for names
    in `may_touch` that neither a link nor an obstacle has.
    """

    def __init__(self, robot: Robot, clearance: Clearance) -> None:
        self.robot = robot
        convex = convex_geometry(robot)
        geometry = convex.copy()  # adding obstacles moves the geometry's own objects in memory
        shapes = list(convex.geometryObjects)
        links = [str(robot.model.frames[shape.parentFrame].name) for shape in shapes]
        pairs, ends = list[Pair](), list[tuple[int, int]]()
        self.paths, moving = tuple(_paths(clearance)), dict[int, int]()
        for obstacle in clearance.obstacles:
            path = obstacle.motion
            for k, body in enumerate(obstacle.bodies()):
                name = f"{obstacle.name} {k}"
                item = pin.GeometryObject(name, 0, 0, body.placement, body.shape)
                number = int(geometry.addGeometryObject(item))
                if path is not None:
                    moving[number] = self.paths.index(path)
                for i, shape in enumerate(shapes):
                    if shape.parentJoint != 0:
                        pairs.append(Pair(links[i], obstacle.name, True))
                        ends.append((i, number))
        if clearance.self_collision:
            left_out = {frozenset(each) for each in clearance.left_out}
            for i, j in self_collision_pairs(robot, clearance.may_touch):
                if frozenset((links[i], links[j])) in left_out:
                    continue
                pairs.append(Pair(links[i], links[j], False))
                ends.append((i, j))
        if not pairs:
            raise ModelError(
                f"robot {robot.name!r} has no pair of shapes that can collide: its collision "
                "shapes are fixed in the world, or its SRDF disables every pair."
            )
        for i, j in ends:
            geometry.addCollisionPair(pin.CollisionPair(i, j))
        self.geometry = geometry
        names = [*dict.fromkeys(links), *(each.name for each in clearance.obstacles)]
        self.pairs = tuple(marked_as_touching(pairs, clearance.may_touch, names))
        self.parts = tuple(_parts(pair, clearance) for pair in self.pairs)
        self.ends = tuple(ends)
        allowed = float(clearance.margin) + TOUCH_DEPTH
        gaps = {(link, other): gap for link, other, gap in clearance.gaps}
        self.allowance = np.array(
            [
                allowed if pair.touching else gaps.get((pair.link, pair.other), 0.0)
                for pair in self.pairs
            ]
        )
        self.moving: Mapping[int, int] = moving
        self._measured = PairDistances(robot, geometry, moving)
        self._chosen = np.arange(len(pairs))

    def restricted(self, pairs: Sequence[int]) -> Distances:
        """The distances of some of the pairs, by their numbers."""
        chosen = copy.copy(self)
        chosen.pairs = tuple(self.pairs[k] for k in pairs)
        chosen.ends = tuple(self.ends[k] for k in pairs)
        chosen.parts = tuple(self.parts[k] for k in pairs)
        chosen.allowance = self.allowance[list(pairs)]
        chosen._chosen = np.ascontiguousarray(self._chosen[list(pairs)])
        return chosen

    def at(self, q: Array, t: npt.ArrayLike) -> Array:
        """Configurations (P, nq) with their times, shape (P,) or one for all, in [s].

        What the other methods take where they are timed; the configurations alone otherwise.
        """
        if not self.timed:
            return q
        return np.column_stack([q, np.broadcast_to(np.asarray(t, dtype=float), len(q))])

    @property
    def timed(self) -> bool:
        """Whether distances depend on time, too."""
        return bool(self.paths) or any(part is not None for part in self.parts)

    def always(self) -> Distances:
        """The distances of all pairs at all times, also of those that are bounded in parts."""
        chosen = copy.copy(self)
        chosen.parts = (None,) * len(self.pairs)
        return chosen

    def still(self, time: float | None = None) -> Distances:
        """The distances of pairs that do not depend on time, for configurations without times.

        time: in [s], at which pairs that are bounded in parts are among them; None for none of
        these.
        """
        moving = self.moving.keys()
        ends = zip(self.ends, self.parts, strict=True)
        kept = [
            k
            for k, (pair, part) in enumerate(ends)
            if _holds(part, time) and not moving & set(pair)
        ]
        chosen = self.restricted(kept).always()
        chosen.paths = ()
        return chosen

    def _placed(self, q: Array) -> Array:
        """Configurations (P, nq) with the poses of all paths at their times, (P, nq + 7 m)."""
        nq = self.robot.nq
        if self.timed and q.shape[1] != nq + 1:
            raise InputError("distances that depend on time need times: see Distances.at.")
        if not self._measured.paths:
            return q[:, :nq]
        if not self.paths:
            poses = np.tile(np.array([0.0] * 6 + [1.0]), (len(q), self._measured.paths))
            return np.concatenate([q[:, :nq], poses], axis=1)
        return np.concatenate([q[:, :nq], *(path.poses(q[:, nq]) for path in self.paths)], axis=1)

    def _bounded(self, q: Array, wanted: Mask | None) -> Mask | None:
        """Which distances are wanted and bounded at configurations with times, (P, K)."""
        kept: Mask | None = None
        for k, part in enumerate(self.parts):
            if part is None:
                continue
            if kept is None:
                shape = len(q), len(self.pairs)
                kept = np.ones(shape, dtype=bool) if wanted is None else wanted.copy()
            t = q[:, self.robot.nq, None]
            begin, end = np.array(part).reshape(-1, 2).T
            kept[:, k] &= ((t >= begin - SAME_TIME) & (t <= end + SAME_TIME)).any(axis=1)
        return wanted if kept is None else kept

    def values(
        self,
        q: Array,
        reach: float = np.inf,
        wanted: Mask | None = None,
        rounding: Array | None = None,
        normals: Array | None = None,
    ) -> Array:
        """Signed distances with allowances at configurations (P, nq), shape (P, K), in [m].

        Configurations along a motion take less time than others. Where faces or edges are parallel,
        distances have kinks, since the nearest points jump. Those of shapes that are rounded, and
        so slightly larger, have none; they are smaller by at most the rounding times the logarithm
        of the number of vertices that are as near. What Coal measures is not rounded.
        reach: distance beyond which a lower bound of at least that is returned, in [m].
        wanted: which distances are, shape (P, K), all if None; of others the reach is returned.
        rounding: size by which shapes are rounded at most, shape (P, K), in [m]; none if None.
        normals: unit normals from the first to the second rounded shape, (P, K, 3), C-contiguous,
            updated in place: initial guesses, as of a nearby configuration or 0 for a cold start,
            are replaced by the normals found. None for cold starts.
        """
        placed, wanted = self._placed(q), self._bounded(q, wanted)
        distances = self._measured.values(placed, self._chosen, reach, wanted, rounding, normals)
        return distances + self.allowance if self.allowance.any() else distances

    def expand(self, q: Array, reach: float = np.inf) -> tuple[Array, Array]:
        """Signed distances (P, K), in [m], and their derivatives in the tangent space, (P, K, nv).

        reach: as for `values`; pairs beyond have derivatives of zero, in [m].
        """
        distances, jacobian, _ = self.expansion(q, None, reach)
        return distances, jacobian

    def curvature(self, q: Array, force: Array) -> Array:
        """sum_k force_k d''_k at configurations (P, nq), shape (P, nv, nv).

        force: shape (P, K).
        """
        return self.expansion(q, force)[2]

    def expansion(
        self,
        q: Array,
        force: Array | None,
        reach: float = np.inf,
        wanted: Mask | None = None,
        rounding: Array | None = None,
        normals: Array | None = None,
    ) -> tuple[Array, Array, Array]:
        """Distances, their derivatives, and the sum of force d'': see `expand`, `curvature`.

        wanted, rounding, normals: as for `values`.

        Second derivatives are exact for one pair of nearest points, which moves along the vertices,
        edges, faces and round surfaces that it lies on; cylinders that overlap have none.
        """
        placed, wanted = self._placed(q), self._bounded(q, wanted)
        given = self._chosen, reach, force, wanted, rounding, normals
        found = self._measured.expand(placed, *given)
        distances, jacobian, curvature = found
        if self.allowance.any():
            distances = distances + self.allowance
        return distances, jacobian, curvature


def _holds(part: Parts | None, time: float | None) -> bool:
    """Whether a pair is bounded at a time, in [s]; None for at all times."""
    if part is None or time is None:
        return part is None
    return any(begin - SAME_TIME <= time <= end + SAME_TIME for begin, end in part)


def _parts(pair: Pair, clearance: Clearance) -> Parts | None:
    """The parts of the motion in which a pair is bounded; None for one that always is."""
    names = {name for name, _, _ in clearance.during}
    found = [
        [(begin, end) for name, begin, end in clearance.during if name == link]
        for link in ((pair.link,) if pair.obstacle else (pair.link, pair.other))
        if link in names
    ]
    if len(found) < 2:
        return tuple(found[0]) if found else None
    both = [(max(a, c), min(b, d)) for a, b in found[0] for c, d in found[1]]
    return tuple((begin, end) for begin, end in both if begin < end)


def _paths(clearance: Clearance) -> list[ObstaclePath]:
    """The different paths of obstacles."""
    found = (each.motion for each in clearance.obstacles)
    return list(dict.fromkeys(path for path in found if path is not None))


def marked_as_touching(
    pairs: Sequence[Pair], may_touch: Sequence[tuple[str, str]], names: Sequence[str]
) -> list[Pair]:
    """The pairs, with those that may touch flagged.

    names: of all links and obstacles. Raises InputError for another name.
    """
    allowed = {frozenset(each) for each in may_touch}
    for name in [name for each in may_touch for name in each]:
        if name not in names:
            raise InputError(f"nothing that may touch is named {name!r}: {nearest(name, names)}")
    return [
        dataclasses.replace(pair, touching=frozenset((pair.link, pair.other)) in allowed)
        for pair in pairs
    ]


@lru_cache(maxsize=16)
def distances_between(robot: Robot, clearance: Clearance) -> Distances:
    """The distances that a clearance bounds for a robot, cached."""
    return Distances(robot, clearance)
