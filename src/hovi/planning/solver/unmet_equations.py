"""Tolerances of equations: of passive torques and conditions at nodes; and which are violated."""

from __future__ import annotations

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.planning.conditions.condition import Equation, describe, is_spurious, whose
from hovi.planning.problem.conditions_of import passive_joints
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.multipliers import Residuals

TORQUE_TOLERANCE = 1e-10
"""Largest passive torque at convergence, relative to the largest torque."""
NODE_TOLERANCE = 1e-11
"""Largest residual of a condition at convergence, in [rad] or [m]."""
FEASIBLE_RESIDUAL = 1e-6
"""Residual above which a problem counts as infeasible: relative for torques, else [rad] or [m]."""


def within(residuals: Residuals, torque_fraction: float, node_error: float) -> bool:
    """Whether passive torques and conditions at nodes are within these tolerances."""
    return residuals.torque_fraction <= torque_fraction and residuals.node_error <= node_error


def spurious_sentence(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """Which condition holds at a spurious root, as a sentence without its end; "" if none does."""
    for each in problem.equations:
        if is_spurious(each, path):
            return (
                f"the frame is half a turn away from its goal at t = {each.where.time:.4g} s: "
                f"{describe(each, path)}; try another initial guess"
            )
    return ""


def unmet_sentence(problem: TrajectoryProblem, path: DiscretePath, residuals: Residuals) -> str:
    """Passive torques if they are too large, else the goal that is missed most, and what to do.

    A sentence without its end.
    """
    if residuals.torque_fraction > FEASIBLE_RESIDUAL or not problem.equations:
        return (
            f"no motion was found with zero torque at passive joint {passive_joints(problem)}: the "
            f"remaining torque is {residuals.torque_fraction:.3g} of the largest; allow more time "
            "or change the goal"
        )
    worst = _worst(problem, residuals)
    return (
        f"{whose(worst)} at t = {worst.where.time:.4g} s cannot be met: {describe(worst, path)}; "
        "change the goal, increase the duration or try another initial guess"
    )


def missed_sentence(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """What the motion of an unfinished solve misses, a sentence after a space; "" for nothing."""
    residuals = ActionObjective(problem).residuals(path)
    if within(residuals, FEASIBLE_RESIDUAL, FEASIBLE_RESIDUAL):
        return ""
    if residuals.torque_fraction > FEASIBLE_RESIDUAL or not problem.equations:
        fraction, joint = residuals.torque_fraction, passive_joints(problem)
        return f" So far, the torque at passive joint {joint} is {fraction:.3g} of the largest."
    worst = _worst(problem, residuals)
    where = f"{whose(worst)} at t = {worst.where.time:.4g} s"
    return f" So far, {where} is missed: {describe(worst, path)}."


def _worst(problem: TrajectoryProblem, residuals: Residuals) -> Equation:
    """The condition at a node that is missed most."""
    sizes = [float(np.max(np.abs(c), initial=0.0)) for c in residuals.nodes]
    return problem.equations[int(np.argmax(sizes))]
