"""Faults of a discrete minimum that its own curve, between the quadrature points, shows."""

from __future__ import annotations

import numpy as np

from hovi.conditions.missed_along import worst_along
from hovi.discrete.curve_integral import integral_along
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.between_nodes import NEGLIGIBLE_FRACTION, passive_torque
from hovi.planning.solver.outcome.cost_with_time import cost_of, price_of_time
from hovi.planning.solver.solver import Solution
from hovi.schemes import is_galerkin

RESOLVED = 0.01
"""Largest relative difference of costs for a success."""


def fault_on_curve(solution: Solution) -> str:
    """What differs between the points and the curve, the cost or an equation; "" if none does.

    Of Galerkin tables, whose curve is their own.
    """
    problem, trajectory = solution.problem, solution.trajectory
    assert problem is not None
    if not has_own_curve(problem):
        return ""
    return _fault_of_integral(solution, problem) or _fault_of_equations(problem, trajectory)


def difference_on_curve(solution: Solution) -> float:
    """The relative difference of the cost at the points and along the curve.

    0 without a curve of its own, infinite with equations along it, which are looked at anew.
    """
    problem = solution.problem
    assert problem is not None
    if len(problem.passive) > 0 or problem.along:
        return np.inf
    if not has_own_curve(problem):
        return 0.0
    action, integral = costs_on_curve(solution, problem)
    return abs(action - integral) / max(abs(integral), problem.negligible_cost, 1e-300)


def has_own_curve(problem: TrajectoryProblem) -> bool:
    """Whether the curve is that of the scheme, as of Galerkin tables."""
    return all(is_galerkin(scheme) for scheme, _ in problem.grid.groups)


def costs_on_curve(solution: Solution, problem: TrajectoryProblem) -> tuple[float, float]:
    """The cost by the action, and by the integral of L~ along the curve."""
    integral = integral_along(problem.ld.lagrangian, solution.trajectory).value
    return cost_of(problem, solution.trajectory.path), integral + price_of_time(problem)


def fault_of_period(solution: Solution) -> str:
    """Why a periodic motion is not one at the joints that are held; "" if it is.

    Their p is the same at both ends if what is held is the phase, or along a symmetry, alone.
    """
    problem, p = solution.problem, solution.trajectory.momenta
    assert problem is not None
    if not problem.periodic:
        return ""
    jump = np.abs(p[-1, 0] - p[0, 0]) * ~problem.free_ends[0, 0]
    powers = problem.grid.duration ** -np.arange(p.shape[1])
    largest = float(np.max(np.abs(p) * powers[:, None]))
    i = int(np.argmax(jump))
    if jump[i] <= RESOLVED * largest:
        return ""
    held = problem.ends[0][0][i]
    return (
        f"{problem.coordinates.coordinate_names[i]!r} is held at {held:.4g} by a force, since its "
        f"momentum jumps from {p[-1, 0, i]:.4g} to {p[0, 0, i]:.4g} after a period, as at a point "
        "that no periodic motion near the guess passes: hold another joint, or another position"
    )


def _fault_of_integral(solution: Solution, problem: TrajectoryProblem) -> str:
    """The costs at the points and along the curve; "" if they agree."""
    accuracy, estimate = solution.accuracy, solution.error_estimate
    if accuracy is not None and estimate is not None and accuracy.along + estimate <= RESOLVED:
        return ""  # both are that close to the cost of the same finer solution
    action, integral = costs_on_curve(solution, problem)
    if abs(action - integral) <= RESOLVED * max(abs(integral), problem.negligible_cost):
        return ""
    return (
        f"its cost is {action:.6g} at the quadrature points, but {integral:.6g} along its own curve"
    )


def costs_nothing(solution: Solution) -> bool:
    """Whether the cost is one of rounding errors, whose relative error says nothing."""
    assert solution.problem is not None
    known = solution.error_estimate is not None
    return known and abs(solution.cost) <= RESOLVED * solution.problem.negligible_cost


def _fault_of_equations(problem: TrajectoryProblem, trajectory: Trajectory) -> str:
    """An equation that is missed between the nodes, or the torque of a passive joint; or ""."""
    if problem.along:
        worst = worst_along(problem.along, trajectory)
        if worst.clause:
            return f"{worst.subject} does not hold between the nodes: {worst.clause}"
    found = passive_torque(problem, trajectory)
    if found is None or found.fraction <= NEGLIGIBLE_FRACTION:
        return ""
    return (
        f"joint {found.joint!r} is passive, but carries up to {found.torque:.3g} N m between the "
        f"quadrature points, where other joints carry at most {found.largest:.3g}"
    )
