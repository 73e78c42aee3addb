"""A collocation on a grid: its nonlinear program, its guess, and the motion that it found."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse
from scipy.interpolate import CubicHermiteSpline

from hovi.accuracy.peers.collocation_table import CollocationTable, lagrange_integrals
from hovi.accuracy.peers.point_program import PointProgram, dm
from hovi.discrete.guess import Boundary, Curve

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Collocation:
    """Unknowns w, shape (rows, n): node 0, its inner accelerations, node 1, and so on, in [s].

    table: the method. intervals: N, of equal length. duration: T. joints: n.
    """

    table: CollocationTable
    intervals: int
    duration: float
    joints: int

    @property
    def h(self) -> float:
        """Length of an interval, in [s]."""
        return self.duration / self.intervals

    @property
    def stride(self) -> int:
        """Rows of w from one node to the next."""
        return self.table.node_size + len(self.table.inner)

    @property
    def rows(self) -> int:
        """Rows of w."""
        return self.intervals * self.stride + self.table.node_size

    @cached_property
    def program(self) -> PointProgram:
        """What Ipopt solves."""
        table, N, h = self.table, self.intervals, self.h
        weights = [np.tile(h * table.weights, N)]
        points = [self._placed(self._scaled(table.points.reshape(-1, self._columns)))]
        if table.end_weight:
            weights.append(h * table.end_weight * np.where(self._at_ends, 1.0, 2.0))
            nodes = np.flatnonzero(np.arange(self.rows) % self.stride < 3)
            points.append(sparse.identity(self.rows, format="csr")[nodes])
        joints = sparse.identity(self.joints)
        return PointProgram(
            dm(sparse.kron(sparse.vstack(points), joints)),
            dm(sparse.kron(self._placed(self._scaled(table.ties)), joints)),
            np.concatenate(weights),
        )

    def unknowns(self, guess: Curve, boundary: Boundary) -> Array:
        """w of a curve, its ends put on the boundary data."""
        q, v, a = guess(np.linspace(0.0, self.duration, self.intervals + 1))
        w, size = np.zeros((self.rows, self.joints)), self.table.node_size
        for i, x in enumerate((q, v, a)[:size]):
            w[i :: self.stride][: self.intervals + 1] = x
        w[0], w[1], w[self._last], w[self._last + 1] = boundary
        if len(self.table.inner):
            inner = guess(self._inner_times)[2]
            body = w[: self._last].reshape(self.intervals, self.stride, self.joints)
            body[:, size:] = inner.reshape(self.intervals, -1, self.joints)
        return w

    @property
    def held(self) -> Array:
        """Which rows of w are boundary data, shape (rows,)."""
        held = np.zeros(self.rows, dtype=bool)
        held[[0, 1, self._last, self._last + 1]] = True
        return held

    def configurations(self, w: Array, t: Array) -> Array:
        """q at times (M,), shape (M, n).

        The collocation polynomial, or the Hermite cubic where accelerations stand at the nodes.
        """
        nodes = np.linspace(0.0, self.duration, self.intervals + 1)
        q, v = (w[i :: self.stride][: self.intervals + 1] for i in (0, 1))
        if self.table.end_weight:
            return np.asarray(CubicHermiteSpline(nodes, q, v)(t))
        k = np.clip((t / self.h).astype(int), 0, self.intervals - 1)
        s = t / self.h - k
        inner = w[: self._last].reshape(self.intervals, self.stride, -1)[:, 2:]
        twice = lagrange_integrals(self.table.inner, s)[1]
        move = np.einsum("mj,mjn->mn", twice, inner[k])
        return np.asarray(q[k] + self.h * s[:, None] * v[k] + self.h**2 * move)

    @property
    def _columns(self) -> int:
        return self.stride + self.table.node_size

    @property
    def _last(self) -> int:
        """The row of the last node."""
        return self.intervals * self.stride

    @property
    def _at_ends(self) -> Array:
        index = np.arange(self.intervals + 1)
        return np.asarray((index == 0) | (index == self.intervals))

    @property
    def _inner_times(self) -> Array:
        begins = self.h * np.arange(self.intervals)
        return np.asarray(begins[:, None] + self.h * self.table.inner).ravel()

    def _scaled(self, rows: Array) -> Array:
        """Rows for (q, v, a) instead of (q, h v, h^2 a), in and out."""
        size = self.table.node_size
        node = self.h ** np.arange(size)
        into = np.concatenate([node, np.full(len(self.table.inner), self.h**2), node])
        out = self.h ** (np.arange(len(rows)) % 3) if len(rows) % 3 == 0 else np.ones(len(rows))
        return np.asarray(rows * into / out[:, None])

    def _placed(self, rows: Array) -> sparse.spmatrix:
        """The rows of one interval, repeated along the motion."""
        N = self.intervals
        i, j = np.nonzero(rows)
        k = np.arange(N)[:, None]
        data = np.tile(rows[i, j], N)
        index = (k * len(rows) + i).ravel(), (k * self.stride + j).ravel()
        return sparse.csr_matrix((data, index), shape=(N * len(rows), self.rows))
