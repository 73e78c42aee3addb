"""Chart operations on batches of points and intervals, by the compiled module.

portable: use the baseline instruction set instead of the fastest available one, for comparison.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi._native import groups as native
from hovi.checks.kinds import compact
from hovi.robot.space.groups import Layout
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


def rates(
    layout: Layout, x: Array, base_rates: Array | None = None, portable: bool = False
) -> tuple[Array, Array]:
    """v = J(x) x' and a = J(x) x'' + J' x', each (P, n), of curves exp(x(t)).

    x: (x, x', x''), shape (3, P, n). base_rates: v and a of curves q(t), shape (2, P, n), for
    the rates of q(t) (+) x(t).
    """
    out = np.empty((2, *x.shape[1:]))
    moving = None if base_rates is None else compact(base_rates)
    native.rates(layout, compact(x), moving, out, portable)
    return out[0], out[1]


def local_rates(
    layout: Layout, x: Array, v: Array, a: Array, portable: bool = False
) -> tuple[Array, Array]:
    """(x', x'') of curves at x with velocities v and accelerations a, all (P, n)."""
    out = np.empty((2, *x.shape))
    native.local_rates(layout, compact(x), compact(v), compact(a), out, portable)
    return out[0], out[1]


@dataclass(frozen=True, eq=False)
class CompiledCharts:
    """The chain rule in the charts of B intervals, with m columns of n components.

    layout: of the configuration space. table: shape (Q, 3, m). weights: shape (Q,); of intervals
    with tables of their own (B Q, 3, m) and (B Q,).
    h: lengths of the intervals, shape (B,). x: (x, x', x'') at the points, shape (3, B Q, n).
    ends: (x1, h x1'), shape (B, 2, n).
    """

    layout: Layout
    table: Array
    weights: Array
    h: Array
    x: Array
    ends: Array
    portable: bool = False

    def expand(self, gradient: Array, hessian: Array) -> tuple[Array, Array]:
        """Gradient (B, m, n) and Hessian (B, m, m, n, n) of h sum_q w_q L in nodal columns.

        gradient: of L in (q, v, a) at the points, 3 n numbers each. hessian: symmetric, (3 n)^2.
        """
        B, m, n = self._size
        H = np.ascontiguousarray(hessian.reshape(-1, 3 * n, 3 * n))
        gradients, hessians = np.empty((B, m, n)), np.empty((B, m, m, n, n))
        g = self._at_points(gradient)
        native.expand(*self._arrays, g, H, gradients, hessians, self.portable)
        return gradients, hessians

    def pull_gradient(self, gradient: Array, regular: bool) -> Array:
        """The gradient alone, (B, m, n). regular: the table is over (q0, h v0, Z0, Z1, c)."""
        pulled = np.empty(self._size)
        g = self._at_points(gradient)
        native.pull_gradient(*self._arrays, g, regular, pulled, self.portable)
        return pulled

    def pull_moments(self, tests: Array, jacobian: Array) -> Array:
        """Gradients of h sum_q w_q t_q y, (B, K, p, m, n), of outputs y and test functions t.

        tests: t at the points, shape (K, Q). jacobian: of the outputs in (q, v, a), (P, p, 3 n).
        """
        B, m, n = self._size
        tests = np.ascontiguousarray(tests.reshape(-1, len(self.weights)))
        rows = np.ascontiguousarray(jacobian.reshape(self.x.shape[1], -1, 3 * n))
        pulled = np.empty((B, len(tests), rows.shape[1], m, n))
        native.pull_moments(*self._arrays, tests, rows, pulled, self.portable)
        return pulled

    def push_steps(self, step: Array) -> Array:
        """Change of (q, v, a) at the points, (B, Q, 3, n), in a step of the columns (B, m, n)."""
        B, _, n = self._size
        change = np.empty((B, self.x.shape[1] // max(B, 1), 3, n))
        native.push_steps(*self._arrays, np.ascontiguousarray(step), change, self.portable)
        return change

    def _at_points(self, gradient: Array) -> Array:
        return np.ascontiguousarray(gradient.reshape(self.x.shape[1], -1))

    @property
    def _size(self) -> tuple[int, int, int]:
        """(B, m, n)."""
        return len(self.h), self.table.shape[2], self.x.shape[2]

    @property
    def _arrays(self) -> tuple[Layout, Array, Array, Array, Array, Array]:
        scheme = np.ascontiguousarray(self.table), self.weights, np.ascontiguousarray(self.h)
        return self.layout, *scheme, np.ascontiguousarray(self.x), np.ascontiguousarray(self.ends)
