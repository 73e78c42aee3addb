"""Up to which residuals equations hold, and what is said where they do not."""

from __future__ import annotations

import numpy as np

from hovi.conditions.condition import Equation, describe, is_spurious, residual, whose
from hovi.conditions.missed_along import worst_along
from hovi.discrete.grid import DiscretePath
from hovi.planning.problem.conditions_of import passive_joints
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.multipliers import Residuals

TORQUE_TOLERANCE = 1e-10
"""Largest passive torque at convergence, relative to the largest torque."""
CONDITION_TOLERANCE = 1e-11
"""Largest residual of a condition at convergence."""
FEASIBLE_RESIDUAL = 1e-6
"""Residual above which a problem counts as infeasible: relative for torques."""


def within(residuals: Residuals, torque_fraction: float, error: float) -> bool:
    """Whether passive torques and conditions are within these tolerances."""
    return residuals.torque_fraction <= torque_fraction and residuals.condition_error <= error


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
    """Passive torques if they are too large, else what is missed most, or holds at a spurious root.

    A sentence without its end, with what to do; "" if the equations hold.
    """
    if within(residuals, FEASIBLE_RESIDUAL, FEASIBLE_RESIDUAL):
        return spurious_sentence(problem, path)
    if residuals.torque_fraction > FEASIBLE_RESIDUAL or not (problem.equations or problem.along):
        return (
            f"no motion was found with zero torque at passive joint {passive_joints(problem)}: the "
            f"remaining torque is {residuals.torque_fraction:.3g} of the largest; allow more time "
            "or change the goal"
        )
    name, missed = _worst(problem, path)
    return (
        f"{name} cannot be met: {missed}; change the goal, increase the duration or try another "
        "initial guess"
    )


def missed_sentence(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """What the motion of an unfinished solve misses, a sentence after a space; "" for nothing."""
    residuals = ActionObjective(problem).residuals(path)
    if within(residuals, FEASIBLE_RESIDUAL, FEASIBLE_RESIDUAL):
        return ""
    if residuals.torque_fraction > FEASIBLE_RESIDUAL or not (problem.equations or problem.along):
        fraction, joint = residuals.torque_fraction, passive_joints(problem)
        return f" So far, the torque at passive joint {joint} is {fraction:.3g} of the largest."
    name, missed = _worst(problem, path)
    return f" So far, {name} is missed: {missed}."


def _worst(problem: TrajectoryProblem, path: DiscretePath) -> tuple[str, str]:
    """The condition that is missed most, a subject, and by how much, a clause."""
    sizes = [float(np.max(np.abs(residual(each, path)))) for each in problem.equations]
    if max(sizes, default=0.0) > FEASIBLE_RESIDUAL:
        worst = problem.equations[int(np.argmax(sizes))]
        missed = describe(worst, path) + _beside(problem, worst)
        return f"{whose(worst)} at t = {worst.where.time:.4g} s", missed
    along = worst_along(problem.along, problem.trajectory(path))
    return along.subject, along.missed


def _beside(problem: TrajectoryProblem, missed: Equation) -> str:
    """Which values are kept where a goal or via point is missed, a clause after a comma, or ""."""
    time = missed.where.time
    kept = {each.name: each.during or (time, time) for each in problem.along}
    names = [repr(name) for name, (begin, end) in kept.items() if begin <= time <= end]
    return f", with {', '.join(names)} kept" if names and missed.name not in kept else ""
