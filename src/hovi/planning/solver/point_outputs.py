"""Outputs of q that have to be 0 or more at the quadrature points, distances for instance."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


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
