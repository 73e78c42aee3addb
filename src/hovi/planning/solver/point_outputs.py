"""Further outputs between bounds at the quadrature points, such as distances and conditions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.planning.conditions.function import Points

Array = npt.NDArray[np.float64]
Range = tuple[Array, Array]


class ExpandedOutputs(NamedTuple):
    """The derivatives of outputs in the first entries of the jet (q, v, a), m of them.

    jacobian: shape (P, K, m). curvature: sum_k force_k d2 y_k at fixed second derivatives of the
    torques, shape (P, m, m). torques: weights of these second derivatives, (P, nv); None for none.
    """

    jacobian: Array
    curvature: Array
    torques: Array | None = None


class PointOutputs(ABC):
    """y of the motion at a point, dimensionless, with its derivatives in the tangent space."""

    @property
    @abstractmethod
    def size(self) -> int:
        """K, the number of outputs at a point."""

    @abstractmethod
    def values(self, at: Points) -> Array:
        """y, shape (P, K)."""

    @abstractmethod
    def expand(self, at: Points, force: Array) -> ExpandedOutputs:
        """The derivatives of y; force: weights of the outputs' curvature, shape (P, K)."""

    @abstractmethod
    def excess(self, trajectory: Trajectory, tolerance: float) -> Array:
        """The excess over lower and upper bounds in every interval, (2, N, K); -inf for none.

        Between the points, too. What is tolerated is at most the tolerance.
        """

    @abstractmethod
    def worst(self, trajectory: Trajectory, tolerance: float) -> tuple[float, str]:
        """The largest excess, and what exceeds its bound then and when, as a clause."""

    def bounds(self, t: Array) -> Range:
        """Lower and upper bounds at P times, (P, K) each: from zero on by default."""
        zero = np.zeros((len(t), self.size))
        return zero, np.full_like(zero, np.inf)


class JointOutputs(PointOutputs):
    """Several outputs, one after the other."""

    def __init__(self, parts: Sequence[PointOutputs]) -> None:
        self.parts = parts

    @property
    def size(self) -> int:
        """K, of all parts."""
        return sum(part.size for part in self.parts)

    def values(self, at: Points) -> Array:
        """y, shape (P, K)."""
        return np.concatenate([part.values(at) for part in self.parts], axis=1)

    def expand(self, at: Points, force: Array) -> ExpandedOutputs:
        """The derivatives of y."""
        ends = np.cumsum([part.size for part in self.parts])[:-1]
        forces = np.split(force, ends, axis=1)
        found = [part.expand(at, own) for part, own in zip(self.parts, forces, strict=True)]
        m = max(each.jacobian.shape[2] for each in found)
        widths = [m - each.jacobian.shape[2] for each in found]
        J = [
            np.pad(each.jacobian, ((0, 0), (0, 0), (0, width)))
            for each, width in zip(found, widths, strict=True)
        ]
        H = [
            np.pad(each.curvature, ((0, 0), (0, width), (0, width)))
            for each, width in zip(found, widths, strict=True)
        ]
        torques = [each.torques for each in found if each.torques is not None]
        total = np.sum(torques, axis=0) if torques else None
        return ExpandedOutputs(np.concatenate(J, axis=1), np.sum(H, axis=0), total)

    def excess(self, trajectory: Trajectory, tolerance: float) -> Array:
        """Those of all parts."""
        parts = [part.excess(trajectory, tolerance) for part in self.parts]
        return np.concatenate(parts, axis=2)

    def worst(self, trajectory: Trajectory, tolerance: float) -> tuple[float, str]:
        """The largest of any part."""
        return max(part.worst(trajectory, tolerance) for part in self.parts)

    def bounds(self, t: Array) -> Range:
        """Those of all parts."""
        lower, upper = zip(*(part.bounds(t) for part in self.parts), strict=True)
        return np.concatenate(lower, axis=1), np.concatenate(upper, axis=1)


def joint_outputs(*parts: PointOutputs | None) -> PointOutputs | None:
    """Those of all parts; None without any."""
    known = [part for part in parts if part is not None and part.size > 0]
    return None if not known else known[0] if len(known) == 1 else JointOutputs(known)
