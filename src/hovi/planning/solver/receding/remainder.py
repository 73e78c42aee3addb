"""The remainder of a motion from a time on: its grid, its paths, its points and its rows of limits.

Intervals that have passed are dropped, and the one that has begun is shortened, so that the rest of
the motion stays as it is and as accurate, to rounding where the configurations need no charts.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.interval_paths import path_of_order, scaled_data
from hovi.discrete.path_on_grid import path_on_grid
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.schemes.interval_curve import end_basis, gamma, jet_rows
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

LEAST_FRACTION = 0.05
"""Length of the rest of an interval, relative to the next one, below which both become one."""
MORE_POINTS = 2
"""Gauss points in a part of an interval, beyond half the degree of what is integrated."""


@dataclass(frozen=True, eq=False)
class Remainder:
    """What is left of a grid from a time on.

    whole: the grid. time: in [s], inside it. first: number of the interval whose scheme, and whose
        end, the first one of the remainder has.
    """

    whole: Grid
    time: float
    first: int

    @classmethod
    def after(cls, whole: Grid, time: float, kept: tuple[int, ...] = ()) -> Remainder:
        """The remainder after a time in [0, T), in [s].

        kept: nodes that stay nodes.
        """
        first = int(np.searchsorted(whole.t, time, side="right")) - 1
        if first + 1 < whole.intervals and first + 1 not in kept:
            short = whole.t[first + 1] - time < LEAST_FRACTION * whole.steps[first + 1]
            first += int(short)
        return cls(whole, time, first)

    @cached_property
    def grid(self) -> Grid:
        """The grid of the remainder."""
        if self.time == 0.0:
            return self.whole
        steps = self.whole.steps[self.first :].copy()
        steps[0] = self.whole.t[self.first + 1] - self.time
        return Grid(steps, self.whole.schemes[self.first :])

    def path(self, path: DiscretePath, problem: TrajectoryProblem) -> DiscretePath:
        """The remainder of a path on the whole grid. problem: the one it belongs to."""
        if self.time == 0.0:
            return path
        space = problem.coordinates.curved_space
        if space is None or space.flat:
            begun = self._shortened(path, space)
        else:
            begun = self._projected(path, problem)
        rest = self.first + 1
        parts = (
            (begun.q[:1], path.q[rest:]),
            (begun.v[:1], path.v[rest:]),
            (begun.z, path.z[rest:]),
            (begun.inner, path.inner[rest:]),
        )
        q, v, z, inner = (np.concatenate(part) for part in parts)
        inner = inner[:, : self.grid.inner_modes]  # the intervals that have more may have passed
        higher = path.higher
        if higher.size:
            higher = np.concatenate([begun.higher[:1], higher[rest:]])
        return DiscretePath(q, v, z, inner, higher)

    def rows(self, rows: LimitRows) -> tuple[LimitRows, Index]:
        """The rows on the remainder, and the numbers of those that they were; -1 for none."""
        if self.time == 0.0:
            return rows.copied(), np.arange(rows.size)
        return rows.remaining(self.grid, self.first)

    def points(self, ld: DiscreteLagrangian, rest: DiscreteLagrangian) -> Index:
        """The quadrature points whose multipliers those of the remainder begin with.

        ld, rest: on the whole grid and on the remainder. Points are numbered as in ld; those of the
        first interval are the nearest ones in time.
        """
        numbers, old = (np.concatenate(each) for each in (ld.point_intervals, ld.point_times))
        own, t = (np.concatenate(each) for each in (rest.point_intervals, rest.point_times))
        before, after = np.lexsort((old, numbers)), np.lexsort((t, own))
        found = np.zeros(len(own), dtype=np.intp)
        found[after[own[after] > 0]] = before[numbers[before] > self.first]
        near, begun = np.flatnonzero(numbers <= self.first), own == 0
        distances = np.abs(old[near][:, None] - t[begun] - self.time)
        found[begun] = near[distances.argmin(axis=0)]
        return found

    def _shortened(self, path: DiscretePath, space: ConfigurationSpace | None) -> DiscretePath:
        """The first interval, on vector spaces and commutative groups."""
        k, grid, last = path.order, self.whole, self.first
        begun = self._begun
        numbers = np.arange(begun, last + 1)
        data = scaled_data(path, numbers, grid.steps[numbers][:, None], path.inner.shape[1])
        moments, rows = self._tables(k, path.inner.shape[1])
        top = sum(m @ x for m, x in zip(moments, data, strict=True))
        jet = rows @ data[0]  # (k + 1, n)
        h = self.grid.steps[:1]
        rates = jet[1:k] / grid.steps[begun] ** np.arange(1.0, k)[:, None]
        q0 = path.q[begun] + jet[0] if space is None else space.integrate(path.q[begun], jet[0])
        nodes = np.stack([rates, path.rates[last + 1]])
        q = np.stack([q0, path.q[last + 1]])
        return path_of_order(k, q, nodes, top[None, :k], top[None, k:], h, space)

    @cached_property
    def _known(self) -> dict[tuple[int, int], tuple[list[Array], Array]]:
        return {}

    def _tables(self, k: int, r: int) -> tuple[list[Array], Array]:
        """The matrices of `_moments`, and the rows of the interpolant at the new start."""
        if (k, r) not in self._known:
            begun = self._begun
            s = (self.time - self.whole.t[begun]) / self.whole.steps[begun]
            self._known[k, r] = self._moments(k, r), jet_rows(np.array([s]), k, r)[0]
        return self._known[k, r]

    @property
    def _begun(self) -> int:
        """Number of the interval that the time is in."""
        return int(np.searchsorted(self.whole.t, self.time, side="right")) - 1

    def _moments(self, k: int, r: int) -> list[Array]:
        """Matrices from the data of each old interval to its part of (z, c / h^k), per [s^k]."""
        grid = self.whole
        own = grid.schemes[self.first].inner_modes
        end, length = grid.t[self.first + 1], self.grid.steps[0]
        x, w = np.polynomial.legendre.leggauss(r + k + MORE_POINTS)
        matrices = []
        for number in range(self._begun, self.first + 1):
            h, low = grid.steps[number], max(self.time, grid.t[number])
            t = low + (grid.t[number + 1] - low) * (x + 1) / 2
            fraction = (grid.t[number + 1] - low) / length
            curve = jet_rows(np.minimum((t - grid.t[number]) / h, 1.0), k, r)[:, k] / h**k
            at = 1.0 - (end - t) / length
            ends = gamma(k) @ end_basis(at, k)
            tops = jet_rows(at, k, r)[:, k, 2 * k - 1 :].T  # orthonormal
            tops[own:] = 0.0
            basis = np.concatenate([ends, tops])
            matrices.append(fraction * (basis * (w / 2)) @ curve)
        return matrices

    def _projected(self, path: DiscretePath, problem: TrajectoryProblem) -> DiscretePath:
        """The first interval on noncommutative groups, in the chart at its own start."""
        motion, end = problem.trajectory(path), self.first + 1
        on, grid = problem.coordinates, Grid(self.grid.steps[:1], self.grid.schemes[:1])

        def curve(t: Array) -> tuple[Array, ...]:
            return motion.jet(np.minimum(t + self.time, motion.duration))

        jet, last = curve(np.zeros(1)), (path.q[end], path.v[end])
        ends = [np.stack([x[0], y]) for x, y in zip(jet, last, strict=False)]
        short = path_on_grid(curve, grid, ends[: path.order], on)
        modes = path.inner.shape[1] - short.inner.shape[1]
        inner = np.pad(short.inner, ((0, 0), (0, modes), (0, 0)))
        return DiscretePath(short.q, short.v, short.z, inner, short.higher)
