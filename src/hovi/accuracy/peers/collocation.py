"""Collocation on a grid: nonlinear program, initial guess, and interpolated motion."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse
from scipy.interpolate import CubicHermiteSpline

from hovi.accuracy.peers.collocation_table import CollocationTable, lagrange_integrals
from hovi.accuracy.peers.point_program import PointProgram, casadi_matrix
from hovi.discrete.guess import Curve, Ends
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Collocation:
    """A collocation method on N equal intervals.

    The unknowns w, shape (rows, n), are node 0, the inner accelerations of interval 0, node 1, ...

    table: the method. intervals: N. duration: T, in [s]. joints: n.
    """

    table: CollocationTable
    intervals: int
    duration: float
    joints: int

    @property
    def h(self) -> float:
        """Length T / N of an interval, in [s]."""
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
        """The nonlinear program for Ipopt."""
        table, N, h = self.table, self.intervals, self.h
        weights = [np.tile(h * table.weights, N)]
        points = [self._along_motion(self._scaled(table.points.reshape(-1, self._columns)))]
        if table.end_weight:
            weights.append(h * table.end_weight * np.where(self._at_ends, 1.0, 2.0))
            nodes = np.flatnonzero(np.arange(self.rows) % self.stride < 3)
            points.append(sparse.identity(self.rows, format="csr")[nodes])
        joints = sparse.identity(self.joints)
        return PointProgram(
            casadi_matrix(sparse.kron(sparse.vstack(points), joints)),
            casadi_matrix(sparse.kron(self._along_motion(self._scaled(table.defects)), joints)),
            np.concatenate(weights),
        )

    def unknowns(self, guess: Curve, ends: Ends) -> Array:
        """w of a curve, with the boundary values at its ends."""
        q, v, a = guess(np.linspace(0.0, self.duration, self.intervals + 1))
        w, size = np.zeros((self.rows, self.joints)), self.table.node_size
        for i, x in enumerate((q, v, a)[:size]):
            w[i :: self.stride][: self.intervals + 1] = x
        (w[0], w[self._last]), (w[1], w[self._last + 1]) = ends
        if len(self.table.inner):
            inner = guess(self._inner_times)[2]
            body = w[: self._last].reshape(self.intervals, self.stride, self.joints)
            body[:, size:] = inner.reshape(self.intervals, -1, self.joints)
        return w

    @property
    def fixed(self) -> Array:
        """Mask of the rows of w that are boundary values, shape (rows,)."""
        fixed = np.zeros(self.rows, dtype=bool)
        fixed[[0, 1, self._last, self._last + 1]] = True
        return fixed

    def configurations(self, w: Array, t: Array) -> Array:
        """q at times (M,), shape (M, n).

        By the collocation polynomial, or by the Hermite cubic when accelerations are at the nodes.
        """
        nodes = np.linspace(0.0, self.duration, self.intervals + 1)
        q, v = (w[i :: self.stride][: self.intervals + 1] for i in (0, 1))
        if self.table.end_weight:
            return np.asarray(CubicHermiteSpline(nodes, q, v)(t))
        k = np.clip((t / self.h).astype(int), 0, self.intervals - 1)
        s = t / self.h - k
        inner = w[: self._last].reshape(self.intervals, self.stride, -1)[:, 2:]
        double_integrals = lagrange_integrals(self.table.inner, s)[1]
        displacement = np.einsum("mj,mjn->mn", double_integrals, inner[k])
        return np.asarray(q[k] + self.h * s[:, None] * v[k] + self.h**2 * displacement)

    @property
    def _columns(self) -> int:
        return self.stride + self.table.node_size

    @property
    def _last(self) -> int:
        """Row of the last node."""
        return self.intervals * self.stride

    @property
    def _at_ends(self) -> Array:
        index = np.arange(self.intervals + 1)
        return np.asarray((index == 0) | (index == self.intervals))

    @property
    def _inner_times(self) -> Array:
        starts = self.h * np.arange(self.intervals)
        return np.asarray(starts[:, None] + self.h * self.table.inner).ravel()

    def _scaled(self, rows: Array) -> Array:
        """Rows in terms of (q, v, a) instead of (q, h v, h^2 a), for inputs and outputs."""
        size = self.table.node_size
        node = self.h ** np.arange(size)
        into = np.concatenate([node, np.full(len(self.table.inner), self.h**2), node])
        out = self.h ** (np.arange(len(rows)) % 3) if len(rows) % 3 == 0 else np.ones(len(rows))
        return np.asarray(rows * into / out[:, None])

    def _along_motion(self, rows: Array) -> sparse.spmatrix:
        """The rows of one interval, repeated along the motion."""
        N = self.intervals
        i, j = np.nonzero(rows)
        k = np.arange(N)[:, None]
        data = np.tile(rows[i, j], N)
        index = (k * len(rows) + i).ravel(), (k * self.stride + j).ravel()
        return sparse.csr_matrix((data, index), shape=(N * len(rows), self.rows))
