"""Distances of the pairs of a geometry: compiled, or by Coal where the compiled part has none."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.planning.clearance.coal_distances import CoalDistances
from hovi.planning.clearance.compiled_distances import UNKNOWN, CompiledDistances
from hovi.robot.robot import Robot
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

BATCH = 20_000
"""Number of distances in one compiled call, a few ms; the deadline is looked at between calls."""


class PairDistances:
    """Signed distances of the collision pairs of a geometry, and their derivatives.

    Coal computes those of cylinders that overlap, of cones and ellipsoids, and all of a robot whose
    joints the compiled part lacks.

    moving: numbers of paths by those of the shapes that move along them; a configuration ends with
        the position and quaternion of each path.
    """

    def __init__(
        self, robot: Robot, geometry: pin.GeometryModel, moving: Mapping[int, int] | None = None
    ) -> None:
        moving = moving or {}
        self.paths = len(set(moving.values()))
        self._coal = CoalDistances(robot, geometry, moving)
        self._nv = robot.nv
        try:
            self._compiled: CompiledDistances | None = CompiledDistances(
                robot, geometry, moving=moving
            )
        except NotImplementedError:
            self._compiled = None

    def values(
        self,
        q: Array,
        pairs: Index,
        reach: float,
        wanted: Mask | None = None,
        rounding: Array | None = None,
        normals: Array | None = None,
    ) -> Array:
        """Distances of pairs, by number, at configurations (P, nq), shape (P, k), in [m].

        reach: distance in [m], beyond which a lower bound of at least that is returned.
        wanted: which distances are, (P, k), all if None; of others the reach is returned.
        rounding, normals: see Distances.values.
        """
        distances = np.empty((len(q), len(pairs)))
        self._coal.reset()
        for part in self._parts(len(q), len(pairs)):
            some = None if wanted is None else np.ascontiguousarray(wanted[part])
            sizes = None if rounding is None else np.ascontiguousarray(rounding[part])
            guesses = None if normals is None else normals[part]
            distances[part] = self._part_values(q[part], pairs, reach, some, sizes, guesses)
        return distances

    def expand(
        self,
        q: Array,
        pairs: Index,
        reach: float,
        force: Array | None,
        wanted: Mask | None = None,
        rounding: Array | None = None,
        normals: Array | None = None,
    ) -> tuple[Array, Array, Array]:
        """Distances, their derivatives (P, k, nv), and the sum of force d'', (P, nv, nv).

        Pairs beyond reach have no derivatives, and those that overlap by Coal no second ones.
        force: shape (P, k); zero if None. wanted, rounding, normals: as for `values`.
        """
        P, k = len(q), len(pairs)
        distances = np.empty((P, k))
        jacobian, curvature = np.empty((P, k, self._nv)), np.empty((P, self._nv, self._nv))
        self._coal.reset()
        for part in self._parts(P, k):
            weights = None if force is None else np.ascontiguousarray(force[part])
            some = None if wanted is None else np.ascontiguousarray(wanted[part])
            sizes = None if rounding is None else np.ascontiguousarray(rounding[part])
            guesses = None if normals is None else normals[part]
            found = self._part_expanded(q[part], pairs, reach, weights, some, sizes, guesses)
            distances[part], jacobian[part], curvature[part] = found
        return distances, jacobian, curvature

    def _parts(self, points: int, pairs: int) -> list[slice]:
        size = max(1, BATCH // max(1, pairs))
        return [slice(first, first + size) for first in range(0, points, size)]

    def _part_values(
        self,
        q: Array,
        pairs: Index,
        reach: float,
        wanted: Mask | None,
        rounding: Array | None,
        normals: Array | None,
    ) -> Array:
        raise_if_late()
        if self._compiled is None:
            unknown = np.ones((len(q), len(pairs)), dtype=bool) if wanted is None else wanted
            distances = np.full(unknown.shape, reach)
        else:
            distances, known = self._compiled.values(q, pairs, reach, wanted, rounding, normals)
            unknown = known == UNKNOWN
        for p in np.flatnonzero(unknown.any(axis=1)):
            raise_if_late()
            chosen = unknown[p]
            distances[p, chosen] = self._coal.values(q[p], pairs[chosen])
        return distances

    def _part_expanded(
        self,
        q: Array,
        pairs: Index,
        reach: float,
        force: Array | None,
        wanted: Mask | None,
        rounding: Array | None,
        normals: Array | None,
    ) -> tuple[Array, Array, Array]:
        raise_if_late()
        P, k, nv = len(q), len(pairs), self._nv
        if self._compiled is None:
            unknown = np.ones((P, k), dtype=bool) if wanted is None else wanted
            distances, jacobian = np.full((P, k), reach), np.zeros((P, k, nv))
            curvature = np.zeros((P, nv, nv))
        else:
            found = self._compiled.expand(q, pairs, reach, force, wanted, rounding, normals)
            distances, known, jacobian, curvature = found
            unknown = known == UNKNOWN
        for p in np.flatnonzero(unknown.any(axis=1)):
            raise_if_late()
            chosen = np.flatnonzero(unknown[p])
            distances[p, chosen], slopes = self._coal.expand(q[p], pairs[chosen])
            jacobian[p, chosen] = np.where(distances[p, chosen, None] <= reach, slopes, 0.0)
            if force is None:
                continue
            bent = chosen[(distances[p, chosen] > 0) & (force[p, chosen] != 0.0)]
            if len(bent):
                curvature[p] += self._coal.curvature(q[p], pairs[bent], force[p, bent])
        return distances, jacobian, curvature
