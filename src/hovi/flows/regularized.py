"""Regularized coordinates of an interval: end data without cancellation as h tends to zero.

[ColomboFerraroMartin2016, section 2]. A point of T^(k-1)Q is x = (q, q', ..., q^(k-1)). The end of
an interval is x1 = T x0 + S z, with T[j, j+i] = h^i / i! (Taylor) and S = diag(h^(k-j)), and
z = gamma w. At h = 0 the ends coincide, but z and w are still the moments of q^(k): (x0, w) are
coordinates up to and including h = 0, and (x0, x1) are not.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from math import factorial

import numpy as np
import numpy.typing as npt

from hovi.schemes import gamma, inverse_gamma
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Regularized:
    """The coordinate transformations (x0, w) <-> (x0, z) <-> (x0, x1) of an interval of length h.

    k: order of the Lagrangian. h: length of the interval, in [s].
    Arrays of jets and moments have shape (..., k, n).
    """

    k: int
    h: float

    @cached_property
    def taylor(self) -> Array:
        """T of x1 = T x0 + S z, shape (k, k)."""
        return self._powers(self.h)

    @cached_property
    def inverse_taylor(self) -> Array:
        """T^-1, with (-h)^i / i! above the diagonal."""
        return self._powers(-self.h)

    @cached_property
    def scale(self) -> Array:
        """Diagonal h^(k-j) of S, shape (k,)."""
        return self.h ** np.arange(self.k, 0.0, -1.0)

    @cached_property
    def gamma(self) -> Array:
        """gamma^[k] of z = gamma w, shape (k, k)."""
        return gamma(self.k)

    @cached_property
    def inverse_gamma(self) -> Array:
        """The inverse of gamma, shape (k, k)."""
        return inverse_gamma(self.k)

    @cached_property
    def moments(self) -> Array:
        """S gamma of x1 = T x0 + S gamma w, shape (k, k)."""
        return np.asarray(self.scale[:, None] * self.gamma)

    @cached_property
    def back(self) -> Array:
        """gamma^T S T^-T, which maps forces along the interval to the equations of w, (k, k)."""
        return np.asarray(self.gamma.T @ (self.scale[:, None] * self.inverse_taylor.T))

    @cached_property
    def from_ends(self) -> Array:
        """Matrix of w = A (x0, x1), shape (k, 2 k)."""
        unscaled = self.inverse_gamma / self.scale
        return np.concatenate([-unscaled @ self.taylor, unscaled], axis=1)

    def end(self, x0: Array, w: Array) -> Array:
        """x1 = T x0 + S gamma w."""
        return np.asarray(self.taylor @ x0 + self.moments @ w)

    def start(self, x1: Array, w: Array) -> Array:
        """x0 = T^-1 (x1 - S gamma w)."""
        return np.asarray(self.inverse_taylor @ (x1 - self.moments @ w))

    def z(self, w: Array) -> Array:
        """z = gamma w, the coordinates that a trajectory stores."""
        return np.asarray(self.gamma @ w)

    def w_of_z(self, z: Array) -> Array:
        """w = gamma^-1 z; for k = 2: w1 = z1 and w0 = 2 sqrt(3) (z0 - z1 / 2)."""
        return np.asarray(self.inverse_gamma @ z)

    def w(self, x0: Array, x1: Array) -> Array:
        """w from the two ends, with the rounding error eps |q| / h^k of their difference."""
        difference = x1 - x0 - (self.taylor - np.eye(self.k)) @ x0
        return self.w_of_z(difference / self.scale[:, None])

    def _powers(self, h: float) -> Array:
        T = np.eye(self.k)
        for j in range(self.k):
            for i in range(1, self.k - j):
                T[j, j + i] = h**i / factorial(i)
        return T


@lru_cache(maxsize=256)
def regularized(k: int, h: float) -> Regularized:
    """The coordinate transformations of intervals of length h, cached."""
    return Regularized(k, h)
