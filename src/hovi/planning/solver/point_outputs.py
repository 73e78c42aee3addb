"""Further outputs between bounds at the quadrature points, such as the values of conditions."""

from __future__ import annotations

from abc import ABC, abstractmethod
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
