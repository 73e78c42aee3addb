"""The discrete Lagrangian L_d on T^(k-1)Q x T^(k-1)Q for any k, one interval at a time.

`DiscreteLagrangian` evaluates the action of a whole motion for the optimizer; here L_d is the
function of two end points in the theorems of the paper.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments, unchecked
from hovi.checks.shapes import require_shape
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import MAX_STEP, MIN_STEP
from hovi.errors import InputError, SchemeError
from hovi.flows.interval import FlatLagrangian, Interval, flat
from hovi.flows.legendre_transforms import jet_at_momenta
from hovi.flows.step_guesses import (
    DOUBTFUL,
    Trial,
    continued_modes,
    hard_step,
    mismatch,
    taylor_modes,
)
from hovi.optimize.batched_newton import System, newton, roots
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import Scheme
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@check_arguments
@dataclass(frozen=True, eq=False)
class SchemeLagrangian(FlatLagrangian):
    """L_d = h sum_j w_j L(q_j, q'_j, ..., q^(k)_j), extremal in the inner modes.

    lagrangian: L on T^(k)Q. scheme: a table for the same k. h: in [s].
    Raises SchemeError if the orders differ, InputError for a step that is not positive and for
    joints with nq != nv.
    """

    lagrangian: Lagrangian
    scheme: Scheme
    h: float

    def __post_init__(self) -> None:
        check_step(self.h)
        if self.lagrangian.nq != self.lagrangian.nv:
            raise InputError(
                "a SchemeLagrangian needs joints with nq = nv: for others use "
                "hovi.ChartedLagrangian(lagrangian, space, scheme, h)."
            )
        if self.scheme.derivatives != self.lagrangian.order:
            raise SchemeError(
                f"scheme {self.scheme.name!r} is for Lagrangians of order "
                f"{self.scheme.derivatives}, this one is of order {self.lagrangian.order}; use "
                f"galerkin(inner_modes, derivatives={self.lagrangian.order})."
            )

    @classmethod
    def of(cls, ld: DiscreteLagrangian) -> SchemeLagrangian:
        """The L_d of the intervals of a uniform grid."""
        return cls(ld.lagrangian, *uniform_grid(ld))

    def between(self, x0: Array, w: Array, t0: float = 0.0) -> Interval:
        """Newton's method for the inner modes."""
        self.require_points(x0=x0, w=w)
        B, k, r, n = len(x0), self.k, self.scheme.inner_modes, self.n
        if r == 0:
            return self._interval(x0, w, np.zeros((B, 0, n)), t0)

        def system(u: Array) -> tuple[Array, Array]:
            gradient, H = self._system(x0, w, u.reshape(B, r, n), t0)
            m = 2 * k * n
            return gradient.reshape(B, -1)[:, m:], H[:, m:, m:]

        u = self._solve(system, np.zeros((B, r * n)))
        return self._interval(x0, w, u.reshape(B, r, n), t0)

    def from_start(
        self, x0: Array, p0: Array, t0: float = 0.0, guess: Interval | None = None
    ) -> Interval:
        """Newton's method for (w, c): phi_w = gamma^T (S/h) T^-T (p0 + h phi_x), phi_c = 0.

        It starts from the curve of `guess` continued, the interval before, or from the exact jet at
        (x0, p0). Where it fails or ends far from there, shorter steps decide: see `hard_step`.
        """
        self.require_points(x0=x0, p0=p0)
        B = len(x0)
        if guess is None:
            modes = self._taylor(x0, p0, t0)
        else:
            modes = continued_modes(self.k, np.concatenate([guess.w, guess.inner], axis=1))
        found = roots(self._step(x0, p0, t0), modes.reshape(B, -1))
        u = found.u.reshape(modes.shape)
        easy = found.found & (mismatch(self.h, self.k, u, modes) < DOUBTFUL)
        for i in np.flatnonzero(~easy):
            start, p = x0[i : i + 1], p0[i : i + 1]
            end = None if not found.found[i] else self._end(start, u[i : i + 1], t0)
            first = Trial(u[i], float(found.residual[i]), end)
            u[i] = hard_step(self._attempt, self.h, start, p, t0, first).modes
        w, inner = self._split(u, B)
        return self._interval(x0, w, inner, t0)

    def _step(self, x0: Array, p0: Array, t0: float) -> System:
        """The equations of a step from momenta and their matrix, in the modes."""
        B, m = len(x0), self.k * self.n
        back, given = self._back, (self.regularized.back / self.h @ p0).reshape(B, m)

        def system(u: Array) -> tuple[Array, Array]:
            gradient, H = self._system(x0, *self._split(u, B), t0)
            g = gradient.reshape(B, -1)
            F, J = g[:, m:].copy(), H[:, m:, m:].copy()
            F[:, :m] -= given + g[:, :m] @ back.T
            J[:, :m] -= back @ H[:, :m, m:]
            return F, J

        return system

    def _attempt(self, h: float, x0: Array, p0: Array, t0: float, guess: Array | None) -> Trial:
        """One step of length h from a batch of one, for `hard_step`."""
        ld = self if h == self.h else replace(self, h=h)
        modes = ld._taylor(x0, p0, t0) if guess is None else guess[None]
        found = roots(ld._step(x0, p0, t0), modes.reshape(1, -1))
        u, residual = found.u.reshape(modes.shape), float(found.residual[0])
        if not found.found[0]:
            return Trial(u[0], residual, None)
        return Trial(u[0], residual, ld._end(x0, u, t0))

    def _end(self, x0: Array, modes: Array, t0: float) -> tuple[Array, Array]:
        """x1 and p1."""
        interval = self.at(x0, *self._split(modes, len(x0)), t0)
        return interval.x1, interval.p1

    def _taylor(self, x: Array, p: Array, t: float, at: float = 0.0) -> Array:
        """Modes of the exact jet at one end, s = `at`, shape (B, k + r, n)."""
        jet = jet_at_momenta(self.lagrangian, list(np.moveaxis(x, 1, 0)), p, t)
        return taylor_modes(self.k, self.k + self.scheme.inner_modes, self.h, *jet, at)

    def from_end(self, x1: Array, p1: Array, t0: float = 0.0) -> Interval:
        """Newton's method for (w, c): phi_w = gamma^T (S/h) p1, phi_c = 0, with x0 from w."""
        self.require_points(x1=x1, p1=p1)
        B, m, R = len(x1), self.k * self.n, self.regularized
        given = (R.gamma.T @ (R.scale[:, None] / self.h * p1)).reshape(B, m)
        moved = np.kron(R.inverse_taylor @ R.moments, np.eye(self.n))

        def system(u: Array) -> tuple[Array, Array]:
            w, inner = self._split(u, B)
            gradient, H = self._system(R.start(x1, w), w, inner, t0)
            F, J = gradient.reshape(B, -1)[:, m:].copy(), H[:, m:, m:].copy()
            F[:, :m] -= given
            J[:, :, :m] -= H[:, m:, :m] @ moved
            return F, J

        first = self._taylor(x1, p1, t0 + self.h, 1.0).reshape(B, -1)
        w, inner = self._split(self._solve(system, first), B)
        return self._interval(R.start(x1, w), w, inner, t0)

    def at(self, x0: Array, w: Array, inner: Array, t0: float = 0.0) -> Interval:
        """The interval with given inner modes, which are assumed to be extremal."""
        self.require_points(x0=x0, w=w)
        require_shape("inner", inner, len(x0), self.scheme.inner_modes, self.n)
        return self._interval(x0, w, inner, t0)

    @unchecked
    def jet(self, x0: Array, w: Array, inner: Array) -> list[Array]:
        """(q, q', ..., q^(k)) at the quadrature points, k + 1 arrays of shape (B * Q, n)."""
        data = np.concatenate([x0, w, inner], axis=1)  # (B, 2k + r, n)
        points = np.matmul(self._rows, data).reshape(len(x0), -1, self.k + 1, self.n)
        return [points[:, :, j].reshape(-1, self.n) for j in range(self.k + 1)]

    @cached_property
    def table(self) -> Array:
        """(q, q', ..., q^(k)) at the points over (x0, w, c), shape (Q, k + 1, 2 k + r)."""
        k, table = self.k, np.array(self.scheme.regular_table)
        table[:, :, k : 2 * k] = table[:, :, k : 2 * k] @ self.regularized.gamma
        columns = np.concatenate([np.arange(k), np.full(k + self.scheme.inner_modes, k)])
        powers = columns - np.arange(k + 1)[:, None]
        return np.where(table == 0, 0.0, table * self.h ** np.where(table == 0, 0, powers))

    def _system(self, x0: Array, w: Array, inner: Array, t0: float) -> tuple[Array, Array]:
        """Gradient (B, m, n) and Hessian (B, m n, m n) of phi in (x0, w, c)."""
        _, gradient, hessian = self._evaluate(self.jet(x0, w, inner), t0)
        return self._contract(gradient), flat(self._contract_twice(hessian))

    @np.errstate(over="ignore", invalid="ignore")
    def _interval(self, x0: Array, w: Array, inner: Array, t0: float) -> Interval:
        """The interval with these modes. Raises InputError for an action that is not finite."""
        jet = self.jet(x0, w, inner)
        value, gradient, hessian = self._evaluate(jet, t0)
        values = value.reshape(len(x0), -1) @ self.scheme.weights
        slopes = [j * np.sum(x * gradient[:, j], axis=1) for j, x in enumerate(jet)]
        scaled = (value - np.sum(slopes, axis=0)).reshape(len(x0), -1) @ self.scheme.weights
        if not np.isfinite([values, scaled]).all():
            raise InputError(
                f"the action of an interval of h = {self.h:g} s is not a finite number: use "
                "smaller states and momenta."
            )
        G, H = self._contract(gradient), self._contract_twice(hessian)
        return Interval(self.scheme, self.h, x0, w, inner, self.h * values, G, H, scaled)

    def _evaluate(self, jet: list[Array], t0: float) -> tuple[Array, Array, Array]:
        Q = len(self.scheme.weights)
        t = np.tile(t0 + self.h * self.scheme.points, len(jet[0]) // Q)
        return self.lagrangian.evaluate(*jet, t=t)

    def _contract(self, gradient: Array) -> Array:
        points = gradient.reshape(-1, len(self._rows), self.n)
        return np.asarray(np.matmul(self._weighted_rows, points))

    def _contract_twice(self, hessian: Array) -> Array:
        k, n, (Q, _, m) = self.k, self.n, self.table.shape
        blocks = hessian.reshape(-1, Q, k + 1, n, k + 1, n).transpose(0, 1, 2, 4, 3, 5)
        points = blocks.reshape(len(blocks), Q * (k + 1) ** 2, n * n)
        return np.asarray(np.matmul(self._pairs, points).reshape(-1, m, m, n, n))

    @cached_property
    def _rows(self) -> Array:
        return self.table.reshape(-1, self.table.shape[2])

    @cached_property
    def _weighted_rows(self) -> Array:
        table = self.scheme.weights[:, None, None] * self.table
        return np.ascontiguousarray(table.reshape(self._rows.shape).T)

    @cached_property
    def _pairs(self) -> Array:
        pairs = np.einsum("qri,qsj,q->ijqrs", self.table, self.table, self.scheme.weights)
        return np.asarray(pairs.reshape(self.table.shape[2] ** 2, -1))

    @cached_property
    def _back(self) -> Array:
        """`Regularized.back` (x) I, shape (k n, k n)."""
        return np.asarray(np.kron(self.regularized.back, np.eye(self.n)))

    def _split(self, u: Array, B: int) -> tuple[Array, Array]:
        modes = u.reshape(B, -1, self.n)
        return modes[:, : self.k], modes[:, self.k :]

    def _solve(self, system: System, u: Array) -> Array:
        root, found = newton(system, u)
        if not found.all():
            raise InputError(
                f"the discrete equations of an interval of h = {self.h:g} s have no solution near "
                "the initial guess: use a shorter step or smaller momenta."
            )
        return root


def uniform_grid(ld: DiscreteLagrangian) -> tuple[Scheme, float]:
    """The scheme and the step of a uniform grid. Raises InputError if intervals differ."""
    steps, schemes = ld.grid.steps, ld.grid.groups
    if len(schemes) > 1 or np.ptp(steps) > 1e-12 * steps[0]:
        raise InputError("a discrete flow needs a grid of equal steps with one scheme.")
    return schemes[0][0], float(steps[0])


def check_step(h: float) -> None:
    """Raise InputError for an invalid step."""
    if not (np.isfinite(h) and h > 0):
        raise InputError(f"a step must be positive and finite, got {h} s.")
    if not MIN_STEP <= h <= MAX_STEP:
        raise InputError(f"a step must be from {MIN_STEP:g} to {MAX_STEP:g} s, got {h:g} s.")
