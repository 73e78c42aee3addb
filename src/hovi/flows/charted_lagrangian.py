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
from collections.abc import Iterator
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments, unchecked
from hovi.checks.shapes import require_shape
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.errors import InputError, SchemeError
from hovi.flows.charted_equations import ChartedEquations, root_of
from hovi.flows.charted_interval import ChartedInterval, NodalExpansion, joined
from hovi.flows.interval import IntervalLagrangian
from hovi.flows.legendre_transforms import jet_at_momenta
from hovi.flows.scheme_lagrangian import check_step, uniform_grid
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
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import Scheme
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

MAX_ROTATION = 3.0
"""Largest rotation of an orientation in one step, in [rad]: less than half a rotation."""


@check_arguments
@dataclass(frozen=True, eq=False)
class ChartedLagrangian(IntervalLagrangian):
    """L_d of one interval on a configuration space with groups, for L on TQ or T^(2)Q.

    lagrangian: L, of order 1 or 2. space: Q. scheme: a table of that order. h: the step, in [s].
    Raises InputError for a step that is not positive, SchemeError for other orders.
    """

    lagrangian: Lagrangian
    space: ConfigurationSpace
    scheme: Scheme
    h: float

    def __post_init__(self) -> None:
        check_step(self.h)
        if self.k not in (1, 2) or self.scheme.derivatives != self.k:
            raise SchemeError(
                "flows on groups need a Lagrangian of order 1 or 2 and a scheme of the same "
                f"order, got {self.k} and {self.scheme.derivatives}."
            )

    @classmethod
    def of(cls, ld: DiscreteLagrangian) -> ChartedLagrangian:
        """The L_d of the intervals of a uniform grid. Raises InputError on a vector space."""
        space = ld.lagrangian.space
        if space is None:
            raise InputError("on a vector space L_d is hovi.SchemeLagrangian.of(ld).")
        return cls(ld.lagrangian, space, *uniform_grid(ld))

    @cached_property
    def interval(self) -> ChartedEquations:
        """The interval as a function of its start and its modes."""
        return ChartedEquations(self.lagrangian, self.space, self.scheme, self.h)

    def split(self, x: Array) -> list[Array]:
        """(q, q', ..) of rows x (N, nq + (k - 1) nv)."""
        return self.interval.split(x)

    @property
    def on_group(self) -> bool:
        """True."""
        return True

    def from_start(
        self, x0: Array, p0: Array, t0: float = 0.0, guess: ChartedInterval | None = None
    ) -> ChartedInterval:
        """The intervals that start at points (B, 1, nq + ..) with momenta (B, k, nv).

        By Newton's method, from the curve of `guess` continued or the exact jet, and where it fails
        from the curve of shorter steps. Raises InputError if there is none, or if it rotates too
        far.
        """
        self._require(x0, p0)
        if len(x0) > 1:
            return joined([self.from_start(x, p, t0) for x, p in _pairs(x0, p0)])
        if guess is None:
            modes = self._taylor(x0, p0, t0)
        else:
            modes = continued_modes(self.k, np.append(guess.w, guess.inner, axis=1))
        trial = self._attempt(self.h, x0, p0, t0, modes[0])
        doubt = mismatch(self.h, self.k, trial.modes[None], modes)[0]
        if trial.end is None or not doubt < DOUBTFUL:
            trial = hard_step(self._attempt, self.h, x0, p0, t0, trial)
        assert trial.end is not None
        return self._interval(x0, trial.modes, *trial.end, t0)

    def from_end(self, x1: Array, p1: Array, t0: float = 0.0) -> ChartedInterval:
        """The intervals that end at points (B, 1, nq + ..) with momenta (B, k, nv): (F^+)^-1.

        By Newton's method from the exact jet. Raises InputError if there is none.
        """
        self._require(x1, p1)
        if len(x1) > 1:
            return joined([self.from_end(x, p, t0) for x, p in _pairs(x1, p1)])
        k, n, h = self.k, self.n, self.h
        given = np.kron((self.regularized.moments / h).T, np.eye(n))

        def system(u: Array) -> tuple[Array, Array]:
            start, interval = self.interval.ending_at(x1[0], u.reshape(1, -1, n))
            _, p, slack, H = self.interval.nodal(interval, start, t0)
            F = np.concatenate([given @ (p[0] - p1[0]).ravel(), h * slack.ravel()])
            H[k * n : 2 * k * n] *= np.repeat([1.0, h], n)[: k * n, None]
            moved = np.delete(H, np.s_[: k * n], axis=0)  # rows (p1, c)
            J = moved[:, 2 * k * n :] * h**k
            J = np.append(moved[:, : k * n] @ self.interval.start_slopes(interval), J, axis=1)
            return F[None], np.append(given @ J[: k * n], h * J[k * n :], axis=0)[None]

        jet = jet_at_momenta(self.lagrangian, self.split(x1[0]), p1, t0 + h)
        guess = taylor_modes(k, k + self.scheme.inner_modes, h, *jet, 1.0)
        u = root_of(system, guess.reshape(1, -1), self.h)
        modes = u.reshape(guess.shape)
        start, interval = self.interval.ending_at(x1[0], modes)
        p = self.interval.momenta(interval, start, t0)[1]
        return self._interval(start[None], modes[0], x1, p, t0)

    def joining(self, x0: Array, x1: Array, t0: float = 0.0) -> ChartedInterval:
        """The intervals between two points of T^(k-1)Q, (B, 1, nq + ..) each.

        With the smallest rotation. Raises InputError if Newton's method fails.
        """
        self._require(x0, x1=x1)
        if len(x0) > 1:
            return joined([self.joining(x, y, t0) for x, y in _pairs(x0, x1)])
        start, end = self.split(x0[0]), self.split(x1[0])
        x = self.space.difference(start[0], end[0])[None]  # (1, 1, n)
        z = x / self.h
        if self.k == 2:
            v0, dx = start[1], Chart(self.space).rates(x[0], end[1])[0]
            z = np.stack([(z[0] - v0) / self.h, (dx - v0) / self.h], axis=1)
        return self.between(x0, self.regularized.w_of_z(z), t0)

    def between(self, x0: Array, w: Array, t0: float = 0.0) -> ChartedInterval:
        """The intervals with regularized ends w (B, k, nv), by Newton's method for the modes."""
        self._require(x0, w)
        if len(x0) > 1:
            return joined([self.between(x, y, t0) for x, y in _pairs(x0, w)])
        k, n, r, start = self.k, self.n, self.scheme.inner_modes, x0[0]

        def curve(u: Array) -> Array:
            return np.append(w, u.reshape(1, r, n), axis=1)

        def system(u: Array) -> tuple[Array, Array]:
            _, _, slack, H = self.interval.nodal(self.interval.charts(start, curve(u)), start, t0)
            own = H[2 * k * n :, 2 * k * n :]
            return slack.reshape(1, -1), self.h**k * own[None]

        u = np.zeros((1, r * n))
        modes = curve(root_of(system, u, self.h) if r else u)
        interval = self.interval.charts(start, modes)
        p1 = self.interval.momenta(interval, start, t0)[1]
        return self._interval(x0, modes[0], self.interval.end(start, interval)[None], p1, t0)

    def _interval(
        self, x0: Array, modes: Array, x1: Array, p1: Array, t0: float
    ) -> ChartedInterval:
        w, inner = modes[None, : self.k], modes[None, self.k :]
        z = self.regularized.z(w)

        def expand() -> NodalExpansion:
            interval = self.interval.charts(x0[0], modes[None])
            p0, _, _, H = self.interval.nodal(interval, x0[0], t0)
            m = 2 * self.k + len(inner[0])
            blocks = H.reshape(m, self.n, m, self.n).transpose(0, 2, 1, 3)[None]
            jets, t = self.interval.jets(interval, x0[0]), self.interval.times(t0)
            value, slopes, _ = self.lagrangian.evaluate(*jets, t=t)
            work = [j * np.vecdot(slopes[:, j], x) for j, x in enumerate(jets) if j]
            weights, own = self.scheme.weights[None], value - np.sum(work, axis=0)
            return NodalExpansion(self.h * weights @ value, p0, blocks, weights @ own)

        return ChartedInterval(self.space, self.h, x0, w, z, inner, x1, p1, expand)

    @unchecked
    def _require(self, x: Array, p: Array | None = None, x1: Array | None = None) -> None:
        """Raise InputError unless arrays are points (B, 1, nq + ..) and momenta (B, k, n)."""
        size = self.space.nq + (self.k - 1) * self.n
        require_shape("x", x, None, 1, size)
        if len(x) == 0:
            raise InputError("points must have one row or more, got none.")
        if p is not None:
            require_shape("p", p, len(x), self.k, self.n)
        if x1 is not None:
            require_shape("x1", x1, len(x), 1, size)

    def _step(self, start: Array, p0: Array, t0: float) -> System:
        """The equations of a step from momenta and their matrix, in the modes."""
        k, n = self.k, self.n
        back = np.kron(self.regularized.back / self.h, np.eye(n))

        def system(u: Array) -> tuple[Array, Array]:
            interval = self.interval.charts(start, u.reshape(1, -1, n))
            p, slack, H = self.interval.expand(interval, start, t0)
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
        interval = ld.interval.charts(x0[0], modes[None])
        if not (found.found[0] and self._rotation(interval.ends[0, 0]) < MAX_ROTATION):
            return Trial(modes, residual, None)
        p1 = ld.interval.momenta(interval, x0[0], t0)[1]
        return Trial(modes, residual, (ld.interval.end(x0[0], interval)[None], p1))

    def _taylor(self, x0: Array, p0: Array, t0: float) -> Array:
        """Modes of the exact jet at the start, shape (1, k + r, nv)."""
        jet = jet_at_momenta(self.lagrangian, self.split(x0[0]), p0, t0)
        return taylor_modes(self.k, self.k + self.scheme.inner_modes, self.h, *jet)

    def jet(self, q0: Array, w: Array, inner: Array) -> tuple[Array, Array]:
        """(q, v) at the quadrature points of N intervals, for k = 1: (N Q, nq) and (N Q, nv).

        q0: (N, 1, nq). w, inner: (N, 1, nv) and (N, r, nv).
        """
        interval = self.interval.charts(q0[:, 0], np.append(w, inner, axis=1))
        q, v, _ = Chart(self.space).jets_from(q0[:, 0], interval.x)
        return q, v

    def _rotation(self, x1: Array) -> float:
        """The largest rotation of an orientation in one step, in [rad]."""
        rotations = [x1[f.v][list(f.group.angular)] for f in self.space.curved]
        return max((float(np.linalg.norm(rotation)) for rotation in rotations), default=0.0)


def _pairs(x: Array, y: Array) -> Iterator[tuple[Array, Array]]:
    """The rows of two arrays as batches of one."""
    for i in range(len(x)):
        yield x[i : i + 1], y[i : i + 1]
