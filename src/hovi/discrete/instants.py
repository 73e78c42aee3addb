"""Instants of a motion, other than its quadrature points, at which multipliers act as forces."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.checks.shapes import require_shape
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.interval_batch import Coordinates, Jet
from hovi.discrete.interval_paths import displacements_at, scaled_data
from hovi.errors import InputError
from hovi.robot.space.chart import Chart
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.schemes import Scheme
from hovi.schemes.scheme import regular_from_nodal
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


@check_arguments
@dataclass(frozen=True, eq=False)
class Instants:
    """Instants at relative positions s in the intervals of a grid.

    intervals: their numbers, ascending, shape (E,). positions: s in [0, 1], shape (E,).
    weights: quadrature weights of the forces, positive, shape (E,), in [s].
    Raises InputError for arrays that do not fit each other.
    """

    intervals: Index
    positions: Array
    weights: Array

    def __post_init__(self) -> None:
        require_shape("positions", self.positions, len(self.intervals))
        require_shape("weights", self.weights, len(self.intervals))
        inside = (self.positions >= 0) & (self.positions <= 1)
        if not inside.all() or (np.diff(self.intervals) < 0).any():
            raise InputError(
                "instants are at positions from 0 to 1 in ascending intervals; sort them."
            )

    def __len__(self) -> int:
        return len(self.intervals)


@dataclass(frozen=True, eq=False)
class InstantBatch:
    """Instants that are evaluated together, with the interface of an `IntervalBatch`.

    grid: on which they are. numbers: of their intervals, shape (E,). s: their positions.
    barrier_weights: their weights.
    """

    grid: Grid
    numbers: Index
    s: Array
    barrier_weights: Array

    @property
    def index(self) -> Index:
        """The numbers of the intervals, some of them several times."""
        return self.numbers

    @property
    def points(self) -> int:
        """One instant for each entry of `numbers`."""
        return 1

    @property
    def modes(self) -> int:
        """Inner modes of the table: zero columns where an interval has fewer."""
        return self.grid.inner_modes

    @cached_property
    def h(self) -> Array:
        """Lengths of the intervals, shape (E,), in [s]."""
        return np.asarray(self.grid.steps[self.numbers])

    @cached_property
    def t(self) -> Array:
        """Times, shape (E,), in [s]."""
        return np.asarray(self.grid.t[self.numbers] + self.s * self.h)

    @cached_property
    def weights(self) -> Array:
        """Weights in a barrier, shape (E, 1), in [s]."""
        return self.barrier_weights[:, None]

    @cached_property
    def table(self) -> Array:
        """Rows of the interpolant, (E, k + 1, 2 k - 1 + r), over (h q0', ..., Z, c)."""
        k, r = self.grid.order, self.modes
        table = np.zeros((len(self.s), k + 1, 2 * k - 1 + r))
        for scheme, members in self.grid.groups:
            everywhere = len(members) == self.grid.intervals
            here = slice(None) if everywhere else np.isin(self.numbers, members)
            rows = scheme.rows(self.s[here])
            table[here, :, : rows.shape[2]] = rows
        return table

    @cached_property
    def _position_rows(self) -> Array:
        """Those of x alone, (E, 2 k - 1 + r)."""
        return np.ascontiguousarray(self.table[:, 0])

    def displacements(self, path: DiscretePath) -> Array:
        """x of q = q0 (+) x at the instants, (E, n): see `displacements_at`."""
        return displacements_at(self._position_rows, self.grid.steps, self.numbers, path)

    @cached_property
    def tables(self) -> dict[Coordinates, Array]:
        """Over the columns of both kinds of coordinates, (E, k + 1, m)."""
        base = np.zeros((len(self.s), self.grid.order + 1, 1))
        base[:, 0] = 1.0
        regular = np.concatenate([base, self.table], axis=2)
        return {
            "regular": regular,
            "nodal": regular @ regular_from_nodal(self.modes, self.grid.order),
        }

    @cached_property
    def step_tables(self) -> dict[Coordinates, Array]:
        """(q, q', ...) at the instants over the columns, (E, k + 1, m)."""
        powers = self.h[:, None] ** -np.arange(self.grid.order + 1.0)
        return {name: table * powers[:, :, None] for name, table in self.tables.items()}

    def sums(self, values: Array) -> Array:
        """Weighted values, (E,)."""
        return np.asarray(values * self.barrier_weights)

    def jet(self, path: DiscretePath) -> Jet:
        """(q, q', ..., q^(k)) at the instants, each of shape (E, n), on vector spaces."""
        x, *rates = self._local(path)
        return path.q[self.numbers] + x, *rates

    def jet_on(self, space: ConfigurationSpace, path: DiscretePath) -> Jet:
        """The same in the charts of the intervals."""
        x, q0 = self._local(path), path.q[self.numbers]
        if self.grid.order == 2:
            return Chart(space).jet(q0, x[0], x[1], x[2])
        return space.integrate(q0, x[0]), *x[1:]

    @cached_property
    def contraction_weights(self) -> Array:
        """The weights as fractions of the intervals, shape (E,)."""
        return np.asarray(self.barrier_weights / self.h)

    def add(self, parts: Array, sums: Array) -> None:
        """Add what belongs to the instants, (E, ...), to what belongs to the intervals."""
        np.add.at(sums, self.numbers, parts)

    def contracted(self, gradient: Array, coordinates: Coordinates) -> Array:
        """The weighted gradient (E, m, n) alone, from that at the instants, (E, k + 1, n)."""
        weighted = gradient * self.barrier_weights[:, None, None]
        return np.asarray(np.matmul(self.step_tables[coordinates].transpose(0, 2, 1), weighted))

    @cached_property
    def scheme(self) -> Scheme:
        """A scheme whose points and tables are those of the instants, one of each interval."""
        return Scheme("instants", 0, self.s, self.contraction_weights, self.table)

    def local(self, path: DiscretePath) -> Array:
        """(x, x', x'') of q = q0 (+) x, shape (3, E, n): see IntervalBatch.local."""
        x = np.stack(self._local(path))
        return x if len(x) > 2 else np.append(x, np.zeros_like(x[:1]), axis=0)

    def _local(self, path: DiscretePath) -> tuple[Array, ...]:
        """(x, x', ..., x^(k)) of q = q0 (+) x, (E, n) each."""
        powers = self.h[:, None] ** np.arange(self.grid.order + 1.0)
        data = scaled_data(path, self.numbers, self.h[:, None], self.modes)
        x = np.matmul(self.table, data) / powers[:, :, None]
        return tuple(np.ascontiguousarray(x[:, j]) for j in range(x.shape[1]))


def instant_batches(
    grid: Grid, instants: Instants | None, segments: Index | None
) -> Iterator[InstantBatch]:
    """The instants in batches of one segment each; none for None.

    segments: number of the segment of every interval, (N,), if there are several.
    Raises InputError for intervals that the grid does not have.
    """
    if instants is None or len(instants) == 0:
        return
    if instants.intervals[0] < 0 or instants.intervals[-1] >= grid.intervals:
        raise InputError(f"instants must be in intervals 0 to {grid.intervals - 1}.")
    of = np.zeros(len(instants)) if segments is None else segments[instants.intervals]
    for part in np.unique(of):
        here = of == part
        numbers, s = instants.intervals[here], instants.positions[here]
        yield InstantBatch(grid, numbers, s, instants.weights[here])
