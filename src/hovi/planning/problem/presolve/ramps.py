"""Nodes for the ramps of motions that have little more than their least time.

A joint that travels a distance d in a time T, from a velocity u_0 to a velocity u_1 and at most at
p between, is at p for all of the time but its ramps. If both have one acceleration, they take

    r_e = (p - u_e) / a,  a = ((p - u_0)^2 + (p - u_1)^2) / (2 (p T - d)).

Limits are kept by polynomials on intervals, and on one that is longer than a ramp none is steep
enough.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.planning.problem.presolve.least_time import NONE, Pace, fastest
from hovi.planning.problem.presolve.moves import Move, Waypoint
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.space.coordinates import Coordinates

Array = npt.NDArray[np.float64]

TIGHT = 0.8
"""Ramps get nodes where the least time of a travel is at least this fraction of its time."""
GRADES = 2.0 ** np.arange(-2, 12)
"""Times of nodes, as multiples of a ramp, until they are as far apart as those of the grid."""
SMOOTH_GRADES = np.sort([*2.0 ** np.arange(-3, 12), 0.75, 0.875])
"""Times of nodes, as multiples of a ramp, where the acceleration is continuous, and has to vanish
after a ramp as well."""
CLOSE = 1e-6
"""Two nodes are one if they are nearer than this fraction of the duration."""
NEAR = 0.1
"""Nodes of two joints are one if they are nearer than this fraction of their distance in time from
the waypoint."""
ENDS = "start", "goal"
"""Names of the ends of a motion."""


def graded_to_ramps(problem: TrajectoryProblem) -> Grid:
    """The grid of a problem with further nodes in the ramps of all joints with little to spare.

    The same grid where no joint is pressed for time. Ramps at frames are not known.
    """
    grid, limits = problem.grid, problem.limits
    if limits is None or not limits.bounded[1:3].any():
        return grid
    nodes = np.zeros(0)
    grades = np.asarray(GRADES if problem.ld.k < 3 else SMOOTH_GRADES, dtype=float)
    for move in _moves(problem):
        times = _ramp_nodes(move, grades, float(grid.steps.max()))
        nodes = np.union1d(nodes, move.first.time + times)
    nodes = nodes[np.diff(nodes, prepend=-np.inf) > CLOSE * grid.duration]
    apart = np.abs(nodes[:, None] - grid.t).min(axis=1, initial=np.inf) > CLOSE * grid.duration
    return grid.split_at(np.union1d(grid.t, nodes[apart]))


def _moves(problem: TrajectoryProblem) -> list[Move]:
    """The parts of the motion between neighboring states, with the limits there."""
    limits, on, T = problem.limits, problem.coordinates, problem.grid.duration
    ends = [(ENDS[0], 0.0, problem.start), (ENDS[1], T, problem.goal)]
    given = [*ends, *(("via point", via.time, via.goal) for via in problem.via)]
    waypoints = [Waypoint(name, t, x) for name, t, x in given if isinstance(x, State)]
    assert limits is not None
    return [
        Move(first, last, on, Pace.of(limits.until(last.time)), limits)
        for first, last in pairwise(sorted(waypoints, key=lambda waypoint: waypoint.time))
    ]


def _ramp_nodes(move: Move, grades: Array, longest: float) -> Array:
    """Times of nodes in a move, from its beginning on, in [s]; none where no joint is pressed.

    longest: step of the grid, in [s].
    """
    on, sides = move.coordinates, [np.zeros(0), np.zeros(0)]
    first, last = (_velocities(waypoint, on) for waypoint in (move.first, move.last))
    for i, distance in enumerate(move.distance):
        for side, ramp in enumerate(_ramps(move, i, float(distance), (first[i], last[i]))):
            times = ramp * grades[(ramp * grades <= 2.0 * longest) | (grades <= 1.0)]
            known = sides[side]
            apart = np.abs(times[:, None] - known).min(axis=1, initial=np.inf) > NEAR * times
            sides[side] = np.append(known, times[apart & (times < move.time)])
    return np.concatenate([sides[0], move.time - sides[1]])


def _velocities(waypoint: Waypoint, on: Coordinates) -> Array:
    """Velocities of the joints at a waypoint, (nv,), in [rad/s] or [m/s]; NaN if free at an end.

    Where a via point leaves a velocity free, the joint may turn round, with ramps as at rest.
    """
    assert isinstance(waypoint.goal, State)
    ends = waypoint.name in ENDS
    free = waypoint.goal.free_on(on, waypoint.name)[1]
    return np.where(free, np.nan if ends else 0.0, waypoint.goal.on(on, waypoint.name)[1])


def _ramps(move: Move, i: int, distance: float, velocities: tuple[float, float]) -> Array:
    """Longest times in which joint i speeds up and slows down, (2,), in [s]; 0 if not pressed.

    distance: of its travel, in [rad] or [m]. velocities: at the ends, NaN where free.
    """
    pace = move.pace
    speeds = float(pace.down[i]), float(pace.up[i])
    needed, peak = fastest(distance, velocities, speeds, float(pace.acceleration[i]))
    if needed < TIGHT * move.time:
        return np.zeros(2)
    changes = np.nan_to_num(np.abs(peak - np.array(velocities)))
    spare = max(abs(peak) * move.time - np.sign(peak) * distance, 0.0)
    return np.asarray(2.0 * spare * changes / max(float(changes @ changes), NONE))
