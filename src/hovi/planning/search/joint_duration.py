"""The best duration by one solve for the motion and the duration, where a problem supports that.

Also whether a duration is the best one: only then is the motion a minimum.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.time_price import TimePrice
from hovi.planning.problem.tolerance import LAST_BARRIER
from hovi.planning.search.free_duration import (
    DURATION_PRECISION,
    MAX_STRIDE,
    BestDuration,
    FreeDuration,
    SolveFor,
    action_of,
    best_duration,
    ended_search,
)
from hovi.planning.solver.free_duration.joint_solve import solve_jointly, solves_jointly
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import STOPPED, Status

Array = npt.NDArray[np.float64]
OnGrid = Callable[[Grid], SolveFor]
"""Returns a solver on a grid, scaled to each duration."""
JointSolve = Callable[[Solution], Solution | None]
"""Solves for the duration, too, from a motion; None for a problem that does not support it."""

STATIONARY_SLOPE = 1e-9
"""Slope J' + w of a minimum whose duration is the best, relative to (J + w T) / T."""
LARGEST_SLOPE = 1e-7
"""Largest slope J' + w, relative to w, of a motion that is called a minimum, unless its duration is
at a bound, at the edge of feasibility or next to a jump of the cost."""
SLOPE_AMONG_OBSTACLES = 1e-5
"""Largest slope J' + w of a motion that is called a minimum, relative to w, where distances are
bounded, at instants that change with the duration: a duration that is off by as much costs 1e-11
more."""
SMALL_WEIGHT, SLOPE_OF_SMALL_WEIGHT = 1e-2, 1e-4
"""Weight w, relative to J / T, up to which the cost of the motion alone decides, and the largest
slope then, relative to J / T: a duration longer by one percent costs less by 1e-6 at most."""
NEXT_STRIDE = 1.001
"""Ratio of the first two durations of a search that begins near the best one."""
MAX_SEARCHES = 3
"""Maximum number of searches, each on the grid of the motion of the one before."""
_BEST = "The best duration is"


def joint_minimum(
    problem: TrajectoryProblem,
    path: DiscretePath,
    price: TimePrice,
    lengths: Array,
    *,
    max_iterations: int,
    time_limit: float | None,
    near: bool = False,
    barrier: float = LAST_BARRIER,
) -> Solution | None:
    """A minimum in the motion and lengths of parts, or the best motion if the solve was stopped.

    None for a problem that does not support it, or if no minimum was found.
    near: whether the path nearly is a solution. Other arguments as of `solve_jointly`.
    """
    if not solves_jointly(problem, price.clock, lengths, near):
        return None
    found = solve_jointly(
        problem,
        path,
        price,
        lengths,
        max_iterations=max_iterations,
        time_limit=time_limit,
        near=near,
        barrier=barrier,
    )
    return found if found.success or found.status in STOPPED else None


def best_duration_by(
    free: FreeDuration,
    solve: SolveFor,
    first: Solution,
    stride: float = MAX_STRIDE,
    jointly: JointSolve | None = None,
) -> BestDuration:
    """As best_duration, by a joint solve where that finds a minimum.

    A joint minimum is one in the duration, too, or the duration is a bound beyond which J + w T
    decreases. Without one, the duration is searched for by solves for given ones.
    """
    if jointly is None or not first.success:
        return best_duration(free, solve, first, stride)
    ending = _ending(free, first)
    if ending:
        return BestDuration(free, first, first.nit, ending)
    found = jointly(first)
    if found is None:
        return best_duration(free, solve, first, stride)
    best = BestDuration(free, found, first.nit + found.nit, _ending(free, found) or _BEST)
    return best if found.success else best.unfinished(found.status, ended_search(found.status))


def best_on_its_grid(
    free: FreeDuration,
    on_grid: OnGrid,
    first: Solution,
    stride: float = MAX_STRIDE,
    jointly: JointSolve | None = None,
) -> BestDuration:
    """As `best_duration_by`, but a success `is_best`, and UNRESOLVED if no such duration is found.

    A search that ends elsewhere is repeated from its motion, on the grid of that motion.
    """
    found = best_duration_by(free, on_grid(first.trajectory.grid), first, stride, jointly)
    for _ in range(MAX_SEARCHES - 1):
        if not found.solution.success or is_best(found):
            return found
        solve = on_grid(found.solution.trajectory.grid)
        again = best_duration_by(free, solve, found.solution, NEXT_STRIDE, jointly)
        steps = found.steps + again.steps - found.solution.nit
        if not again.solution.success:
            found = unless_best(found, again.solution.status)
            return dataclasses.replace(found, steps=steps)
        found = dataclasses.replace(again, steps=steps)
    return unless_best(found)


def is_best(found: BestDuration) -> bool:
    """Whether J' + w vanishes, or pushes against a bound, the edge of feasibility or a jump.

    The cost jumps where limits or obstacles act at other instants for other durations.
    """
    free = found.free
    slope = free.slope(found.solution)
    density = abs(action_of(found.solution)) / found.solution.trajectory.duration
    small = free.weight <= SMALL_WEIGHT * density
    unit, largest = (density, SLOPE_OF_SMALL_WEIGHT) if small else (free.weight, LARGEST_SLOPE)
    problem = found.solution.problem
    if problem is not None and problem.distances is not None:
        largest = max(largest, SLOPE_AMONG_OBSTACLES)
    steepest = max(largest * unit, found.steepest)
    return abs(slope) <= steepest or found.at_edge or _ending(free, found.solution) != ""


def unless_best(found: BestDuration, status: Status = Status.UNRESOLVED) -> BestDuration:
    """The motion, as a success only if its duration `is_best`. status: of the last search."""
    if not found.solution.success or is_best(found):
        return found
    slope = found.free.slope(found.solution)
    better = "shorter" if slope > 0 else "longer"
    why = f" ({ended_search(status)})" if status in STOPPED else ""
    reason = f"{better} durations cost less by {abs(slope):.2g} per second{why}"
    status = status if status in STOPPED else Status.UNRESOLVED
    return found.unfinished(status, reason)


def _ending(free: FreeDuration, solution: Solution) -> str:
    """Words of the message before the duration of a minimum, if that is the best; else ""."""
    T, slope = free.length(solution), free.slope(solution)
    bound = free.lower if slope > 0 else free.upper
    if abs(T / bound - 1) <= DURATION_PRECISION:
        return "The duration is kept at its bound,"
    total = action_of(solution) + free.weight * T
    return _BEST if abs(slope) <= STATIONARY_SLOPE * abs(total) / T else ""
