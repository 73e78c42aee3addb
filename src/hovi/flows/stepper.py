"""The discrete flow: initial value problems, stepped in momentum form.

One step solves p0 = -D_1 L_d(x0, x1), ... for the regularized coordinates w of the interval, whose
equations stay well conditioned as h tends to zero, and moves on by increments,

    x1 = x0 + (T - 1) x0 + S gamma w,      p1 = p0 + (T^-T - 1) p0 + h T^-T dphi/dx0,

summed with compensation. [ColomboFerraroMartin2016, section 2 and corollary to theorem 2]
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.flows.group_lagrangian import ChartedLagrangian, ChartedSegment
from hovi.flows.legendre_transforms import hamiltonian
from hovi.flows.scheme_lagrangian import SchemeLagrangian, SegmentLagrangian, uniform_grid
from hovi.flows.segment import Segment
from hovi.flows.symmetry import Symmetry
from hovi.scene.scene import Scene
from hovi.schemes import require_regular
from hovi.schemes.galerkin_table import MAX_INNER_MODES

Array = npt.NDArray[np.float64]
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, eq=False)
class Flow:
    """A discrete motion from momenta.

    ld: the discrete Lagrangian. t: times of the nodes, shape (N + 1,), in [s].
    x: (q, q', ..., q^(k-1)) at the nodes, shape (N + 1, k, n); on groups in one row,
        (N + 1, 1, nq + (k - 1) nv).
    p: momenta, shape (N + 1, k, n).
    z: regularized coordinates of the intervals, shape (N, k, n).
    inner: inner modes, (N, r, n).
    rounding: what rounding of the start has grown to in q, shape (N + 1,); None when `force`d.
    symmetries: of which the momentum maps are wanted, by name.
    """

    ld: SegmentLagrangian | ChartedLagrangian
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
        if isinstance(self.ld, ChartedLagrangian):
            return self.ld.split(self.x[:, 0])
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

        Shape (N, k, n) each: what F^- and F^+ make of the intervals, beside the carried p.
        """
        if not isinstance(self.ld, SchemeLagrangian):
            raise InputError("only the L_d of a scheme is evaluated again from its inner modes.")
        w = self.ld.regularized.w_of_z(self.z)
        segment = self.ld.at(self.x[:-1], w, self.inner)
        return segment.p0, segment.p1

    @property
    def trajectory(self) -> Trajectory:
        """The motion of a scene's effort Lagrangian as a Trajectory, to be replayed and saved."""
        lagrangian, ld = self.ld.lagrangian, self.ld
        scene = getattr(lagrangian, "scene", None)
        if not isinstance(scene, Scene) or not isinstance(ld, SchemeLagrangian | ChartedLagrangian):
            raise InputError("only the flow of a scene's effort Lagrangian is a Trajectory.")
        q, v = self.jets
        path = DiscretePath(q.copy(), v.copy(), self.z, self.inner)
        N = len(self.z)
        grid = Grid(np.full(N, ld.h), (ld.scheme,) * N)
        return Trajectory(grid, path, self.p, scene, {"status": "flow"})


def flow(
    ld: DiscreteLagrangian | SegmentLagrangian | ChartedLagrangian,
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
        one row of nq + (k - 1) nv numbers.
    p0: momenta, shape (k, n): (p, p~) for k = 2. `legendre` gives both from (q, v, a, jerk).
    steps: how many. t0: time of the start, in [s].
    force: go on where the flow's own instability has made of the rounding of the start an error in
        q above `tolerance` (relative to the largest |q|, at least one); otherwise InputError says
        how far the motion can be known. Optimal control is unstable both ways in time. Motions
        on groups are not watched.
    Raises InputError also for shapes that do not fit and steps that have no solution, SchemeError
    for a scheme that is not regular.
    """
    segment = _segment(ld) if isinstance(ld, DiscreteLagrangian) else ld
    if isinstance(segment, SchemeLagrangian | ChartedLagrangian) and segment.k == 2:
        require_regular(segment.scheme)
    if symmetries and isinstance(segment, ChartedLagrangian):
        raise InputError("momentum maps are of joints whose configurations are vectors (nq = nv).")
    x, p = _start(segment, z0, p0)
    if steps < 1:
        raise InputError(f"the number of steps must be 1 or more, got {steps}.")
    stepper = _stepper(segment, x, p, t0)
    watch = None
    if not force and not isinstance(segment, ChartedLagrangian):
        watch = _Watch(segment, x, p, tolerance)
    records = _records(segment, x, p, steps)
    for i in range(steps):
        done = stepper.step()
        records[0][i + 1], records[1][i + 1] = stepper.x, stepper.p
        records[2][i], records[3][i, : done.inner.shape[1]] = done.z[0], done.inner[0]
        if watch is not None and isinstance(done, Segment):
            watch.follow(done, stepper.x, (i + 1) * segment.h)
    t = np.asarray(t0 + np.arange(steps + 1) * segment.h)
    rounding = None if watch is None else np.array(watch.errors)
    return Flow(segment, t, *records, rounding, symmetries or {})


def _segment(ld: DiscreteLagrangian) -> SchemeLagrangian | ChartedLagrangian:
    space, (scheme, h) = ld.lagrangian.space, uniform_grid(ld)
    if space is None:
        return SchemeLagrangian(ld.lagrangian, scheme, h)
    return ChartedLagrangian(ld.lagrangian, space, scheme, h)


def _stepper(
    ld: SegmentLagrangian | ChartedLagrangian, x: Array, p: Array, t0: float
) -> _Stepper | _ChartedStepper:
    if isinstance(ld, ChartedLagrangian):
        return _ChartedStepper(ld, x, p, t0)
    return _Stepper(ld, x, p, t0)


class _ChartedStepper:
    """The state of a flow on groups, whose configurations are no sums."""

    def __init__(self, ld: ChartedLagrangian, x: Array, p: Array, t0: float) -> None:
        self.ld, self.x, self.p, self.t0 = ld, x, p, t0
        self._segment: ChartedSegment | None = None
        self._steps = 0

    def step(self) -> ChartedSegment:
        """One step: F^+ o (F^-)^-1."""
        t = self.t0 + self._steps * self.ld.h
        try:
            segment = self.ld.from_start(self.x[None], self.p[None], t, self._segment)
        except InputError as lost:
            raise InputError(f"the flow ends at t = {t:.6g} s: {lost}") from lost
        self.x, self.p, self._segment = segment.x1[0], segment.p1[0], segment
        self._steps += 1
        return segment


class _Stepper:
    """The state of a flow, with what its sums have lost."""

    def __init__(self, ld: SegmentLagrangian, x: Array, p: Array, t0: float) -> None:
        R = ld.regularized
        self.ld, self.x, self.p, self.t0 = ld, x, p, t0
        self._lost = np.zeros((2, *x.shape))
        self._taylor = R.taylor - np.eye(ld.k)
        self._moments = R.moments
        self._back = R.inverse_taylor.T - np.eye(ld.k)
        self._kick = ld.h * R.inverse_taylor.T
        self._segment: Segment | None = None
        self._steps = 0

    def step(self) -> Segment:
        """One step: F^+ o (F^-)^-1."""
        t = self.t0 + self._steps * self.ld.h
        try:
            segment = self.ld.from_start(self.x[None], self.p[None], t, self._segment)
        except InputError as lost:
            raise InputError(f"the flow ends at t = {t:.6g} s: {lost}") from lost
        dx = self._taylor @ self.x + self._moments @ segment.w[0]
        dp = self._back @ self.p + self._kick @ segment.gradient[0, : self.ld.k]
        self.x, self._lost[0] = compensated(self.x, dx, self._lost[0])
        self.p, self._lost[1] = compensated(self.p, dp, self._lost[1])
        self._segment = segment
        self._steps += 1
        return segment


class _Watch:
    """Follows what the rounding of the start becomes, by the tangent maps of the steps."""

    def __init__(self, ld: SegmentLagrangian, x: Array, p: Array, tolerance: float) -> None:
        sizes = np.concatenate([np.abs(x).max(axis=1), np.abs(p).max(axis=1)])
        sizes[0] = max(1.0, sizes[0])
        self._tangent = np.diag(EPS * np.repeat(sizes, ld.n))
        self._n, self._tolerance, self._size = ld.n, tolerance, sizes[0]
        self.errors = [EPS * float(sizes[0])]

    def follow(self, segment: Segment, x: Array, t: float) -> None:
        """One more step. Raises InputError where the error passes the tolerance."""
        self._tangent = segment.tangent[0] @ self._tangent
        self._size = max(self._size, float(np.abs(x[0]).max()))
        self.errors.append(float(np.linalg.norm(self._tangent[: self._n], 2)))
        if not self.errors[-1] <= self._tolerance * self._size:
            raise InputError(
                f"the flow is so unstable that after {t:.4g} s the rounding of its start alone "
                f"moves q by {self.errors[-1]:.1g}, more than tolerance {self._tolerance:g}: take "
                "a shorter horizon, a boundary value problem instead, or force=True."
            )


def compensated(sum_: Array, increment: Array, lost: Array) -> tuple[Array, Array]:
    """Kahan's summation: sum + increment, and what the new sum has lost. [Kahan1965]"""
    increment = increment - lost
    total = sum_ + increment
    return total, (total - sum_) - increment


def _start(
    ld: SegmentLagrangian | ChartedLagrangian, z0: State | npt.ArrayLike, p0: npt.ArrayLike
) -> tuple[Array, Array]:
    """x and p as arrays (k, n). Raises InputError where they do not fit."""
    if isinstance(z0, State):
        v = np.zeros(ld.n) if z0.v is None else z0.v
        rows = [np.asarray(z0.q, float), np.asarray(v, float)][: ld.k]
        z0 = np.concatenate(rows)[None] if isinstance(ld, ChartedLagrangian) else np.stack(rows)
    x, p = np.array(z0, dtype=np.float64), np.array(p0, dtype=np.float64)
    shape = (ld.k, ld.n)
    if isinstance(ld, ChartedLagrangian):
        shape = (1, ld.space.nq + (ld.k - 1) * ld.n)
    for name, array, expected in (("z0", x, shape), ("p0", p, (ld.k, ld.n))):
        if array.shape != expected or not np.isfinite(array).all():
            raise InputError(
                f"{name} needs {expected[0]} rows of {expected[1]} finite numbers, got shape "
                f"{array.shape}."
            )
    return x, p


def _records(
    ld: SegmentLagrangian | ChartedLagrangian, x: Array, p: Array, steps: int
) -> tuple[Array, Array, Array, Array]:
    """Room for x, p, z and inner modes of all steps, the start filled in."""
    # an exact L_d may need as many inner modes as there are
    modes = MAX_INNER_MODES
    if isinstance(ld, SchemeLagrangian | ChartedLagrangian):
        modes = ld.scheme.inner_modes
    nodes, momenta = np.empty((steps + 1, *x.shape)), np.empty((steps + 1, *p.shape))
    nodes[0], momenta[0] = x, p
    return nodes, momenta, np.empty((steps, *p.shape)), np.zeros((steps, modes, ld.n))
