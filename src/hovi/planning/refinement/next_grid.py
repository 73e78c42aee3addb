"""The next grid of a refinement, and the initial motion on it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import MORE_MODES, DiscretePath, Grid
from hovi.discrete.guess import stretched
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import CURVE_TOLERANCE, Quantity
from hovi.planning.refinement.candidate import Candidate, contributions
from hovi.planning.refinement.error_estimate import FinerSolution, estimate_against
from hovi.planning.refinement.hp_refinement import UNRESOLVED_MODES, Demand, decay, refined

Array = npt.NDArray[np.float64]

TARGET_FRACTION = 0.3
"""Error for which a grid is refined, as a fraction of the tolerance."""
MAX_ERROR_OF_DECAY = 1e-2
"""Relative error of the cost up to which the decay of the modes is that of the motion."""
FINER_GRID_RATIO = 2.5
"""Ratio of the finer solution's predicted error to the error for which a grid is refined up to
which its grid is the next: the solution is known already, and estimating its error is cheap."""
WORSE_BETWEEN = 3.0
"""Ratio of the error in an interval to that at its nodes above which the curve there is refined."""


def next_grid(candidate: Candidate) -> Grid:
    """A grid that is predicted to be just fine enough, or that of the finer solution."""
    problem, finer = candidate.solution.problem, candidate.finer
    assert problem is not None
    if finer is None:
        return problem.grid.halved()
    demands = [*_demands(candidate, finer), *_demands_of_equations(candidate)]
    rho = _decay(candidate, finer)
    error = np.inf if candidate.error_of_cost is None else candidate.error_of_cost
    decay_known = error <= MAX_ERROR_OF_DECAY
    # with larger errors torques could hide between them, and joints that equations leave free spin
    few_points = error <= CURVE_TOLERANCE and not problem.along
    same_steps = np.array_equal(problem.grid.steps, finer.problem.grid.steps)
    # with all intervals halved, as under limits, its own estimate would need twice as many again
    usable = same_steps and (decay_known or finer.problem.grid.inner_modes <= UNRESOLVED_MODES)
    change = rho**MORE_MODES
    if usable and all(demand.remaining(change) <= FINER_GRID_RATIO for demand in demands):
        return finer.problem.grid
    grid = refined(problem.grid, rho, demands, problem.coordinates.nv, decay_known, few_points)
    if not _same_grid(grid, problem.grid):
        return grid
    if decay_known or grid.inner_modes < UNRESOLVED_MODES:
        return grid.enriched(MORE_MODES)
    return grid.halved()


def interpolated_to(finer: FinerSolution, problem: TrajectoryProblem) -> DiscretePath:
    """The finer solution's curve on another grid of the same problem."""
    grid, path = problem.grid, finer.path
    if np.array_equal(grid.steps, finer.problem.grid.steps):
        inner = np.zeros((grid.intervals, grid.inner_modes, path.v.shape[1]))
        for scheme, index in grid.groups:
            r = min(scheme.inner_modes, path.inner.shape[1])
            inner[index, :r] = path.inner[index, :r]
        return DiscretePath(path.q, path.v, path.z, inner, path.higher)
    curve = stretched(finer.trajectory, grid.duration, problem.ld.k)
    return problem.path(curve)


def _demands(candidate: Candidate, finer: FinerSolution) -> list[Demand]:
    """The reduction of the error that each interval needs."""
    known = contributions(finer)
    N, target = len(known), TARGET_FRACTION * candidate.tolerance.size
    if candidate.tolerance.quantity is Quantity.COST:
        error = candidate.error
        if error <= target:  # then only the integral along the curve is not accurate enough
            error = candidate.along
        scale = max(1.0, error / max(known.sum(), 1e-300))
        return [Demand(target / (N * np.maximum(scale * known, 1e-300)), 2)]
    return _demands_on_curve(candidate, finer, known)


def _demands_of_equations(candidate: Candidate) -> list[Demand]:
    """The reduction of what equations are missed by that each interval needs."""
    if candidate.missed is None:
        return []
    return [Demand(TARGET_FRACTION / np.maximum(candidate.missed.by_interval, 1e-300), 1)]


def _demands_on_curve(candidate: Candidate, finer: FinerSolution, known: Array) -> list[Demand]:
    """Reductions for the curve where it is worse than the nearby nodes, and for the nodes."""
    tolerance = candidate.tolerance
    estimate = estimate_against(candidate.solution, finer, tolerance.frame)
    if tolerance.quantity is Quantity.FRAME:
        along, ends = estimate.tip, estimate.tip_at_nodes
    else:
        along, ends = estimate.q.max(axis=1), estimate.q_at_nodes.max(axis=1)
    target = TARGET_FRACTION * tolerance.size
    nearby = np.maximum(ends[:-1], ends[1:])
    own = np.where(along > WORSE_BETWEEN * nearby, along, 0.0)
    nodes = target / max(float(ends.max()), 1e-300)
    relative = known * len(known) / max(known.sum(), 1e-300)
    return [
        Demand(target / np.maximum(own, 1e-300), 1),
        Demand(nodes / np.maximum(relative, 1e-300), 2),
    ]


def _decay(candidate: Candidate, finer: FinerSolution) -> Array:
    """Decay of the finer solution if it has the same intervals, else of the solution itself."""
    grid = candidate.solution.trajectory.grid
    if np.array_equal(grid.steps, finer.problem.grid.steps):
        return decay(finer.problem.grid, finer.path)
    return decay(grid, candidate.solution.trajectory.path)


def _same_grid(one: Grid, other: Grid) -> bool:
    """Whether two grids have the same intervals with the same modes, so the same error."""
    same_steps = np.array_equal(one.steps, other.steps)
    return same_steps and all(
        a.inner_modes == b.inner_modes for a, b in zip(one.schemes, other.schemes, strict=True)
    )
