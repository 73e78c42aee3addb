"""Initial guesses along paths around obstacles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import Curve, joined
from hovi.discrete.state import State
from hovi.errors import UnreachableError
from hovi.planning.paths.free_space import FreeSpace
from hovi.planning.paths.ompl_paths import OmplProcess
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.inverse_kinematics import configurations
from hovi.planning.problem.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]

DEEP = 0.04
"""Depth in obstacles from which a direct guess is deep in them, in [m]."""
LOOKED_AT = 129
"""Number of times at which the depth of a guess is looked at."""
LEAST_LENGTH = 1e-9
"""Length below which two points of a path count as one, as a time at full speed, in [s]."""

DRAWS = 4
"""Maximum number of paths that are planned until one is short enough."""
PEAK = 1.875
"""Largest velocity of the motion of least jerk, relative to its mean."""
STRAIGHT = 1.1
"""Length of a path, relative to the straight one, up to which it is short enough in any case."""
SHORTER = 0.8
"""Length of a path, relative to an earlier one, below which it replaces that one."""


def depth_of(problem: TrajectoryProblem, guess: DiscretePath) -> float:
    """By how much a guess misses the margin at most, in [m]; -inf where no path can help."""
    space = FreeSpace.of(problem, guess.q[0])
    if space is None:
        return -np.inf
    t = np.linspace(0.0, problem.grid.duration, LOOKED_AT)
    return space.depth(problem.trajectory(guess).configurations(t))


def path_guesses(
    problem: TrajectoryProblem, direct: DiscretePath, count: int, seed: int
) -> Iterator[DiscretePath]:
    """Up to `count` guesses along paths by OMPL, each with a seed of its own.

    direct: a guess, whose ends the paths connect. They pass through the via points, where a guess
        comes to rest.
    Raises OutOfTimeError when the deadline in force passes.
    """
    space = FreeSpace.of(problem, direct.q[0])
    if space is None:
        return
    waypoints = [*_waypoints(problem, direct.q[0]), (problem.grid.duration, direct.q[-1])]
    t = np.array([0.0, *(time for time, _ in waypoints)])
    turns = [_full_turns(problem, time) / space.speed for time, _ in waypoints]
    with OmplProcess() as ompl:
        for k in range(count):
            paths, x = list[Array](), np.zeros(len(space.speed))
            for (_, q), turn, duration in zip(waypoints, turns, np.diff(t), strict=True):
                y = x + space.x_between(space.q(x[None])[0], q) + turn
                seeds = range(seed * 1_009 + k, (seed + 1) * 1_009, count)
                points = fast_path(ompl, space, (x, y), seeds[:DRAWS], float(duration))
                if points is None:
                    return
                paths, x = [*paths, points], y
            pieces = [motion_along(space, *each) for each in zip(paths, np.diff(t), strict=True)]
            yield problem.path(joined(pieces, t[:-1]))


def _full_turns(problem: TrajectoryProblem, time: float) -> Array:
    """Full turns of continuous joints beyond the shortest path to a waypoint, (nv,), in [rad]."""
    angles = [factor.v.start for factor in problem.coordinates.space.angles]
    known = {each.time: each.turns for each in problem.holds}
    known[problem.grid.duration] = problem.turns
    full = np.zeros(problem.coordinates.nv)
    if time in known:
        full[angles] = 2 * np.pi * known[time][angles]
    return full


def fast_path(
    ompl: OmplProcess,
    space: FreeSpace,
    ends: tuple[Array, Array],
    seeds: Iterable[int],
    duration: float,
) -> Array | None:
    """The first path short enough for a duration, or about the shortest; None if there is none.

    Paths of RRT-Connect differ in length by a factor of two and more, and a motion along one that
    is too long is far outside the velocity limits.

    ends: start and goal in the coordinates of the space, (nv,) each. seeds: one for each path.
    duration: of the motion along it, in [s].
    """
    best, direct = None, _time_along(np.stack(ends))
    for seed in seeds:
        points = ompl.path(space, *ends, seed)
        if points is None:
            break
        if best is None or _time_along(points) < SHORTER * _time_along(best):
            best = points
        if PEAK * _time_along(best) <= duration or _time_along(best) <= STRAIGHT * direct:
            break
    return best


def _time_along(points: Array) -> float:
    """The time that a path, (M, nv), takes at the velocity limits, in [s]."""
    return float(np.abs(np.diff(points, axis=0)).max(axis=1).sum())


def _waypoints(problem: TrajectoryProblem, start: Array) -> list[tuple[float, Array]]:
    """Times and configurations of the via points, without those of which none is known."""
    limits, clearance = problem.limits, problem.clearance
    assert clearance is not None
    held, waypoints, near = {each.time: each.q for each in problem.holds}, [], start
    unbounded = np.full(problem.coordinates.nv, np.inf)
    bounds = (-unbounded, unbounded) if limits is None else (limits.lower[0], limits.upper[0])
    for via in sorted(problem.via, key=lambda each: each.time):
        q, goal = held.get(via.time), via.goal
        if q is None and isinstance(goal, State):
            q = goal.on(problem.coordinates, "via")[0]
        elif q is None and isinstance(goal, FrameGoal):
            with suppress(UnreachableError):
                q = configurations(problem.robot, goal, near, bounds, clearance)[0]
        if q is not None:
            waypoints.append((via.time, q))
            near = q
    return waypoints


def motion_along(space: FreeSpace, points: Array, duration: float) -> Curve:
    """A motion along a path, from rest to rest.

    On the natural cubic spline through its points, x(u), with u in [0, 1] in proportion to the time
    that a path takes where the joint nearest to its largest velocity has that; and u(t) as in the
    motion of least jerk, u = 10 s^3 - 15 s^4 + 6 s^5 with s = t / T.

    points: (M, nv) in the space's coordinates. duration: T, in [s].
    """
    lengths = np.abs(np.diff(points, axis=0)).max(axis=1)
    kept = np.concatenate([[True], lengths > LEAST_LENGTH])
    points, lengths = points[kept], lengths[kept[1:]]
    if len(points) == 1:
        points, lengths = np.repeat(points, 2, axis=0), np.ones(1)
    u = np.concatenate([[0.0], np.cumsum(lengths)])
    u /= u[-1]
    slopes = natural_slopes(u, points)
    speed, coordinates, T = space.speed, space.problem.coordinates, duration

    def curve(t: Array) -> tuple[Array, ...]:
        s = np.clip(np.asarray(t) / T, 0.0, 1.0)[:, None]
        du = 30 * s**2 * (1 - s) ** 2 / T
        ddu = 60 * s * (1 - s) * (1 - 2 * s) / T**2
        dddu = 60 * (1 - 6 * s + 6 * s**2) / T**3
        x, dx, ddx, dddx = on_spline(u, points, slopes, (s**3 * (10 - 15 * s + 6 * s**2))[:, 0])
        rates = (
            dx * du,
            ddx * du**2 + dx * ddu,
            dddx * du**3 + 3 * ddx * du * ddu + dx * dddu,
        )
        origin = np.broadcast_to(space.origin, (len(x), len(space.origin)))
        known = [each * speed for each in rates[: space.problem.ld.k]]
        return coordinates.integrate(origin, x * speed), *known

    return curve


def natural_slopes(u: Array, x: Array) -> Array:
    """The derivatives of the natural cubic spline at its points, (M, n).

    u: ascending parameters, (M,). x: values, (M, n).
    """
    h = np.diff(u)
    secants = np.diff(x, axis=0) / h[:, None]
    A = np.zeros((len(u), len(u)))
    rows = np.arange(1, len(u) - 1)
    A[rows, rows - 1], A[rows, rows + 1] = h[1:], h[:-1]
    A[rows, rows] = 2 * (h[1:] + h[:-1])
    A[0, :2], A[-1, -2:] = (2.0, 1.0), (1.0, 2.0)
    b = np.concatenate([secants[:1], np.zeros((len(rows), x.shape[1])), secants[-1:]]) * 3
    b[rows] = 3 * (h[1:, None] * secants[:-1] + h[:-1, None] * secants[1:])
    return np.linalg.solve(A, b)


def on_spline(u: Array, x: Array, slopes: Array, at: Array) -> tuple[Array, ...]:
    """A cubic spline and its first three derivatives at parameters (P,), (P, n) each."""
    k = np.clip(np.searchsorted(u, at, side="right") - 1, 0, len(u) - 2)
    h, s = (u[k + 1] - u[k])[:, None], ((at - u[k]) / (u[k + 1] - u[k]))[:, None]
    a, b = slopes[k] * h, slopes[k + 1] * h
    rise = x[k + 1] - x[k]
    c, d = 3 * rise - 2 * a - b, a + b - 2 * rise
    return (
        x[k] + s * (a + s * (c + s * d)),
        (a + s * (2 * c + 3 * s * d)) / h,
        (2 * c + 6 * s * d) / h**2,
        6 * d / h**3,
    )
