"""What problems of an order of the Lagrangian support, and of a robot without inertia."""

from __future__ import annotations

from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.notation.summaries import ProblemSummary
from hovi.scene.scene import require_plannable

LIMITED_ORDERS = 2, 3
"""Orders of the Lagrangians whose problems may have limits, obstacles, via points and frames."""


def require_supported(problem: ProblemSummary, order: int) -> None:
    """Raise InputError for what a Lagrangian of this order does not support."""
    limits = problem.limits
    wanted = {
        "limits": limits is not None and bool(limits.bounded.any()),
        "obstacles": problem.clearance is not None and problem.clearance.wanted,
        "via points": bool(problem.via),
        "goals of frames": isinstance(problem.goal, FrameGoal),
    }
    named = [what for what, is_wanted in wanted.items() if is_wanted]
    if order not in LIMITED_ORDERS and named:
        raise InputError(
            f"{' and '.join(named)} need a Lagrangian of order 2 or 3, and this one is of order "
            f"{order}: leave them out."
        )
    if limits is not None:
        limits.require_order(order)


def require_dynamics(problem: ProblemSummary) -> None:
    """Raise ModelError for a robot without moving joints, or without inertia if torques matter."""
    for scene in problem.scenes:
        require_plannable(scene, needs_torques(problem))


def needs_torques(problem: ProblemSummary) -> bool:
    """Whether torques are part of the cost, are bounded, or vanish at passive joints."""
    limits = problem.limits
    bounded = limits is not None and limits.on_torques
    passive = any(scene.passive for scene in problem.scenes)
    return bounded or passive or problem.ld.lagrangian.needs_torques
