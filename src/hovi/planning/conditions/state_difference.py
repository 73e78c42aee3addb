"""The difference of joints from a state, as of a via point."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.planning.conditions.function import Function, Points, Slopes
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StateDifference(Function):
    """(q (-) target, v - velocity), in the prescribed components.

    Its curvature vanishes at its root, and is taken as zero.

    target: configuration, shape (nq,). velocity: shape (nv,). held: which components of (q, v)
    are prescribed, shape (2, nv).
    """

    coordinates: Coordinates
    target: Array
    velocity: Array
    held: npt.NDArray[np.bool_]

    @property
    def needs(self) -> frozenset[str]:
        """Both."""
        return frozenset({"q", "v"})

    @property
    def size(self) -> int:
        """Number of prescribed components."""
        return int(self.held.sum())

    def values(self, at: Points) -> Array:
        """The prescribed components of (q (-) target, v - velocity), shape (P, size)."""
        return np.stack([self._error(q, v)[self.held] for q, v in zip(at.q, at.v, strict=True)])

    def slopes(self, at: Points) -> Slopes:
        """Derivatives in q and v."""
        J = np.stack([self._slope(q)[self.held] for q in at.q])
        return {"q": J[:, :, 0], "v": J[:, :, 1]}

    def describe(self, at: Points, missed: Array) -> str:
        """The joint with the largest error."""
        error = np.abs(self._error(at.q[0], at.v[0])) * self.held
        row, i = np.unravel_index(int(np.argmax(error)), error.shape)
        kind = ("position", "velocity")[row]
        joint = self.coordinates.coordinate_names[i]
        return f"the {kind} of joint {joint!r} misses it by {error[row, i]:.3g}"

    def _slope(self, q: Array) -> Array:
        """Of all components in (q, v), shape (2, nv, 2, nv)."""
        n = self.coordinates.nv
        J = np.eye(2 * n).reshape(2, n, 2, n)
        if not self.coordinates.vector_joints:
            J[0, :, 0] = self.coordinates.chart.end_slope(
                self.coordinates.difference(self.target, q)
            )
        return J

    def _error(self, q: Array, v: Array) -> Array:
        return np.stack([self.coordinates.difference(self.target, q), v - self.velocity])
