"""The discrete Lagrangian L_d on TQ x TQ: the action over one interval, by a scheme's table.

This is linear algebra on top of the pointwise Lagrangian: nothing is derived, differentiated or
compiled again when the scheme, the step or the number of intervals changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.checks.shapes import require_shape
from hovi.discrete.contraction import Expansion, contract, joined
from hovi.discrete.grid import MORE_MODES, DiscretePath, Grid
from hovi.discrete.instants import InstantBatch, Instants, instant_batches
from hovi.discrete.interval_batch import Coordinates, IntervalBatch, Jet, interval_batches
from hovi.discrete.interval_charts import Charts, charts_on, jet_on
from hovi.errors import InputError, SchemeError
from hovi.robot.space.chart import Chart
from hovi.scene.lagrangian import Lagrangian, NoCost, PointTerms, time_slope
from hovi.scene.segmented_lagrangian import SegmentedLagrangian
from hovi.schemes.scheme import regular_from_nodal
from hovi.system.dataclass import dataclass
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Batch = IntervalBatch | InstantBatch


@check_arguments
@dataclass(frozen=True, eq=False)
class DiscreteLagrangian:
    """L_d = h sum_j w_j L(q_j, v_j, a_j) on every interval of a grid.

    [ColomboFerraroMartin2016, sections 3 and 5]

    lagrangian: L on T^(k)Q.
    grid: the intervals and their schemes, which are tables for the same k.
    instants: further points of the motion, at which L counts as zero and has no outputs, and only
        `terms` act; they are in the last batches.
    Raises SchemeError if the orders differ, InputError for k > 2 on noncommutative groups.
    """

    lagrangian: Lagrangian
    grid: Grid
    instants: Instants | None = None

    def __post_init__(self) -> None:
        if self.grid.order != self.lagrangian.order:
            raise SchemeError(
                f"scheme {self.grid.groups[0][0].name!r} is for Lagrangians of order "
                f"{self.grid.order}, this one is of order {self.lagrangian.order}; use "
                f"galerkin(inner_modes, derivatives={self.lagrangian.order})."
            )
        if self.k > 2 and self.chart is not None:
            raise InputError(
                f"boundary value problems of order {self.k} need the third derivatives of charts "
                "of orientations, which are not implemented: lock such joints with "
                "load_robot(..., locked=[...])."
            )
        _ = self.segments  # raises where the grid has no node at the end of one

    @property
    def k(self) -> int:
        """The order of the Lagrangian."""
        return self.lagrangian.order

    @property
    def columns(self) -> int:
        """m, the number of columns of an interval: 2 k for its ends, and the inner modes."""
        return 2 * self.k + self.grid.inner_modes

    @cached_property
    def finer(self) -> DiscreteLagrangian:
        """That of the grid with MORE_MODES, for error estimates."""
        return DiscreteLagrangian(self.lagrangian, self.grid.enriched(MORE_MODES))

    @cached_property
    def chart(self) -> Chart | None:
        """The chart of the intervals; None if it is the identity."""
        space = self.lagrangian.space
        return None if space is None or space.flat else Chart(space)

    def values(self, path: DiscretePath, jets: list[Jet] | None = None) -> Array:
        """L_d of every interval, shape (N,).

        jets: the result of `jets` for this path, if it is known.
        """
        self._check(path, jets)
        values = np.empty(self.grid.intervals)
        for lagrangian, batch, jet in zip(
            self.lagrangians, self.interval_batches, jets or self.jets(path), strict=False
        ):
            values[batch.index] = batch.sums(lagrangian.value(*jet, t=batch.t))
        return values

    def action(self, path: DiscretePath, jets: list[Jet] | None = None) -> float:
        """The discrete action sum_k L_d(q_k, v_k, q_{k+1}, v_{k+1}); jets as for `values`."""
        self._check(path, jets)
        known, weights = jets or self.jets(path), self.point_weights
        parts = zip(self.lagrangians, self.interval_batches, known, weights, strict=False)
        return sum(float(w @ L.value(*jet, t=batch.t)) for L, batch, jet, w in parts)

    def expand(
        self,
        path: DiscretePath,
        coordinates: Coordinates = "nodal",
        multipliers: list[Array] | None = None,
        terms: list[PointTerms] | None = None,
        jets: list[Jet] | None = None,
        keep_points: bool = False,
    ) -> Expansion:
        """Value, gradient and Hessian of every L_d: see Expansion.

        multipliers: weights of the outputs' curvature, one array per batch, from `predict`; R y
            when None.
        terms: contributions of limits at the points, one per batch; they do not affect values.
        jets: as for `values`. keep_points: whether the expansion has those at the points.
        """
        self._check(path, jets)
        self._check_terms(terms)
        if multipliers is not None and len(multipliers) != len(self.batches):
            raise InputError(
                f"multipliers must be {len(self.batches)} arrays, one per batch, got "
                f"{len(multipliers)}."
            )
        parts, known, charts = [], jets or self.jets(path), self._charts(path)
        for i, batch in enumerate(self.batches):
            if i > 0:
                raise_if_late()
            multiplier = None if multipliers is None else multipliers[i]
            term = None if terms is None else terms[i]
            jet, L = known[i], self.lagrangians[i]
            point = L.expand(*jet, t=batch.t, multiplier=multiplier, terms=term)
            value, outputs = batch.sums(point.value), [(point.outputs, point.jacobian)]
            kept = [point] if keep_points else None
            if charts is not None:
                gradient, hessian = charts[i].expand(point.gradient, point.hessian)
                parts.append(Expansion(value, gradient, hessian, outputs, [charts[i]], kept))
                continue
            table, weights = batch.tables[coordinates], batch.contraction_weights
            gradient, hessian = contract(table, weights, batch.h, point.gradient, point.hessian)
            parts.append(Expansion(value, gradient, hessian, outputs, None, kept))
        whole = self.grid.intervals, self.columns
        return parts[0] if len(parts) == 1 else joined(self.batches, parts, *whole)

    def gradient(
        self,
        path: DiscretePath,
        coordinates: Coordinates = "nodal",
        jets: list[Jet] | None = None,
    ) -> Array:
        """The gradient of every L_d in columns of the coordinates, (N, m, n); jets as above."""
        self._check(path, jets)
        gradient = np.zeros((self.grid.intervals, self.columns, self.lagrangian.nv))
        parts = zip(self.lagrangians, self.batches, jets or self.jets(path), strict=True)
        for lagrangian, batch, jet in parts:
            point_gradient = lagrangian.gradient(*jet, t=batch.t)
            if self.chart is None:
                part = batch.contracted(point_gradient, coordinates)
            else:
                part = self._charts_of(batch, path).nodal_gradient(point_gradient)
            batch.add(part, gradient[:, : part.shape[1]])
        return gradient

    def predict(self, expansion: Expansion, step: Array, coordinates: Coordinates) -> list[Array]:
        """R (y + J dx) at the quadrature points after a step: multipliers for `expand`.

        step: in the intervals' scaled coordinates, shape (N, m, n).
        """
        steps = self._point_steps(step, coordinates, expansion)
        parts = zip(self.lagrangians, expansion.outputs, steps, strict=True)
        return [L.predicted_slope(y, J, dx) for L, (y, J), dx in parts]

    def point_steps(
        self, step: Array, coordinates: Coordinates, expansion: Expansion
    ) -> list[Array]:
        """Change of the jet at the quadrature points in a step, (P, (k + 1) n) per batch.

        expansion: at the path from which the step is taken.
        """
        return self._point_steps(step, coordinates, expansion)

    def _point_steps(
        self, step: Array, coordinates: Coordinates, expansion: Expansion
    ) -> list[Array]:
        """As `point_steps`. Raises InputError for a step or an expansion of another grid."""
        N = self.grid.intervals
        require_shape("step", step, N, self.columns, self.lagrangian.nv)
        if len(expansion.values) != N:
            raise InputError(
                f"the expansion must be one on this grid of {N} intervals, got one of "
                f"{len(expansion.values)}."
            )
        steps = []
        for i, batch in enumerate(self.batches):
            columns = step[batch.index, : 2 * self.k + batch.modes]
            if expansion.charts is not None:
                moved = expansion.charts[i].point_steps(columns)
            else:
                moved = np.matmul(batch.step_tables[coordinates], columns)  # (B, (k + 1) Q, n)
            steps.append(moved.reshape(len(batch.t), -1))
        return steps

    def jets(self, path: DiscretePath) -> list[Jet]:
        """(q, q', ..., q^(k)) at the quadrature points, each of shape (P, n), per batch."""
        self._check(path)
        return [self._jet(batch, path) for batch in self.batches]

    def turns(self, path: DiscretePath) -> Array:
        """The largest rotation angle in the chart of every interval, shape (N,), in [rad].

        At its quadrature points and its end; zero without charts, infinite far beyond them.
        """
        self._check(path)
        turns = np.zeros(self.grid.intervals)
        for batch, charts in zip(self.batches, self._charts(path) or (), strict=False):
            np.maximum.at(turns, batch.numbers, charts.turns)
        return turns

    @cached_property
    def point_weights(self) -> list[Array]:
        """h w_j of every quadrature point, shape (P,), per batch."""
        return [batch.weights.ravel() for batch in self.batches]

    @cached_property
    def point_times(self) -> list[Array]:
        """Time of every quadrature point, shape (P,), per batch."""
        return [batch.t for batch in self.batches]

    @cached_property
    def point_intervals(self) -> list[Index]:
        """Number of the interval of every quadrature point, shape (P,), per batch."""
        return [np.repeat(batch.numbers, batch.points) for batch in self.batches]

    def momenta(self, path: DiscretePath, forces: list[PointTerms] | None = None) -> Array:
        """Momenta (p, p~) at the nodes, shape (N + 1, k, nv).

        p_k = -D1 L_d and p~_k = -D2 L_d of the interval that starts at node k (F-), and
        p_N = D3 L_d, p~_N = D4 L_d of the last (F+). [ColomboFerraroMartin2016, section 3, with F+
        and F- the other way round, as the paper's later text uses them]
        forces: as for `derivatives`.
        """
        g = self.derivatives(path, forces)
        return np.concatenate([-g[:, : self.k], g[-1:, self.k :]])

    def derivatives(
        self,
        path: DiscretePath,
        forces: list[PointTerms] | None = None,
        jets: list[Jet] | None = None,
    ) -> Array:
        """D1 .. D4 of every L_d with respect to (q0, v0, q1, v1), shape (N, 4, nv).

        For any order, D_1 .. D_2k with respect to (q0, q0', ..., q1, q1', ...), (N, 2 k, nv).

        At a path whose inner modes are extremal these are the derivatives of the condensed L_d.
        forces: multipliers of limits and of passive joints, whose work is part of L_d.
        jets: as for `values`.
        """
        N, n = self.grid.intervals, self.lagrangian.nv
        g = np.zeros((N, 2 * self.k, n))
        gradients = self.point_gradients(path, forces, jets)
        for batch, gradient in zip(self.batches, gradients, strict=True):
            if self.chart is not None:
                batch.add(self._charts_of(batch, path).end_gradient(gradient), g)
                continue
            regular = batch.contracted(gradient, "regular")
            batch.add(regular[:, : 2 * self.k], g)
        return np.asarray(np.matmul(self._end_columns, g))

    @cached_property
    def _end_columns(self) -> Array:
        """Matrices from the gradient in an interval's end columns to D1 .. D2k, (N, 2 k, 2 k)."""
        scales = self.grid.steps[:, None] ** np.tile(np.arange(self.k), 2)
        k = self.k
        nodal = np.eye(2 * k) if self.chart is not None else regular_from_nodal(0, k).T
        return np.asarray(scales[:, :, None] * nodal)

    def point_gradients(
        self,
        path: DiscretePath,
        forces: list[PointTerms] | None = None,
        jets: list[Jet] | None = None,
    ) -> list[Array]:
        """dL / d(q, q', ...) at the quadrature points, (P, k + 1, nv) per batch; as above."""
        self._check(path, jets)
        self._check_terms(forces)
        known = jets or self.jets(path)
        terms: Sequence[PointTerms | None] = forces or [None] * len(known)
        parts = zip(self.lagrangians, self.batches, known, terms, strict=True)
        return [L.gradient(*jet, t=b.t, terms=term) for L, b, jet, term in parts]

    def duration_derivative(
        self,
        path: DiscretePath,
        forces: list[PointTerms] | None = None,
        rates: Array | None = None,
    ) -> float:
        """d S / d T of a stationary action S, at fixed nodal q and v; T changes the nodes' times.

        With the lengths h of the intervals and the times t of the points it is the sum of
        dS/dh dh/dT and of h w dL/dt dt/dT, with T dh/dT = h unless rates say something else; then,
        for L independent of time, it is minus Pontryagin's Hamiltonian.
        forces: as for `derivatives`. rates: dt/dT of the nodes, shape (N + 1,).
        """
        nodes = self.grid.t
        rates = nodes / self.grid.duration if rates is None else rates
        total = float(np.diff(rates) @ self.step_derivatives(path, forces))
        if not self._depends_on_time(forces):
            return total
        jets, batches = self.jets(path), self.batches
        terms: Sequence[PointTerms | None] = forces or [None] * len(batches)
        for L, batch, jet, term, w in zip(
            self.lagrangians, batches, jets, terms, self.point_weights, strict=True
        ):
            moved = w * np.interp(batch.t, nodes, rates)
            total += float(moved @ time_slope(L, jet, batch.t, term))
        return total

    def _depends_on_time(self, forces: list[PointTerms] | None) -> bool:
        of_forces = any(each.time_gradient is not None for each in forces or ())
        return of_forces or any(each.timed for each in self.lagrangians)

    def step_derivatives(self, path: DiscretePath, forces: list[PointTerms] | None = None) -> Array:
        """d S / d h of the length of every interval, shape (N,); as `duration_derivative`.

        h dS/dh = L_d - sum h w sum_j j dL/dq^(j) . q^(j) + sum_j j (D_{1+j} L_d . q0^(j) +
        D_{k+1+j} L_d . q1^(j)).
        """
        total, k, rates = self.values(path), self.k, path.rates
        gradients = self.point_gradients(path, forces)
        points = self.point_weights, self.point_intervals
        for jet, g, w, numbers in zip(self.jets(path), gradients, *points, strict=True):
            work = np.sum([j * np.vecdot(g[:, j], jet[j]) for j in range(1, k + 1)], 0)
            total -= np.bincount(numbers, w * work, self.grid.intervals)
        d = self.derivatives(path, forces)
        for j in range(1, k):
            total += j * np.vecdot(d[:, j], rates[:-1, j - 1])
            total += j * np.vecdot(d[:, k + j], rates[1:, j - 1])
        return np.asarray(total / self.grid.steps)

    def _check(self, path: DiscretePath, jets: list[Jet] | None = None) -> None:
        """Raise InputError for a path that does not fit the grid, or jets at other points."""
        if path is not self._fitting[0]:
            self.grid.require_path(path, self.lagrangian.nq, self.lagrangian.nv)
            self._fitting[0] = path
        if jets and [[x.shape for x in jet] for jet in jets] != self._jet_shapes:
            raise InputError(
                "the jets are not at this path's points: pass the result of `jets` for it, or None."
            )

    @cached_property
    def _fitting(self) -> list[DiscretePath | None]:
        """The last path that was found to fit the grid."""
        return [None]

    @cached_property
    def _jet_shapes(self) -> list[list[tuple[int, ...]]]:
        """Shapes of q and its derivatives at the points of each batch."""
        nq, nv = self.lagrangian.nq, self.lagrangian.nv
        return [[(len(b.t), nq), *[(len(b.t), nv)] * self.k] for b in self.batches]

    def _check_terms(self, terms: list[PointTerms] | None) -> None:
        """Raise InputError for terms that are not one per batch, at its points."""
        if terms is None:
            return
        points = [len(batch.t) for batch in self.batches]
        given = [len(term.jet_gradient) for term in terms]
        if given != points:
            raise InputError(f"terms must be one per batch, at {points} points, got {given}.")

    def _jet(self, batch: Batch, path: DiscretePath) -> Jet:
        """The jet at the points of a batch, each of shape (P, n)."""
        space = self.lagrangian.space
        if space is None:
            return batch.jet(path)
        if isinstance(batch, InstantBatch):
            return batch.jet_on(space, path)
        return jet_on(space, batch, path)

    def _charts(self, path: DiscretePath) -> list[Charts] | None:
        return None if self.chart is None else [self._charts_of(b, path) for b in self.batches]

    def _charts_of(self, batch: Batch, path: DiscretePath) -> Charts:
        assert self.chart is not None
        return charts_on(self.chart, batch, path)

    @cached_property
    def interval_batches(self) -> list[IntervalBatch]:
        """The intervals in batches of one scheme and segment, which are evaluated together."""
        return list(interval_batches(self.grid, self.segments))

    @cached_property
    def batches(self) -> list[Batch]:
        """Those of the intervals, then those of the further instants."""
        instants = instant_batches(self.grid, self.instants, self.segments)
        return [*self.interval_batches, *instants]

    @cached_property
    def segments(self) -> Index | None:
        """The number of the segment of every interval, shape (N,); None for a single one."""
        L = self.lagrangian
        return L.segments_of(self.grid.t) if isinstance(L, SegmentedLagrangian) else None

    @cached_property
    def lagrangians(self) -> list[Lagrangian]:
        """The Lagrangian of every batch."""
        of, first = [self._lagrangian_of(b) for b in self.batches], len(self.interval_batches)
        return of[:first] + [NoCost(L) for L in of[first:]]

    def _lagrangian_of(self, batch: Batch) -> Lagrangian:
        L = self.lagrangian
        if self.segments is None or not isinstance(L, SegmentedLagrangian):
            return L
        return L.lagrangians[int(self.segments[batch.numbers[0]])]
