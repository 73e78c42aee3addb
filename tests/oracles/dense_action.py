"""The discrete action's gradient and Hessian in all unknowns of a motion, as dense matrices.

`DiscreteLagrangian.expand` gives the blocks, which tests/discrete compares with differences.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import hovi
from oracles.path_steps import moved

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


class DenseAction:
    """The action near a path whose nodes, ends apart, and inner modes are free.

    gradient, hessian: in the unknowns q, v, ... of the nodes and the inner modes.
    nodes: number of the unknown of every coordinate, (N + 1, k, nv); -1 where it is given.
    """

    def __init__(self, problem: hovi.TrajectoryProblem, path: hovi.DiscretePath) -> None:
        self._problem, self._path = problem, path
        expansion, grid, k = problem.ld.expand(path), problem.grid, problem.ld.k
        N, m, n = expansion.gradient.shape
        free = np.ones((N + 1, k, n), dtype=bool)
        free[[0, -1]] = problem.free_ends
        inner = np.arange(m - 2 * k) < np.array([s.inner_modes for s in grid.schemes])[:, None]
        inner = np.broadcast_to(inner[:, :, None], (N, m - 2 * k, n))
        count = free.sum()
        self.nodes: Index = np.where(free, np.cumsum(free).reshape(free.shape) - 1, -1)
        modes = np.where(inner, count + np.cumsum(inner).reshape(inner.shape) - 1, -1)
        columns = np.concatenate([self.nodes[:-1], self.nodes[1:], modes], axis=1)
        orders = np.concatenate([np.tile(np.arange(k), 2), np.zeros(m - 2 * k)])
        scales = grid.steps[:, None] ** orders
        self._columns, self._scales = columns, scales[:, :, None]
        self.size = int(count + inner.sum())
        self.gradient = self.along(expansion.gradient)
        self.hessian = np.zeros((self.size, self.size))
        for number, scale, H in zip(columns, scales, expansion.hessian, strict=True):
            own = number >= 0
            H = H.transpose(0, 2, 1, 3) * scale[:, None, None, None] * scale[:, None]
            self.hessian[np.ix_(number[own], number[own])] += H[own][:, own]

    def along(self, gradients: Array) -> Array:
        """The gradient of a sum over intervals from those in their columns, (N, m, n)."""
        total, own = np.zeros(self.size), self._columns >= 0
        np.add.at(total, self._columns[own], (self._scales * gradients)[own])
        return total

    def step(self, unknowns: Array) -> Array:
        """A change of the unknowns in the columns of the intervals: see oracles.path_steps."""
        return np.asarray(np.append(unknowns, 0.0)[self._columns] * self._scales)

    def moved(self, unknowns: Array) -> hovi.DiscretePath:
        """The path after a change of the unknowns."""
        return moved(self._problem, self._path, self.step(unknowns))

    def index(self, held: Index | None = None) -> int:
        """The number of negative eigenvalues, none of which is near zero. held: given unknowns."""
        H = self.hessian
        if held is not None:
            rest = np.setdiff1d(np.arange(len(H)), held)
            H = H[np.ix_(rest, rest)]
        values = np.linalg.eigvalsh(H)
        assert np.abs(values).min() > 1e-9 * np.abs(values).max()
        return int((values < 0).sum())

    def newton_step(self) -> float:
        """The largest change of q and T v in a step of Newton's method, relative to them."""
        step = np.append(np.linalg.solve(self.hessian, -self.gradient), 0.0)
        q, v, T = self._path.q, self._path.v, self._problem.grid.duration
        size = max(1.0, np.abs(q).max(), T * np.abs(v).max())
        change = np.abs(step[self.nodes]).max(axis=(0, 2)) * T ** np.arange(self._problem.ld.k)
        return float(change.max() / size)
