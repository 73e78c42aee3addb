"""The discrete Lagrangian on groups: L_d on T^(k-1)Q x T^(k-1)Q, one interval at a time, k = 1, 2.

An interval's curve is q(s) = q0 (+) x(s) in the chart centered at its first node, so
L_d = h sum_j w_j L(q0 (+) x_j, J(x_j) x_j', ..) has the left symmetries of L. A step solves

    p0 = -D_1 .. -D_k L_d,   0 = D_c L_d,   p1 = D_{k+1} .. D_2k L_d

for the moments w of x^(k) and the inner modes c, which stay of order one as h tends to zero. The
counterpart of `SchemeLagrangian` on groups. [MarsdenPekarskyShkoller1999]

A point of T^(k-1)Q is a row (q, q', ..) of length nq + (k - 1) nv.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.discrete.interval_charts import IntervalCharts
from hovi.errors import InputError, SchemeError
from hovi.flows.legendre_transforms import jet_at_momenta
from hovi.flows.regularized import Regularized, regularized
from hovi.flows.step_guesses import (
    DOUBTFUL,
    Trial,
    continued_modes,
    hard_step,
    mismatch,
    taylor_modes,
)
from hovi.optimize.batched_newton import System, roots
from hovi.robot.space.chart import Chart
from hovi.robot.space.configuration_space import ConfigurationSpace, bracket
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import Scheme

Array = npt.NDArray[np.float64]

MAX_ROTATION = 3.0
"""Largest rotation of an orientation in one step, in [rad]: less than half a rotation."""


@dataclass(frozen=True, eq=False)
class ChartedSegment:
    """An interval of a discrete motion on a group.

    w: regularized coordinates, shape (1, k, nv). z: gamma w. inner: inner modes, (1, r, nv); all
        in the units of x^(k).
    x1: the end, shape (1, 1, nq + (k - 1) nv). p1: momenta there, shape (1, k, nv).
    """

    w: Array
    z: Array
    inner: Array
    x1: Array
    p1: Array


@dataclass(frozen=True, eq=False)
class ChartedLagrangian:
    """L_d of one interval on a configuration space with groups, for L on TQ or T^(2)Q.

    lagrangian: L, of order 1 or 2. space: Q. scheme: a table of that order. h: the step, in [s].
    Raises InputError for a step that is not positive, SchemeError for other orders.
    """

    lagrangian: Lagrangian
    space: ConfigurationSpace
    scheme: Scheme
    h: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.h) and self.h > 0):
            raise InputError(f"a step must be positive and finite, got {self.h} s.")
        if self.k not in (1, 2) or self.scheme.derivatives != self.k:
            raise SchemeError(
                "flows on groups need a Lagrangian of order 1 or 2 and a scheme of the same "
                f"order, got {self.k} and {self.scheme.derivatives}."
            )

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
        """The transformation between the end in the chart and w."""
        return regularized(self.k, self.h)

    def split(self, x: Array) -> list[Array]:
        """(q, q', ..) of rows x (N, nq + (k - 1) nv)."""
        return np.split(x, [self.space.nq], axis=1)[: self.k]

    def from_start(
        self, x0: Array, p0: Array, t0: float = 0.0, guess: ChartedSegment | None = None
    ) -> ChartedSegment:
        """The segment that starts at a point (1, 1, nq + ..) with momenta (1, k, nv).

        By Newton's method, from the curve of `guess` continued or the exact jet, and where it fails
        from the curve of shorter steps. Raises InputError if there is none, or if it rotates too
        far.
        """
        if guess is None:
            modes = self._taylor(x0, p0, t0)
        else:
            modes = continued_modes(self.k, np.append(guess.w, guess.inner, axis=1))
        trial = self._attempt(self.h, x0, p0, t0, modes[0])
        doubt = mismatch(self.h, self.k, trial.modes[None], modes)[0]
        if trial.end is None or not doubt < DOUBTFUL:
            trial = hard_step(self._attempt, self.h, x0, p0, t0, trial)
        w, inner = trial.modes[None, : self.k], trial.modes[None, self.k :]
        assert trial.end is not None
        return ChartedSegment(w, self.regularized.z(w), inner, *trial.end)

    def _step(self, start: Array, p0: Array, t0: float) -> System:
        """The equations of a step from momenta and their matrix, in the modes."""
        k, n = self.k, self.n
        back = np.kron(self.regularized.back / self.h, np.eye(n))

        def system(u: Array) -> tuple[Array, Array]:
            interval = self._interval(start, u.reshape(1, -1, n))
            p, slack, H = self._expand(interval, start, t0)
            F = np.concatenate([back @ (p[0] - p0[0]).ravel(), self.h * slack.ravel()])
            H[: k * n] = back @ H[: k * n]
            H[k * n :] *= self.h
            return F[None], H[None]

        return system

    def _attempt(self, h: float, x0: Array, p0: Array, t0: float, guess: Array | None) -> Trial:
        """One step of length h, for `hard_step`; from the exact jet where no guess is given."""
        ld = self if h == self.h else dataclasses.replace(self, h=h)
        modes = ld._taylor(x0, p0, t0)[0] if guess is None else guess
        found = roots(ld._step(x0[0], p0, t0), modes.reshape(1, -1))
        modes, residual = found.u.reshape(modes.shape), float(found.residual[0])
        interval = ld._interval(x0[0], modes[None])
        if not (found.found[0] and self._rotation(interval.ends[0, 0]) < MAX_ROTATION):
            return Trial(modes, residual, None)
        p1 = ld._momenta(interval, x0[0], t0)[1]
        return Trial(modes, residual, (ld._end(x0[0], interval)[None], p1))

    def _taylor(self, x0: Array, p0: Array, t0: float) -> Array:
        """Modes of the exact jet at the start, shape (1, k + r, nv)."""
        jet = jet_at_momenta(self.lagrangian, self.split(x0[0]), p0, t0)
        return taylor_modes(self.k, self.k + self.scheme.inner_modes, self.h, *jet)

    def jet(self, q0: Array, w: Array, inner: Array) -> tuple[Array, Array]:
        """(q, v) at the quadrature points of N intervals, for k = 1: (N Q, nq) and (N Q, nv).

        q0: (N, 1, nq). w, inner: (N, 1, nv) and (N, r, nv).
        """
        interval = self._interval(q0[:, 0], np.append(w, inner, axis=1))
        q, v, _ = Chart(self.space).jets_from(q0[:, 0], interval.x)
        return q, v

    @cached_property
    def _scheme(self) -> Scheme:
        """The scheme as a table for k = 2; for k = 1 it ignores the end velocities."""
        if self.k == 2:
            return self.scheme
        first = self.scheme.table  # (Q, 2, 1 + r) over (Z0, c)
        table = np.zeros((len(first), 3, first.shape[2] + 2))
        table[:, :2, 0] = table[:, :2, 1] = first[:, :, 0]  # q1 - q0 = h v0 + Z0
        table[:, :2, 3:] = first[:, :, 1:]
        return dataclasses.replace(self.scheme, table=table)

    @property
    def _used(self) -> npt.NDArray[np.intp]:
        """Which of (q0, h v0, q1, h v1, c) L_d depends on."""
        every = np.arange(4 + self.scheme.inner_modes)
        return every if self.k == 2 else np.delete(every, [1, 3])

    def _interval(self, start: Array, modes: Array) -> IntervalCharts:
        """The charts of N intervals from (w, c), shape (N, k + r, n)."""
        h, k, N = self.h, self.k, len(start)
        scaled = h**k * np.append(self.regularized.z(modes[:, :k]), modes[:, k:], axis=1)
        still = np.zeros((N, 1, self.n))
        hv = h * self.split(start)[1][:, None] if k == 2 else still
        Z = scaled if k == 2 else np.concatenate([scaled[:, :1], still, scaled[:, 1:]], axis=1)
        table = self._scheme.table / h ** np.arange(3.0)[:, None]
        points: Array = np.einsum("qri,nia->rnqa", table, np.append(hv, Z, axis=1))
        ends = hv + Z[:, :2]
        return IntervalCharts(
            Chart(self.space), self._scheme, np.full(N, h), points.reshape(3, -1, self.n), ends
        )

    def _end(self, start: Array, interval: IntervalCharts) -> Array:
        """The end point, shape (1, nq + (k - 1) nv)."""
        x1, hdx1 = np.moveaxis(interval.ends, 1, 0)
        q0 = self.split(start)[0]
        q1, v1, _ = Chart(self.space).jet(q0, x1, hdx1 / self.h, np.zeros_like(x1))
        return np.append(q1, v1, axis=1) if self.k == 2 else q1

    def _jets(self, interval: IntervalCharts, start: Array) -> list[Array]:
        jets = Chart(self.space).jets_from(self.split(start)[0], interval.x)
        return list(jets[: self.k + 1])

    def _times(self, t0: float) -> Array:
        return np.asarray(t0 + self.h * self.scheme.points)

    def _force(self, gradient: Array) -> Array:
        """A gradient at the points, padded with zeros up to order 2, (Q, 3, n)."""
        return np.append(gradient, np.zeros((len(gradient), 2 - self.k, self.n)), axis=1)

    def _momenta(self, interval: IntervalCharts, start: Array, t0: float) -> tuple[Array, Array]:
        """p0 and p1, shape (1, k, n) each."""
        gradient = self.lagrangian.gradient(*self._jets(interval, start), t=self._times(t0))
        return self._ends(interval, self._force(gradient))

    def _ends(self, interval: IntervalCharts, force: Array) -> tuple[Array, Array]:
        ends = interval.end_gradient(force) * np.array([1.0, self.h, 1.0, self.h])[:, None]
        return -ends[:, : self.k], ends[:, 2 : 2 + self.k]

    def _expand(
        self, interval: IntervalCharts, start: Array, t0: float
    ) -> tuple[Array, Array, Array]:
        """p0 (1, k, n), D_c L_d (r, n) and their derivatives with respect to (w, c)."""
        n, k, Q = self.n, self.k, len(self.scheme.weights)
        jets = self._jets(interval, start)
        _, gradient, hessian = self.lagrangian.evaluate(*jets, t=self._times(t0))
        force = self._force(gradient)
        # the "Hessian" with a force is not symmetric: the chart's curvature is added separately
        g, chart_curvature = interval.expand(force, np.zeros((Q, 3 * n, 3 * n)))
        used = self._used
        chart_curvature = chart_curvature[0][np.ix_(used, used)].transpose(0, 2, 1, 3)
        D = self._point_steps(interval)  # (C, Q, (k + 1) n), C columns
        weighted = self.h * self.scheme.weights[:, None] * D
        size = (k + 1) * n
        moved = np.matmul(D.transpose(1, 0, 2), hessian.reshape(Q, size, size).swapaxes(1, 2))
        H = weighted.reshape(len(D), -1) @ moved.transpose(0, 2, 1).reshape(-1, len(D))
        H += chart_curvature.reshape(len(D), len(D))
        H[: k * n] *= -np.repeat([1.0, self.h], n)[: k * n, None]
        H = np.delete(H, np.s_[k * n : 2 * k * n], axis=0)[:, k * n :]  # rows (p0, c)
        H = H @ self._columns(interval)
        return self._ends(interval, force)[0], g[0, 4:], H

    def _columns(self, interval: IntervalCharts) -> Array:
        """d(q1, h v1, h^k c) / d(w, c) in the tangent space, (C, (k + r) n)."""
        n, k, r = self.n, self.k, self.scheme.inner_modes
        columns = self.h**k * np.eye((k + r) * n)
        ends = np.kron(self.regularized.gamma, np.eye(n))
        columns[: k * n, : k * n] = self.h**k * self._end_slopes(interval) @ ends
        return columns

    def _end_slopes(self, interval: IntervalCharts) -> Array:
        """d(q1, h v1) / d(x1, h x1'), for k = 1 without the velocities, (k n, k n).

        h v1 = J(x1) y with y = h x1'. Charts give the sum of the derivatives of J e along y and of
        J y along e; their difference is the bracket.
        """
        n, (x1, y) = self.n, interval.ends[0]
        each, still = np.eye(n), np.zeros((n, n))
        chart, origin = Chart(self.space), np.ones((n, self.space.nq))  # any origin
        _, J, own = chart.jet(origin, still + x1, each, still)
        if self.k == 1:
            return J.T
        _, both, mixed = chart.jet(origin, still + x1, each + y, still)
        v, alone = (both - J)[:1], chart.jet(origin[:1], x1[None], y[None], still[:1])[2]
        slope = 0.5 * (mixed - own - alone + bracket(self.space, still + v, J))
        return np.block([[J.T, still], [slope.T, J.T]])

    def _point_steps(self, interval: IntervalCharts) -> Array:
        """Change of (q, .., q^(k)) at the points in every used column, shape (C, Q, (k + 1) n)."""
        n, m, used = self.n, 4 + self.scheme.inner_modes, self._used
        C = len(used) * n
        step = np.zeros((C, m, n))
        step.reshape(C, -1)[np.arange(C), (used[:, None] * n + np.arange(n)).ravel()] = 1.0
        many = IntervalCharts(
            interval.chart,
            interval.scheme,
            np.full(C, self.h),
            np.tile(interval.x, (1, C, 1)),
            np.repeat(interval.ends, C, axis=0),
        )
        steps = many.point_steps(step)[:, :, : self.k + 1]
        return steps.reshape(C, -1, (self.k + 1) * n)

    def _rotation(self, x1: Array) -> float:
        """The largest rotation of an orientation in one step, in [rad]."""
        rotations = [x1[f.v][list(f.group.angular)] for f in self.space.curved]
        return max((float(np.linalg.norm(rotation)) for rotation in rotations), default=0.0)
