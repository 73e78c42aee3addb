"""An interval of a discrete motion, with all derivatives of L_d.

L_d(x0, x1) = h phi(x0, w), and phi and its derivatives stay of order one as h tends to zero. They
give the momenta, D1 .. D2k and D11 .. of L_d, and the tangent map of the discrete flow.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments, unchecked
from hovi.checks.shapes import require_shape
from hovi.errors import InputError
from hovi.flows.regularized import Regularized, regularized
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import Scheme
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Interval:
    """B intervals of length h with extremal inner modes.

    scheme: of the discrete action. h: in [s].
    x0: jets (q, q', ..., q^(k-1)) at the start, shape (B, k, n).
    w: regularized coordinates, shape (B, k, n). inner: inner modes, shape (B, r, n); both in the
        units of q^(k).
    values: L_d, shape (B,).
    gradient: of phi = L_d / h in (x0, w, c), shape (B, 2 k + r, n).
    hessian: of phi, shape (B, 2 k + r, 2 k + r, n, n).
    step_rate: derivative of L_d in h at fixed h^j q^(j) and inner modes, shape (B,).
    """

    scheme: Scheme
    h: float
    x0: Array
    w: Array
    inner: Array
    values: Array
    gradient: Array
    hessian: Array
    step_rate: Array

    @property
    def k(self) -> int:
        """Order of the Lagrangian."""
        return int(self.x0.shape[1])

    @property
    def regularized(self) -> Regularized:
        """The transformation between (x0, w) and (x0, x1)."""
        return regularized(self.k, self.h)

    @cached_property
    def x1(self) -> Array:
        """Jets at the end, shape (B, k, n)."""
        return self.regularized.end(self.x0, self.w)

    @cached_property
    def z(self) -> Array:
        """z_j = (q1^(j) - sum_i h^i / i! q0^(j+i)) / h^(k-j), shape (B, k, n)."""
        return self.regularized.z(self.w)

    @cached_property
    def p1(self) -> Array:
        """Momenta at the end, D_{k+1} .. D_2k of L_d, shape (B, k, n)."""
        dz = self.regularized.inverse_gamma.T @ self.gradient[:, self.k : 2 * self.k]
        return np.asarray(self.h * dz / self.regularized.scale[:, None])

    @cached_property
    def p0(self) -> Array:
        """Momenta at the start, -D_1 .. -D_k of L_d, shape (B, k, n)."""
        return np.asarray(self.regularized.taylor.T @ self.p1 - self.h * self.gradient[:, : self.k])

    @property
    def derivatives(self) -> Array:
        """D_1 .. D_2k of L_d with respect to (x0, x1), shape (B, 2 k, n)."""
        return np.concatenate([-self.p0, self.p1], axis=1)

    @property
    def scaled_momenta(self) -> Array:
        """Derivatives of phi in (h x0, w), of one size as h tends to zero, shape (B, 2 k, n).

        Momenta are these times powers of 1/h, which amplify rounding errors; w amplifies them by
        the condition of d2L/dq^(k)2.
        """
        scale = np.concatenate([np.full(self.k, self.h), np.ones(self.k)])[:, None]
        return np.asarray(scale * self.gradient[:, : 2 * self.k])

    @property
    def step_derivative(self) -> Array:
        """D_h of L_d at fixed ends, shape (B,); for the exact L_d it is minus the energy."""
        powers = np.arange(self.k)[:, None] / self.h
        moved = np.sum(powers * (self.p1 * self.x1 - self.p0 * self.x0), axis=(1, 2))
        return np.asarray(self.step_rate + moved)

    @cached_property
    def condensed(self) -> Array:
        """Hessian of phi in (x0, w) with the inner modes extremal, (B, 2 k n, 2 k n)."""
        H, m = flat(self.hessian), 2 * self.k * self.x0.shape[2]
        if self.inner.shape[1] == 0:
            return np.asarray(H)
        inner = np.linalg.solve(H[:, m:, m:], H[:, m:, :m])
        return np.asarray(H[:, :m, :m] - H[:, :m, m:] @ inner)

    @property
    def second_derivatives(self) -> Array:
        """D_ij of L_d with respect to (x0, x1), shape (B, 2 k, 2 k, n, n)."""
        k, n = self.k, self.x0.shape[2]
        A = np.concatenate([np.eye(k, 2 * k), self.regularized.from_ends])
        A = np.kron(A, np.eye(n))
        H = self.h * (A.T @ self.condensed @ A)
        return np.asarray(H.reshape(-1, 2 * k, n, 2 * k, n).transpose(0, 1, 3, 2, 4))

    @property
    def regularity_matrix(self) -> Array:
        """W_d = [D_{i, k+j} L_d], i, j = 1 .. k, shape (B, k n, k n).

        [ColomboFerraroMartin2016, section 4]
        """
        k = self.k
        return flat(self.second_derivatives[:, :k, k:])

    @property
    def newton_matrix(self) -> Array:
        """The Jacobian of `from_start` in the unknowns w, shape (B, k n, k n).

        d/dw of phi_w - gamma^T (S/h) T^-T (p0 + h phi_x): for k = 2 the equations are scaled as
        h p and p~ - h p. It tends to d2L/dq^(k)2 (x) I as h tends to zero.
        """
        own, carried = self.newton_terms
        return own - carried

    @property
    def newton_terms(self) -> tuple[Array, Array]:
        """The two matrices whose difference `newton_matrix` is: that of w, and that through x0."""
        K, m = self.condensed, self.k * self.x0.shape[2]
        return K[:, m:, m:], np.asarray(self._back @ K[:, :m, m:])

    @property
    def tangent(self) -> Array:
        """The tangent map d(x1, p1) / d(x0, p0) of the discrete Hamiltonian flow, (B, 2kn, 2kn)."""
        k, n, R = self.k, self.x0.shape[2], self.regularized
        K, m = self.condensed, k * n
        back = self._back / self.h  # gamma^T (S/h) T^-T
        rhs = np.concatenate([self._back @ K[:, :m, :m] - K[:, m:, :m], 0 * K[:, :m, :m]], axis=2)
        rhs[:, :, m:] = back
        dw = np.linalg.solve(self.newton_matrix, rhs)
        dx1 = np.kron(R.moments, np.eye(n)) @ dw
        dx1[:, :, :m] += np.kron(R.taylor, np.eye(n))
        dp = self.h * K[:, :m, m:] @ dw
        dp[:, :, :m] += self.h * K[:, :m, :m]
        dp[:, :, m:] += np.eye(m)
        dp1 = np.kron(R.inverse_taylor.T, np.eye(n)) @ dp
        return np.concatenate([dx1, dp1], axis=1)

    @property
    def _back(self) -> Array:
        """`Regularized.back` (x) I, shape (k n, k n)."""
        return np.asarray(np.kron(self.regularized.back, np.eye(self.x0.shape[2])))


def flat(blocks: Array) -> Array:
    """(B, m, l, n, n) -> (B, m n, l n)."""
    B, m, count, n, _ = blocks.shape
    return blocks.transpose(0, 1, 3, 2, 4).reshape(B, m * n, count * n)


class EndsAndMomenta(Protocol):
    """What the intervals of vector spaces and of groups have in common.

    Momenta have shape (B, k, n), L_d (B,), and W_d = [D_{i, k+j} L_d] (B, k n, k n).
    """

    @property
    def x0(self) -> Array:
        """The start."""

    @property
    def x1(self) -> Array:
        """The end."""

    @property
    def p0(self) -> Array:
        """Momenta at the start."""

    @property
    def p1(self) -> Array:
        """Momenta at the end."""

    @property
    def values(self) -> Array:
        """L_d."""

    @property
    def regularity_matrix(self) -> Array:
        """W_d."""


class IntervalLagrangian(ABC):
    """L_d(x0, x1) for an interval of length h, x = (q, q', ..., q^(k-1)) in T^(k-1)Q.

    On vector spaces points have shape (B, k, n), on groups (B, 1, nq + (k - 1) nv).
    lagrangian: L on T^(k)Q. h: length of the interval, in [s].
    """

    lagrangian: Lagrangian
    h: float

    @property
    def k(self) -> int:
        """Order of the Lagrangian."""
        return self.lagrangian.order

    @property
    def n(self) -> int:
        """Degrees of freedom."""
        return self.lagrangian.nv

    @property
    def regularized(self) -> Regularized:
        """The transformation between (x0, w) and (x0, x1)."""
        return regularized(self.k, self.h)

    @property
    def on_group(self) -> bool:
        """Whether points are rows (q, q', ..), as on groups."""
        return self.lagrangian.space is not None

    @abstractmethod
    def joining(self, x0: Array, x1: Array, t0: float = 0.0) -> EndsAndMomenta:
        """The interval between two points. t0: time at its start, in [s]."""

    @abstractmethod
    def from_start(
        self, x0: Array, p0: Array, t0: float = 0.0, guess: Any = None
    ) -> EndsAndMomenta:
        """(F^-)^-1: the interval that starts at x0 with momenta p0.

        guess: the interval before.
        """

    @abstractmethod
    def from_end(self, x1: Array, p1: Array, t0: float = 0.0) -> EndsAndMomenta:
        """(F^+)^-1: the interval that ends at x1 with momenta p1."""

    def value(self, x0: Array, x1: Array) -> Array:
        """L_d(x0, x1), shape (B,)."""
        return self.joining(x0, x1).values


@check_arguments
class FlatLagrangian(IntervalLagrangian):
    """L_d(x0, x1) on a vector space."""

    @property
    def on_group(self) -> bool:
        """False."""
        return False

    @abstractmethod
    def between(self, x0: Array, w: Array, t0: float = 0.0) -> Interval:
        """The interval with given ends, in regularized coordinates: x0, w of shape (B, k, n).

        t0: time at its start, in [s]. Raises InputError if Newton's method fails.
        """

    @abstractmethod
    def from_start(
        self, x0: Array, p0: Array, t0: float = 0.0, guess: Interval | None = None
    ) -> Interval:
        """(F^-)^-1: the interval that starts at x0 with momenta p0, both (B, k, n)."""

    @abstractmethod
    def from_end(self, x1: Array, p1: Array, t0: float = 0.0) -> Interval:
        """(F^+)^-1: the interval that ends at x1 with momenta p1, both (B, k, n)."""

    def joining(self, x0: Array, x1: Array, t0: float = 0.0) -> Interval:
        """The interval between two points of T^(k-1)Q, both (B, k, n)."""
        self.require_points(x0=x0, x1=x1)
        return self.between(x0, self.regularized.w(x0, x1), t0)

    @unchecked
    def require_points(self, **points: Array) -> None:
        """Raise InputError unless arrays have the same shape (B, k, n), with B of 1 or more."""
        B = 0
        for name, array in points.items():
            require_shape(name, array, B or None, self.k, self.n)
            B = len(array)
            if B == 0:
                raise InputError(f"{name} must have one row or more, got shape {array.shape}.")
