"""The discrete flow: initial value problems in momentum form.

A step solves p0 = -D_1 L_d(x0, x1), ... for the regularized coordinates w of the interval, which
is well conditioned as h tends to zero, and adds the increments

    x1 = x0 + (T - 1) x0 + S gamma w,      p1 = p0 + (T^-T - 1) p0 + h T^-T dphi/dx0,

by compensated summation. [ColomboFerraroMartin2016, section 2 and corollary to theorem 2]
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.checks.shapes import numbers_of
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.flows.charted_interval import ChartedInterval
from hovi.flows.charted_lagrangian import ChartedLagrangian
from hovi.flows.interval import Interval, IntervalLagrangian
from hovi.flows.legendre_transforms import (
    coordinates_in_words,
    hamiltonian,
    kernel_coordinates,
    require_regular_lagrangian,
)
from hovi.flows.scheme_lagrangian import SchemeLagrangian, uniform_grid
from hovi.flows.symmetry import Symmetry
from hovi.scene.scene import Scene
from hovi.schemes import require_regular
from hovi.schemes.galerkin_table import MAX_INNER_MODES
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, eq=False)
class Flow:
    """A discrete motion from initial momenta.

    ld: the discrete Lagrangian. t: times of the nodes, shape (N + 1,), in [s].
    x: (q, q', ..., q^(k-1)) at the nodes, shape (N + 1, k, n); on groups in one row,
        (N + 1, 1, nq + (k - 1) nv).
    p: momenta, shape (N + 1, k, n).
    z: regularized coordinates of the intervals, shape (N, k, n).
    inner: inner modes, (N, r, n).
    rounding: the error of q by amplified rounding of the start, shape (N + 1,); None with `force`.
    symmetries: by name, for `momentum_maps`.
    """

    ld: IntervalLagrangian
    t: Array
    x: Array
    p: Array
    z: Array
    inner: Array
    rounding: Array | None = None
    symmetries: Mapping[str, Symmetry] = field(default_factory=dict)

    @property
    def q(self) -> Array:
        """Configurations at the nodes, shape (N + 1, nq)."""
        return self.jets[0]

    @property
    def jets(self) -> list[Array]:
        """q, q', ..., q^(k-1) at the nodes, k arrays (N + 1, nq) or (N + 1, n)."""
        if self.ld.on_group:
            return _rows_apart(self.ld, self.x[:, 0])
        return list(np.moveaxis(self.x, 1, 0))

    @property
    def energy(self) -> Array:
        """H = sum_j p_j . q^(j+1) - L at the nodes, shape (N + 1,)."""
        return hamiltonian(self.ld.lagrangian, self.jets, self.p)

    @property
    def momentum_maps(self) -> dict[str, Array]:
        """J of every symmetry at the nodes, each of shape (N + 1,)."""
        return {name: s.momentum(self.x, self.p) for name, s in self.symmetries.items()}

    @property
    def reevaluated_momenta(self) -> tuple[Array, Array]:
        """-D_1 .. -D_k and D_{k+1} .. D_2k of L_d from the stored x, z and inner modes.

        Shape (N, k, n) each: F^- and F^+ of the intervals, to compare with the propagated p.
        """
        if not isinstance(self.ld, SchemeLagrangian):
            raise InputError("only the L_d of a scheme can be evaluated from its inner modes.")
        w = self.ld.regularized.w_of_z(self.z)
        interval = self.ld.at(self.x[:-1], w, self.inner)
        return interval.p0, interval.p1

    @property
    def trajectory(self) -> Trajectory:
        """The motion as a Trajectory, for the effort Lagrangian of a scene."""
        lagrangian, ld = self.ld.lagrangian, self.ld
        scene = getattr(lagrangian, "scene", None)
        if not isinstance(scene, Scene) or not isinstance(ld, SchemeLagrangian | ChartedLagrangian):
            raise InputError("only the flow of a scene's effort Lagrangian has a Trajectory.")
        q, v = self.jets
        path = DiscretePath(q.copy(), v.copy(), self.z, self.inner)
        N = len(self.z)
        grid = Grid(np.full(N, ld.h), (ld.scheme,) * N)
        return Trajectory(grid, path, self.p, scene, {"status": "flow"})


@check_arguments
def flow(
    ld: DiscreteLagrangian | IntervalLagrangian,
    z0: State | npt.ArrayLike,
    p0: npt.ArrayLike,
    steps: int,
    *,
    t0: float = 0.0,
    force: bool = False,
    tolerance: float = 1e-6,
    symmetries: Mapping[str, Symmetry] | None = None,
) -> Flow:
    """The discrete Hamiltonian flow (x0, p0) -> (x1, p1) -> ..., F^+ o (F^-)^-1 repeated.

    ld: a discrete Lagrangian on a uniform grid, or that of one interval.
    z0: start in T^(k-1)Q: a State for k = 2, or (q, q', ..., q^(k-1)) of shape (k, n); on groups
        one row of length nq + (k - 1) nv.
    p0: momenta, shape (k, n): (p, p~) for k = 2. `legendre` computes both from (q, v, a, jerk).
    steps: number of steps. t0: initial time, in [s].
    force: continue where the instability of the flow has amplified rounding of the start to an
        error in q above `tolerance` (relative to max(|q|, 1)); otherwise InputError states the time
        up to which the motion is accurate. Optimal control is unstable in both directions of time.
        Motions on groups are not monitored.
    symmetries: by name, whose momentum maps are wanted along the motion.
    Raises InputError also for wrong shapes, steps without a solution, and a Lagrangian that is
    singular in q^(k) at the start (passive joints, costs of a curve's shape alone), SchemeError for
    a scheme that is not regular.
    """
    single = _of_one_interval(ld) if isinstance(ld, DiscreteLagrangian) else ld
    if isinstance(single, SchemeLagrangian | ChartedLagrangian) and single.k == 2:
        require_regular(single.scheme)
    x, p = _start(single, z0, p0)
    if steps < 1:
        raise InputError(f"the number of steps must be 1 or more, got {steps}.")
    require_regular_lagrangian(single.lagrangian, _jet(single, x), p[None], t0)
    stepper = _stepper(single, x, p, t0)
    monitor = None
    if not force and not single.on_group:
        monitor = _RoundingMonitor(single, x, p, tolerance)
    records = _allocate(single, x, p, steps)
    for i in range(steps):
        done = stepper.step()
        if i == 0 and isinstance(done, Interval):
            _require_regular_step(single, done)
        records[0][i + 1], records[1][i + 1] = stepper.x, stepper.p
        records[2][i], records[3][i, : done.inner.shape[1]] = done.z[0], done.inner[0]
        if monitor is not None and isinstance(done, Interval):
            monitor.propagate(done, stepper.x, (i + 1) * single.h)
    t = np.asarray(t0 + np.arange(steps + 1) * single.h)
    rounding = None if monitor is None else np.array(monitor.errors)
    return Flow(single, t, *records, rounding, symmetries or {})


def _of_one_interval(ld: DiscreteLagrangian) -> SchemeLagrangian | ChartedLagrangian:
    space, (scheme, h) = ld.lagrangian.space, uniform_grid(ld)
    if space is None:
        return SchemeLagrangian(ld.lagrangian, scheme, h)
    return ChartedLagrangian(ld.lagrangian, space, scheme, h)


def _stepper(ld: IntervalLagrangian, x: Array, p: Array, t0: float) -> _Stepper | _ChartedStepper:
    if ld.on_group:
        return _ChartedStepper(ld, x, p, t0)
    return _Stepper(ld, x, p, t0)


class _ChartedStepper:
    """The state of a flow on groups."""

    def __init__(self, ld: IntervalLagrangian, x: Array, p: Array, t0: float) -> None:
        self.ld, self.x, self.p, self.t0 = ld, x, p, t0
        self._interval: ChartedInterval | None = None
        self._steps = 0

    def step(self) -> ChartedInterval:
        """One step: F^+ o (F^-)^-1."""
        t = self.t0 + self._steps * self.ld.h
        try:
            interval = self.ld.from_start(self.x[None], self.p[None], t, self._interval)
        except InputError as failure:
            raise _ended(t, self._steps + 1, failure) from failure
        assert isinstance(interval, ChartedInterval)
        self.x, self.p, self._interval = interval.x1[0], interval.p1[0], interval
        self._steps += 1
        return interval


class _Stepper:
    """The state of a flow, with the remainders of its compensated sums."""

    def __init__(self, ld: IntervalLagrangian, x: Array, p: Array, t0: float) -> None:
        R = ld.regularized
        self.ld, self.x, self.p, self.t0 = ld, x, p, t0
        self._remainder = np.zeros((2, *x.shape))
        self._taylor = R.taylor - np.eye(ld.k)
        self._moments = R.moments
        self._momentum_taylor = R.inverse_taylor.T - np.eye(ld.k)
        self._kick = ld.h * R.inverse_taylor.T
        self._interval: Interval | None = None
        self._steps = 0

    def step(self) -> Interval:
        """One step: F^+ o (F^-)^-1."""
        t = self.t0 + self._steps * self.ld.h
        try:
            interval = self.ld.from_start(self.x[None], self.p[None], t, self._interval)
        except InputError as failure:
            raise _ended(t, self._steps + 1, failure) from failure
        assert isinstance(interval, Interval)
        dx = self._taylor @ self.x + self._moments @ interval.w[0]
        dp = self._momentum_taylor @ self.p + self._kick @ interval.gradient[0, : self.ld.k]
        self.x, self._remainder[0] = compensated(self.x, dx, self._remainder[0])
        self.p, self._remainder[1] = compensated(self.p, dp, self._remainder[1])
        self._interval = interval
        self._steps += 1
        return interval


def _ended(t: float, step: int, failure: InputError) -> InputError:
    return InputError(f"the flow ends at t = {t:.6g} s, in step {step}: {failure}")


class _RoundingMonitor:
    """Propagates rounding errors of the start by the tangent maps of the steps."""

    def __init__(self, ld: IntervalLagrangian, x: Array, p: Array, tolerance: float) -> None:
        sizes = np.concatenate([np.abs(x).max(axis=1), np.abs(p).max(axis=1)])
        sizes[0] = max(1.0, sizes[0])
        self._tangent = np.diag(EPS * np.repeat(sizes, ld.n))
        self._n, self._tolerance, self._size = ld.n, tolerance, sizes[0]
        self.errors = [EPS * float(sizes[0])]

    def propagate(self, interval: Interval, x: Array, t: float) -> None:
        """Propagate by one step. Raises InputError if the error exceeds the tolerance."""
        self._tangent = interval.tangent[0] @ self._tangent
        self._size = max(self._size, float(np.abs(x[0]).max()))
        self.errors.append(float(np.linalg.norm(self._tangent[: self._n], 2)))
        if not self.errors[-1] <= self._tolerance * self._size:
            raise InputError(
                f"the flow is so unstable that after {t:.4g} s rounding of its start alone changes "
                f"q by {self.errors[-1]:.1g}, more than tolerance {self._tolerance:g}: use a "
                "shorter horizon, a boundary value problem instead, or force=True."
            )


def compensated(sum_: Array, increment: Array, remainder: Array) -> tuple[Array, Array]:
    """Kahan's summation: sum + increment, and the remainder of the new sum. [Kahan1965]"""
    increment = increment - remainder
    total = sum_ + increment
    return total, (total - sum_) - increment


def _start(
    ld: IntervalLagrangian, z0: State | npt.ArrayLike, p0: npt.ArrayLike
) -> tuple[Array, Array]:
    """x and p as arrays (k, n). Raises InputError for wrong shapes."""
    if isinstance(z0, State):
        v = np.zeros(ld.n) if z0.v is None else z0.v
        rows = [np.asarray(z0.q, float), np.asarray(v, float)][: ld.k]
        z0 = np.concatenate(rows)[None] if ld.on_group else np.stack(rows)
    x, p = numbers_of("z0", z0), numbers_of("p0", p0)
    shape = (ld.k, ld.n)
    if ld.on_group:
        shape = (1, ld.lagrangian.nq + (ld.k - 1) * ld.n)
    for name, array, expected in (("z0", x, shape), ("p0", p, (ld.k, ld.n))):
        if array.shape != expected or not np.isfinite(array).all():
            raise InputError(
                f"{name} needs {expected[0]} rows of {expected[1]} finite numbers, got shape "
                f"{array.shape}."
            )
    return x, p


def _jet(ld: IntervalLagrangian, x: Array) -> list[Array]:
    """(q, q', ..., q^(k-1)) of one point, k arrays of one row."""
    return _rows_apart(ld, x) if ld.on_group else list(x[:, None])


def _rows_apart(ld: IntervalLagrangian, x: Array) -> list[Array]:
    """(q, q', ..) of points on a group, (N, nq + (k - 1) nv)."""
    return np.split(x, [ld.lagrangian.nq], axis=1)[: ld.k]


def _require_regular_step(ld: IntervalLagrangian, interval: Interval) -> None:
    """Raise InputError where the discrete Lagrangian is singular: W_d, and a step's equations."""
    own, carried = interval.newton_terms
    kernel = kernel_coordinates((own - carried)[0], ld.n, (np.abs(own) + np.abs(carried))[0])
    if len(kernel):
        raise InputError(
            f"the discrete Lagrangian is singular at the start with h = {ld.h:g} s, where momenta "
            f"do not determine the step of {coordinates_in_words(ld.lagrangian, kernel)}: take "
            "another step, best a shorter one."
        )


def _allocate(
    ld: IntervalLagrangian, x: Array, p: Array, steps: int
) -> tuple[Array, Array, Array, Array]:
    """Arrays for x, p, z and inner modes of all steps, with the start filled in."""
    # an exact L_d may use the maximum number of inner modes
    modes = MAX_INNER_MODES
    if isinstance(ld, SchemeLagrangian | ChartedLagrangian):
        modes = ld.scheme.inner_modes
    nodes, momenta = np.empty((steps + 1, *x.shape)), np.empty((steps + 1, *p.shape))
    nodes[0], momenta[0] = x, p
    return nodes, momenta, np.empty((steps, *p.shape)), np.zeros((steps, modes, ld.n))
