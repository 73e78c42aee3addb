"""Outputs of q that have to be 0 or more at the quadrature points: distances, for instance."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import numpy.typing as npt

from hovi.planning.clearance.clearance import SCALE
from hovi.planning.clearance.distances import Distances

Array = npt.NDArray[np.float64]

CUSHION = 5e-4
"""What distances keep beyond the margin at the points, as a share of SCALE: 0.05 mm that the
motion may use up between them."""
LEVELS = 1.0, 3.0
"""Excess over the margin at which distances begin to count less, and from which not at all."""
NEGLIGIBLE = 1e-2
"""Share of the largest force below which the curvature of an output is left out."""


class PointOutputs(ABC):
    """y(q) >= 0 in units of its own scale, with its derivatives in the tangent space."""

    @property
    @abstractmethod
    def size(self) -> int:
        """K, the number of outputs at a point."""

    @abstractmethod
    def values(self, q: Array) -> Array:
        """y at configurations (P, nq), shape (P, K)."""

    @abstractmethod
    def expand(self, q: Array, force: Array) -> tuple[Array, Array]:
        """Derivatives of y in q along `integrate`.

        force: weights of the outputs' curvature, shape (P, K).
        Returns y' (P, K, nv) and sum_k force_k y''_k (P, nv, nv).
        """


class ClearanceOutputs(PointOutputs):
    """y = (phi(d) - least) / SCALE for every pair's distance d.

    phi(d) = d for near pairs and constant for far ones, with two continuous derivatives between:
    what is far away has no influence, and needs no derivatives.

    distances: of the pairs. least: what they have to keep, in [m].
    """

    def __init__(self, distances: Distances, least: float) -> None:
        self.distances = distances
        self.least = least

    @property
    def size(self) -> int:
        """Number of pairs."""
        return len(self.distances.pairs)

    def values(self, q: Array) -> Array:
        """y, shape (P, K)."""
        return _levelled(self._excess(self.distances.values(q)))[0]

    def expand(self, q: Array, force: Array) -> tuple[Array, Array]:
        """Derivatives, and the curvature of the pairs that are near and push: see PointOutputs."""
        d, jacobian = self.distances.expand(q, self.least + LEVELS[1] * SCALE)
        y, slope, bend = _levelled(self._excess(d))
        jacobian /= SCALE
        pushing = np.abs(force) > NEGLIGIBLE * np.max(np.abs(force), initial=0.0)
        pull = np.where(pushing & (y < LEVELS[1]), force * slope / SCALE, 0.0)
        curvature = self.distances.curvature(q, pull)
        bent = (force * bend)[:, :, None] * jacobian
        curvature += np.matmul(jacobian.transpose(0, 2, 1), bent)
        return slope[:, :, None] * jacobian, curvature

    def _excess(self, d: Array) -> Array:
        return (d - self.least) / SCALE


def _levelled(y: Array) -> tuple[Array, Array, Array]:
    """phi and its two derivatives, in units of SCALE: y, then y - x^3 + x^4/2, then constant."""
    near, far = LEVELS
    width = far - near
    x = np.clip((y - near) / width, 0.0, 1.0)
    level = near + width * (x - x**3 + 0.5 * x**4)
    slope, bend = (1.0 - x) ** 2 * (1.0 + 2.0 * x), -6.0 * x * (1.0 - x) / width
    return np.where(y > near, level, y), slope, bend
