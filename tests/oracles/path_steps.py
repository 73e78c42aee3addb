"""Steps of a discrete path in its free unknowns, and the path after them.

With `DiscreteLagrangian.expand` they give slopes and curvatures of an action, to be compared with
differences of values along a step.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import hovi
from hovi.discrete.guess import with_ends_of_nodes
from hovi.discrete.interval_paths import move, move_any

Array = npt.NDArray[np.float64]


def random_step(problem: hovi.TrajectoryProblem, seed: int) -> Array:
    """In the columns of the intervals, (N, 2 k + r, nv): (q0, h v0, ..., q1, h v1, ..., c).

    The ends stay, and modes that an interval does not have.
    """
    ld, random = problem.ld, np.random.default_rng(seed)
    N, k, n = problem.grid.intervals, ld.k, ld.lagrangian.nv
    nodes = random.normal(size=(N + 1, k, n))
    nodes[[0, -1]] = 0.0
    inner = random.normal(size=(N, ld.columns - 2 * k, n))
    for i, scheme in enumerate(problem.grid.schemes):
        inner[i, scheme.inner_modes :] = 0.0
    scales = problem.grid.steps[:, None, None] ** np.arange(k)[:, None]
    return np.concatenate([nodes[:-1] * scales, nodes[1:] * scales, inner], axis=1)


def moved(
    problem: hovi.TrajectoryProblem, path: hovi.DiscretePath, step: Array
) -> hovi.DiscretePath:
    """The path after a step: q by the robot's `integrate`, all else added."""
    grid, on = problem.grid, problem.coordinates
    if problem.ld.k != 2:
        return move_any(path, step, grid.steps, on.curved_space)
    dq, *rest = move(path.arrays, step, grid.steps, True)
    after = hovi.DiscretePath(on.integrate(path.q, dq), *rest)
    return after if problem.ld.chart is None else with_ends_of_nodes(after, grid, on)
