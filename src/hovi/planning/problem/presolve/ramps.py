"""Nodes for the ramps of a motion that has little more than its least time.

A joint that travels a distance d in a time T within |v| <= v_max is at full speed for at least
d / v_max. What is left, s = T - d / v_max, is for its ramps: each takes s if it is linear and the
joint rests at both ends, 2 s at the only one. Limits are kept by polynomials on intervals, and on
one that is longer than a ramp none is steep enough.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.planning.problem.presolve.least_time import Pace
from hovi.planning.problem.presolve.legs import Leg, Stop
from hovi.planning.problem.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]

TIGHT = 0.8
"""Least share of the duration that a joint's least time takes where its ramps get nodes."""
GRADES = 2.0 ** np.arange(-2, 12)
"""Times of nodes, as multiples of a ramp, until they are as far apart as those of the grid."""
CLOSE = 1e-6
"""Share of the duration within which two nodes are one."""


def graded_to_ramps(problem: TrajectoryProblem) -> Grid:
    """The grid of a problem with further nodes in the ramps of the joint with the least to spare.

    The same grid where no joint is pressed for time, and for motions that are not between two
    states without via points.
    """
    grid, T = problem.grid, problem.grid.duration
    times = _ramp_nodes(problem)
    apart = np.abs(times[:, None] - grid.t).min(axis=1) > CLOSE * T
    return grid.split_at(np.union1d(grid.t, times[apart]))


def _ramp_nodes(problem: TrajectoryProblem) -> Array:
    """Times of nodes from both ends on, in [s]; none where no joint is pressed for time."""
    limits, start, goal = problem.limits, problem.start, problem.goal
    if limits is None or limits.parts or problem.via or not limits.bounded[1].any():
        return np.zeros(0)
    if not (isinstance(start, State) and isinstance(goal, State)):
        return np.zeros(0)
    on, T = problem.coordinates, problem.grid.duration
    leg = Leg(Stop("start", 0.0, start), Stop("goal", T, goal), on, Pace.of(limits), limits)
    i = int(np.argmax(leg.needed))
    ends = [bool(stop.rests(on)[i]) for stop in (leg.first, leg.last)]
    if leg.needed[i] < TIGHT * T or not any(ends):
        return np.zeros(0)
    distance = float(leg.distance[i])
    speed = float((leg.pace.up if distance >= 0 else leg.pace.down)[i])
    ramp = 2.0 * (T - abs(distance) / speed) / sum(ends)
    longest = float(problem.grid.steps.max())
    times = ramp * GRADES[(ramp * GRADES <= 2.0 * longest) | (GRADES <= 1.0)]
    times = times[times < T / 2]
    sides = [times if ends[0] else times[:0], T - times if ends[1] else times[:0]]
    return np.concatenate(sides)
