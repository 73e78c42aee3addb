"""Initial guesses: curves between the boundary data, and their discretization on a grid."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.interval_paths import misfit
from hovi.discrete.trajectory import Trajectory
from hovi.errors import ChartError, InputError, nearest
from hovi.robot.space.coordinates import Coordinates
from hovi.schemes.interval_curve import jet_rows
from hovi.schemes.polynomials import interval_rows
from hovi.schemes.scheme import regular_from_nodal

Array = npt.NDArray[np.float64]
Ends = Sequence[Array]
"""(q, q', ..., q^(k-1)) at the start and at the goal: k arrays of two rows, (2, nq) and (2, nv)."""

MISFIT_TOLERANCE = 1e-6
"""Largest difference, relative to q, between the z of a given path and that of its q and v."""
ROTATION_POINTS = 8
"""Number of Gauss points by which rotations within an interval are integrated."""
MAX_ROTATION = 0.9 * np.pi
"""Largest rotation of an orientation within an interval of a guess, in [rad]."""
BUMP_MODES = 8
"""Number of terms of a random bump."""
BUMP_AMPLITUDES = (0.2, 1.5)
"""Range of the amplitude of a random bump, in [rad] or [m]."""


class Curve(Protocol):
    """q, v and a at times t of shape (M,), as arrays of shape (M, n); for order k up to q^(k)."""

    def __call__(self, t: Array) -> tuple[Array, ...]:
        """The curve at t."""


def cubic(coordinates: Coordinates, ends: Ends, duration: float) -> Curve:
    """The cubic through both ends, x(t) of q0 (+) x: the minimizer of 1/2 |x''|^2.

    ends: (q, v) at both. duration: T, in [s].
    """
    (q0, q1), (v0, v1) = ends
    T = duration
    x1 = coordinates.difference(q0, q1)
    dx1 = coordinates.chart.rates(x1[None], v1[None])[0][0]
    local = np.stack([T * v0, x1 - T * v0, T * (dx1 - v0)])  # h v0, Z0, Z1

    def curve(t: Array) -> tuple[Array, Array, Array]:
        jet = interval_rows(np.asarray(t) / T, 0) @ local  # (M, 3, n)
        return in_chart(coordinates, q0, jet[:, 0], jet[:, 1] / T, jet[:, 2] / T**2)

    return curve


def minimum_jerk(coordinates: Coordinates, ends: Ends, duration: float) -> Curve:
    """The quintic through both ends with x'' = 0 there; arguments as for `cubic`."""
    (q0, q1), (v0, v1) = ends
    T = duration
    x1 = coordinates.difference(q0, q1)
    dx1 = coordinates.chart.rates(x1[None], v1[None])[0][0]
    power = np.arange(6)[:, None]
    conditions = np.zeros((6, 6))
    for row, (s, derivative) in enumerate([(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]):
        for j in range(derivative, 6):
            conditions[row, j] = np.prod(range(j - derivative + 1, j + 1)) * float(s) ** (
                j - derivative
            )
    zero = np.zeros(coordinates.nv)
    known = np.stack([zero, T * v0, zero, x1, T * dx1, zero])
    c = np.linalg.solve(conditions, known)  # (6, n)

    def curve(t: Array) -> tuple[Array, Array, Array]:
        s = (t / T)[None]
        x = (s**power).T @ c
        dx = (power[1:] * s ** power[:-1]).T @ c[1:]
        ddx = (power[2:] * power[1:-1] * s ** power[:-2]).T @ c[2:]
        return in_chart(coordinates, q0, x, dx / T, ddx / T**2)

    return curve


def hermite(ends: Array, duration: float) -> Curve:
    """The polynomial of degree 2 k - 1 between two points: the minimizer of 1/2 |q^(k)|^2.

    ends: (q, q', ..., q^(k-1)) at the start and at the goal, shape (2, k, n). duration: T, in [s].
    """
    k, T = ends.shape[1], duration
    scaled = ends * T ** np.arange(k)[:, None]
    local = np.concatenate([scaled[0, 1:], regular_from_nodal(0, k)[k:] @ np.concatenate(scaled)])

    def curve(t: Array) -> tuple[Array, ...]:
        jet = jet_rows(np.asarray(t) / T, k, 0, max(k, 2)) @ local
        rates = (jet[:, j] / T**j for j in range(1, jet.shape[1]))
        return ends[0, 0] + jet[:, 0], *rates

    return curve


def polynomial(on: Coordinates, ends: Ends, duration: float, turns: Array) -> Curve:
    """The curve q0 (+) x(t) with the Hermite polynomial x between two points of T^(k-1)Q.

    On vector spaces, commutative groups, and for k = 1.
    turns: as in `with_turns`. duration: T, in [s].
    """
    q, *rates = ends
    if on.vector_joints:
        return hermite(np.stack(ends, axis=1), duration)
    x1 = on.difference(q[0], q[1])
    if on.space.flat:
        x1 = x1 + 2 * np.pi * turns
    x = hermite(np.stack([np.stack([0 * x1, x1]), *rates], axis=1), duration)

    def curve(t: Array) -> tuple[Array, ...]:
        jet = x(t)
        if not on.space.flat:
            return in_chart(on, q[0], *jet)
        return on.integrate(q[0], jet[0]), *jet[1:]

    return curve if on.space.flat else with_turns(curve, on, duration, turns)


def in_chart(
    coordinates: Coordinates, q0: Array, x: Array, dx: Array, ddx: Array
) -> tuple[Array, Array, Array]:
    """The jet of q0 (+) x(t)."""
    return coordinates.chart.jet(np.broadcast_to(q0, (len(x), coordinates.nq)), x, dx, ddx)


def moved_by(
    coordinates: Coordinates, jet: tuple[Array, ...], x: Array, dx: Array, ddx: Array, dddx: Array
) -> tuple[Array, ...]:
    """(q, v, a) (+) x(t) of a curve, and the jerk where it has one, on vector spaces."""
    q, v, a, *jerk = jet
    moved = coordinates.chart.composed((q, v, a), x, dx, ddx)
    return (*moved, *(each + dddx for each in jerk))


def with_bump(
    base: Curve, coordinates: Coordinates, duration: float, seed: int, fraction: float = 1.0
) -> Curve:
    """A curve plus a smooth random bump that vanishes with its rate at both ends.

    x(t) = sum_j c_j sin(pi t/T) sin(j pi t/T), j = 1 .. 8, with c_j normally distributed,
    decreasing like 1/sqrt(j), and scaled by a random amplitude of up to about half a turn.

    base: the curve, up to the jerk on vector spaces. duration: T, in [s]. seed: of the
        coefficients. fraction: of the bump that is added.
    """
    random = np.random.default_rng(seed)
    j = np.arange(1, BUMP_MODES + 1)
    amplitude = fraction * random.uniform(*BUMP_AMPLITUDES)
    c = amplitude * random.standard_normal((BUMP_MODES, coordinates.nv)) / np.sqrt(j)[:, None]
    w = np.pi / duration

    def curve(t: Array) -> tuple[Array, ...]:
        # sin(s) sin(j s) = (cos((j-1) s) - cos((j+1) s)) / 2
        low, high = np.outer(t, j - 1) * w, np.outer(t, j + 1) * w
        x = (np.cos(low) - np.cos(high)) / 2
        dx = (-(j - 1) * np.sin(low) + (j + 1) * np.sin(high)) * w / 2
        ddx = (-((j - 1) ** 2) * np.cos(low) + (j + 1) ** 2 * np.cos(high)) * w**2 / 2
        dddx = ((j - 1) ** 3 * np.sin(low) - (j + 1) ** 3 * np.sin(high)) * w**3 / 2
        return moved_by(coordinates, base(t), x @ c, dx @ c, ddx @ c, dddx @ c)

    return curve


def with_turns(base: Curve, coordinates: Coordinates, duration: float, turns: Array) -> Curve:
    """A curve plus full turns, distributed over the duration by a cubic at rest at both ends.

    base: the curve, up to the jerk on commutative groups.
    turns: rotation vectors over 2 pi in the tangent space, shape (nv,): see `State.turns_on`.
    duration: T, in [s].
    """
    angle = 2 * np.pi * turns

    def curve(t: Array) -> tuple[Array, ...]:
        s = np.asarray(t)[:, None] / duration
        x, dx, ddx = s**2 * (3 - 2 * s), 6 * s * (1 - s) / duration, (6 - 12 * s) / duration**2
        turned = _modulo_period(coordinates, x * angle)
        return moved_by(
            coordinates, base(t), turned, dx * angle, ddx * angle, -12 * angle / duration**3
        )

    return curve


def _modulo_period(coordinates: Coordinates, x: Array) -> Array:
    """Rotation vectors (M, nv) modulo 4 pi, the period of a quaternion.

    The rates of a chart are exact up to 2 pi only. About a fixed axis J(x) x' = x', so they are the
    same after the reduction.
    """
    left = x.copy()
    for factor in coordinates.space.curved:
        axes = [factor.v.start + i for i in factor.group.angular]
        size = np.linalg.norm(x[:, axes], axis=1, keepdims=True)
        full = 4 * np.pi * np.round(size / (4 * np.pi))
        left[:, axes] *= 1 - full / np.where(size > 0, size, 1.0)
    return left


NAMED: dict[str, Callable[[Coordinates, Ends, float], Curve]] = {
    "cubic": cubic,
    "minimum-jerk": minimum_jerk,
}
"""Guesses by their name in files and on the command line."""


def named_curve(
    name: str, on: Coordinates, ends: Ends, duration: float, turns: Array | None = None
) -> Curve:
    """The guess with a name; for orders other than 2 the Hermite polynomial, whatever the name.

    turns: as in `with_turns`; none if None. Raises InputError for an unknown name.
    """
    require_guess(name)
    turns = np.zeros(on.nv) if turns is None else turns
    if len(ends) != 2:
        return polynomial(on, ends, duration, turns)
    curve = NAMED[name](on, ends, duration)
    return with_turns(curve, on, duration, turns) if turns.any() else curve


def require_guess(name: str) -> None:
    """Raise InputError for an unknown name of a guess."""
    if name not in NAMED:
        raise InputError(f"there is no guess {name!r}: {nearest(name, NAMED)}")


def joined(pieces: Sequence[Curve], times: Array) -> Curve:
    """Curves one after the other. times: at which they begin, ascending, shape (P,), in [s]."""

    def curve(t: Array) -> tuple[Array, ...]:
        number = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(pieces) - 1)
        jets = [piece(np.asarray(t) - begin) for piece, begin in zip(pieces, times, strict=True)]
        known, rows = min(map(len, jets)), np.arange(len(number))
        return tuple(np.stack([jet[j] for jet in jets])[number, rows] for j in range(known))

    return curve


def stretched(trajectory: Trajectory, duration: float, order: int = 2) -> Curve:
    """A motion as a curve, rescaled to another duration. order: its highest derivative, if > 2."""
    stretch = trajectory.duration / duration

    def curve(t: Array) -> tuple[Array, ...]:
        jet = trajectory.jet(np.clip(t * stretch, 0.0, trajectory.duration), max(order, 2))
        return tuple(x * stretch**j for j, x in enumerate(jet))

    return curve


def check_path(path: DiscretePath, grid: Grid, coordinates: Coordinates) -> None:
    """Raise InputError for a path that does not match its grid, or contradicts itself."""
    N, r, n = grid.intervals, grid.inner_modes, coordinates.nv
    shapes = {"q": (N + 1, coordinates.nq), "v": (N + 1, n), "z": (N, 2, n), "inner": (N, r, n)}
    fits = [array.shape for array in path.arrays] == list(shapes.values())
    if fits and coordinates.vector_joints and misfit(path.arrays, grid.steps) <= MISFIT_TOLERANCE:
        return
    for name, shape in shapes.items():
        array = getattr(path, name)
        if array.shape != shape or not np.isfinite(array).all():
            raise InputError(
                f"the guess's {name} must be finite and of shape {shape}, got {array.shape}; "
                "pass a Trajectory to change grids."
            )
    h = grid.steps[:, None]
    rotation = None if coordinates.vector_joints else h * path.v[:-1] + h**2 * path.z[:, 0]
    gap = (regularized(coordinates, grid, path.q, path.v, rotation) - path.z) * h[..., None] ** 2
    if np.abs(gap).max() > MISFIT_TOLERANCE * max(1.0, np.abs(path.q).max()):
        raise InputError(
            "the guess's z does not match its q and v: on vector spaces "
            "z0 = (q1 - q0 - h v0)/h^2 and z1 = (v1 - v0)/h."
        )


def regularized(
    coordinates: Coordinates, grid: Grid, q: Array, v: Array, rotation: Array | None = None
) -> Array:
    """z0 = (x1 - h v0)/h^2 and z1 = (x1' - v0)/h of every interval, shape (N, 2, nv).

    x1 = q1 (-) q0 and x1' = J(x1)^-1 v1, which is v1 on commutative groups.
    rotation: approximate rotation in each interval, shape (N, nv), that determines the number of
        turns; less than half a turn when None.
    """
    h = grid.steps[:, None]
    dx1 = v[1:]
    if rotation is None:
        x1 = coordinates.difference(q[:-1], q[1:])
    else:
        x1 = coordinates.space.difference_near(q[:-1], q[1:], rotation)
    if not coordinates.space.flat:
        dx1 = coordinates.chart.rates(x1, dx1)[0]
    return np.stack([(x1 - h * v[:-1]) / h**2, (dx1 - v[:-1]) / h], axis=1)


def with_ends_of_nodes(path: DiscretePath, grid: Grid, coordinates: Coordinates) -> DiscretePath:
    """A path with z recomputed from its nodes on noncommutative groups, and unchanged elsewhere."""
    if coordinates.space.flat:
        return path
    h = grid.steps[:, None]
    rotation = h * path.v[:-1] + h**2 * path.z[:, 0]
    z, known = path.z.copy(), regularized(coordinates, grid, path.q, path.v, rotation)
    for factor in coordinates.space.curved:
        z[:, :, factor.v] = known[:, :, factor.v]
    return DiscretePath(path.q, path.v, z, path.inner)


def rotation_along(curve: Curve, grid: Grid, coordinates: Coordinates) -> Array:
    """The integral of v over every interval, by Gauss quadrature, shape (N, nv).

    Raises ChartError if an orientation rotates by more than MAX_ROTATION in an interval.
    """
    x, w = np.polynomial.legendre.leggauss(ROTATION_POINTS)
    t = grid.t[:-1, None] + grid.steps[:, None] * (x + 1) / 2
    v = curve(t.ravel())[1].reshape(grid.intervals, ROTATION_POINTS, -1)
    for factor in coordinates.space.curved:
        speed = np.linalg.norm(v[:, :, [factor.v.start + i for i in factor.group.angular]], axis=2)
        turn = grid.steps * (speed @ (w / 2))  # (N,)
        if turn.max() > MAX_ROTATION:
            joint = coordinates.joint_at(factor.v.start)
            raise ChartError(
                f"the guess rotates joint {joint!r} by {turn.max():.3g} rad "
                f"within an interval, and a chart covers up to {MAX_ROTATION:.3g} rad: use "
                f"{int(np.ceil(grid.intervals * turn.max() / MAX_ROTATION))} or more intervals."
            )
    return np.asarray(grid.steps[:, None] * np.einsum("q,kqn->kn", w / 2, v))


def modes_of(curve: Curve, grid: Grid, coordinates: Coordinates, nodes: Array) -> Array:
    """c_j = integral of b_j x'' over the interval, by Gauss quadrature, shape (N, r, n).

    nodes: configurations, shape (N + 1, nq).
    """
    n = coordinates.nv
    inner = np.zeros((grid.intervals, grid.inner_modes, n))
    for scheme, index in grid.groups:
        r = scheme.inner_modes
        if r == 0:
            continue
        s, projection = projection_on_modes(r)
        t = grid.t[:-1][index][:, None] + grid.steps[index][:, None] * s
        q, v, a = curve(t.ravel())
        if not coordinates.space.flat:
            local = coordinates.difference(np.repeat(nodes[:-1][index], len(s), axis=0), q)
            a = coordinates.chart.rates(local, v, a)[1]
        inner[index, :r] = np.matmul(projection, a.reshape(len(index), len(s), n))
    return inner


@functools.cache
def projection_on_modes(inner_modes: int, k: int = 2) -> tuple[Array, Array]:
    """Gauss points of [0, 1], (Q,), and the projection of values there on inner modes, (r, Q)."""
    x, w = np.polynomial.legendre.leggauss(inner_modes + k)
    s = (x + 1) / 2
    rows = interval_rows(s, inner_modes) if k == 2 else jet_rows(s, k, inner_modes)
    return s, np.ascontiguousarray((rows[:, k, 2 * k - 1 :] * (w / 2)[:, None]).T)
