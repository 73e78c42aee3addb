"""How far the tolerance of limits moves the cost: the smallest error that can be estimated."""

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

    By the envelope theorem dJ = sum_j h w_j |z_j| range_j SHIFT tolerance, over the quadrature
    points and the bounds that are active there, with their multipliers z_j, and over the control
    points, whose forces at instants of an interval add up: an upper bound, since these are not
    tightened. 0 without limits, or where none is active.
    """
    problem = solution.problem
    assert problem is not None
    if not problem.limited or solution.forces is None or solution.cost == 0:
        return 0.0
    tolerance = TOLERANCE if problem.limits is None else problem.limits.tolerance
    jet_range, output_range = _ranges(problem)
    change, at_points = 0.0, problem.ld.point_weights
    for weights, terms in zip(at_points, solution.forces, strict=False):
        per_point = np.abs(terms.jet_gradient) @ jet_range
        per_point += np.abs(terms.output_gradient) @ output_range
        change += float(weights @ per_point)
    if solution.instants is not None:
        weights, terms = solution.instants.weights, solution.forces[len(at_points)]
        forces = np.zeros((problem.grid.intervals, len(jet_range)))
        np.add.at(forces, solution.instants.intervals, weights[:, None] * terms.jet_gradient)
        change += float((np.abs(forces) @ jet_range).sum())
    return SHIFT * tolerance * change / abs(solution.cost)


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
