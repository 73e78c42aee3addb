"""A motion to rest from where a robot is, for when no better one is found in time.

Every joint goes on with what its state has, as

    v(t) = v0 (1 + 2 s) (1 - s)^2 + a0 t_s s (1 - s)^2,  s = t / t_s,

and rests from t_s on. Without a given acceleration a0 = -2 v0 / t_s, so that v = v0 (1 - s)^2. The
shortest of a few times t_s is taken at which all limits and distances hold everywhere.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import Curve
from hovi.discrete.state import State
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.receding.last_motion import satisfies

Array = npt.NDArray[np.float64]

BRAKES = "Instead, this motion brakes to rest from the start, within the limits."
"""What is reported of such a motion."""
FIRST, TIMES = 0.02, 7
"""First time t_s, as a fraction of the motion, and the number of times, each twice the last."""


def braking(problem: TrajectoryProblem) -> tuple[TrajectoryProblem, DiscretePath] | None:
    """A motion to rest from the start of a problem, in its duration; None if none is found.

    With the problem whose goal is where the robot comes to rest.
    Raises OutOfTimeError when the deadline in force passes before that is known.
    """
    space, k = problem.coordinates.curved_space, problem.ld.k
    if space is not None or k not in (2, 3) or problem.periodic or problem.unreachable:
        return None
    if problem.free_ends[0].any() or len(problem.passive) > 0 or problem.ld.segments is not None:
        return None
    T = problem.grid.duration
    for time in T * FIRST * 2.0 ** np.arange(TIMES):
        found = _within(problem, min(float(time), T))
        if found is not None:
            return found
    return None


def _within(
    problem: TrajectoryProblem, time: float
) -> tuple[TrajectoryProblem, DiscretePath] | None:
    """The motion that rests from a time on, in [s]; None if it exceeds a limit."""
    curve = _to_rest(problem, time)
    stop = State(curve(np.array([time]))[0][0])
    ld = DiscreteLagrangian(problem.ld.lagrangian, problem.grid)
    stopping = dataclasses.replace(problem, ld=ld, goal=stop, via=())
    path = stopping.path(curve)
    return (stopping, path) if satisfies(stopping, path) else None


def _to_rest(problem: TrajectoryProblem, time: float) -> Curve:
    q0, v0, k = problem.ends[0][0], problem.end_velocities[0], problem.ld.k
    a0 = problem.ends[2][0] if k > 2 else -2.0 * v0 / time
    # v = v0 + a0 time s + (-3 v0 - 2 a0 time) s^2 + (2 v0 + a0 time) s^3
    v = np.stack([v0, a0 * time, -3.0 * v0 - 2.0 * a0 * time, 2.0 * v0 + a0 * time])
    powers = np.arange(4.0)[:, None]

    def curve(t: Array) -> tuple[Array, ...]:
        s = np.minimum(t / time, 1.0)[:, None, None]
        q = q0 + time * (v / (powers + 1.0) * s ** (powers + 1.0)).sum(axis=1)
        rates = [(v * s**powers).sum(axis=1)]
        factor = v
        for j in range(1, k):
            factor = factor * np.maximum(powers - (j - 1), 0.0) / time
            rates.append((factor * s ** np.maximum(powers - j, 0.0)).sum(axis=1))
        moving = (t < time)[:, None]
        return (q, *(np.where(moving, x, 0.0) for x in rates))

    return curve
