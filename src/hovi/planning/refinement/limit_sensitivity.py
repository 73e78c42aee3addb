"""How far limits move the cost, by their multipliers."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.planning.clearance.clearance import DISTANCE_SCALE
from hovi.planning.problem.limits import TOLERANCE, limited_columns
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.solver import Solution

Array = npt.NDArray[np.float64]

SHIFT = 6.0
"""Shift of a bound, in tolerances: it is tightened by five, and may be exceeded by one."""


def cost_of_tolerance(solution: Solution) -> float:
    """Relative change of the cost with a shift of all limits by SHIFT tolerances.

    An upper bound, since control points are not tightened. 0 without limits, or where none is
    active. It is the smallest error that can be estimated.
    """
    problem = solution.problem
    assert problem is not None
    tolerance = TOLERANCE if problem.limits is None else problem.limits.tolerance
    return SHIFT * tolerance * float(limit_prices(solution).sum())


def limit_prices(solution: Solution) -> Array:
    """Relative change of the cost with every bound per range, shape (2, columns), not negative.

    By the envelope theorem dJ = sum_j h w_j |z_j| range_j, over the quadrature points and the
    bounds that are active there, with their multipliers z_j, and over the control points, whose
    forces at instants of an interval add up. Those of lower bounds come first; columns: of
    (q, v, ..., tau); among obstacles those of q contain the forces of distances, too. 0 without
    limits, or where none is active.
    """
    problem = solution.problem
    assert problem is not None
    jet_range, output_range = _ranges(problem)
    prices = np.zeros((2, len(jet_range) + len(output_range)))
    if not problem.limited or solution.forces is None or solution.cost == 0:
        return prices
    at_points = problem.ld.point_weights
    for weights, terms in zip(at_points, solution.forces, strict=False):
        forces = np.concatenate([terms.jet_gradient, terms.output_gradient], axis=1)
        prices += _by_side(weights[:, None] * forces)
    if solution.instants is not None:
        weights, batches = solution.instants.weights, solution.forces[len(at_points) :]
        forces = np.concatenate([each.jet_gradient for each in batches])
        by_interval = np.zeros((problem.grid.intervals, len(jet_range)))
        np.add.at(by_interval, solution.instants.intervals, weights[:, None] * forces)
        prices[:, : len(jet_range)] += _by_side(by_interval)
    ranges = np.concatenate([jet_range, output_range])
    return np.asarray(prices * ranges / abs(solution.cost))


def _by_side(forces: Array) -> Array:
    """The sums of forces of lower bounds, which are negative, and of upper ones, (2, columns)."""
    return np.stack([np.maximum(-forces, 0.0).sum(axis=0), np.maximum(forces, 0.0).sum(axis=0)])


def _ranges(problem: TrajectoryProblem) -> tuple[Array, Array]:
    """Ranges of the jet, ((k + 1) nv,), and of the outputs; 0 where there is no limit."""
    limits, nv, k = problem.limits, problem.coordinates.nv, problem.ld.k
    jet, outputs = (k + 1) * nv, len(problem.ld.lagrangian.output_weight)
    ranges = np.zeros(jet + 2 * nv)
    if limits is not None:
        bounded = np.flatnonzero(limits.bounded)
        ranges[limited_columns(k, nv)[bounded]] = limits.ranges.ravel()[bounded]
    if problem.distances is not None:
        ranges[:nv] = np.maximum(ranges[:nv], DISTANCE_SCALE)
    ranges[jet + problem.passive] = 0.0  # whose multipliers are those of an equation
    return ranges[:jet], ranges[jet : jet + outputs]
