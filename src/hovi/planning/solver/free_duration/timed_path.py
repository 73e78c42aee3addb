"""A path with its duration, and steps of both."""

from __future__ import annotations

import copy

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import without_checks
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

# called at each step
_new_grid = without_checks(Grid)
_new_lagrangian = without_checks(DiscreteLagrangian)
_new_path = without_checks(DiscretePath)


@dataclass(frozen=True)
class TimePrice:
    """The price of time and the bounds of a duration.

    weight: w, in cost per [s]. lower, upper: in [s].
    """

    weight: float
    lower: float
    upper: float

    def room(self, duration: float) -> tuple[float, float]:
        """The least and the largest step of log T at a duration within the bounds, in [s]."""
        low, high = np.log(self.lower / duration), np.log(self.upper / duration)
        return min(float(low), 0.0), max(float(high), 0.0)

    def after(self, duration: float, step: float) -> float:
        """The duration after a step of its logarithm, in [s]; exactly a bound where it ends."""
        low, high = self.room(duration)
        if low < step < high:
            return duration * float(np.exp(step))
        return self.lower if step <= low else self.upper


@dataclass(frozen=True, eq=False)
class TimedPath:
    """A path and its duration T, in [s], on a grid whose steps keep their proportions."""

    path: DiscretePath
    duration: float


def stretched_problem(problem: TrajectoryProblem, duration: float) -> TrajectoryProblem:
    """The problem for another duration, for solvers: its checks of the duration are not made.

    For problems of which nothing but the discrete Lagrangian depends on the duration, and whose
    conditions do not depend on time: the structure of the Hessian depends on the proportions of the
    steps alone.
    """
    if duration == problem.grid.duration:
        return problem
    grid = _new_grid(problem.grid.steps * (duration / problem.grid.duration), problem.grid.schemes)
    ld = _new_lagrangian(problem.ld.lagrangian, grid)
    stretched = copy.copy(problem)
    object.__setattr__(stretched, "ld", ld)
    for name in ("torque_moments", "finer", "inertial_torque"):
        stretched.__dict__.pop(name, None)
    object.__setattr__(stretched, "structure", problem.structure)
    return stretched


def stretched_path(path: DiscretePath, ratio: float) -> DiscretePath:
    """The same curve, run through in `ratio` times the duration; velocities at the ends, too."""
    k = path.order
    powers = ratio ** np.arange(1.0, k)
    return _new_path(
        path.q,
        path.v / ratio,
        path.z / ratio**k,
        path.inner / ratio**k,
        path.higher / powers[1:, None],
    )


def end_columns(problem: TrajectoryProblem, path: DiscretePath) -> Array | None:
    """j h^j q^(j) of the fixed components of both ends, shape (2, k, n); None at rest.

    They are the derivatives of the ends' columns h^j q^(j) in log T, as q^(j) is given and h
    proportional to T; all other columns are unknowns.
    """
    rates, k = path.rates[[0, -1]], problem.ld.k
    if not rates.any():
        return None
    steps, j = problem.grid.steps[[0, -1]], np.arange(k)
    columns = np.zeros((2, k, path.v.shape[1]))
    columns[:, 1:] = rates
    columns *= (j * steps[:, None] ** j)[:, :, None]
    return np.where(problem.free_ends, 0.0, columns)


def columns_of_ends(ends: Array, problem: TrajectoryProblem) -> Array:
    """The change of all columns, (N, m, n), for one of those of both ends, (2, k, n)."""
    k = problem.ld.k
    columns = np.zeros((problem.grid.intervals, problem.ld.columns, ends.shape[2]))
    columns[0, :k] = ends[0]
    columns[-1, k : 2 * k] = ends[1]
    return columns
