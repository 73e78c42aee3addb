"""What problems of an order of the Lagrangian support, and of a robot without inertia."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hovi.conditions.asked import as_conditions, need_torques
from hovi.conditions.condition import Equation
from hovi.conditions.places import Along
from hovi.discrete.state import Periodic
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.notation.summaries import ProblemSummary
from hovi.scene.scene import require_plannable

LIMITED_ORDERS = 2, 3
"""Orders of the Lagrangians whose problems may have limits, obstacles, via points and frames."""


def require_supported(problem: ProblemSummary, order: int) -> None:
    """Raise InputError for what a Lagrangian of this order does not support."""
    limits = problem.limits
    as_conditions(tuple(dict.fromkeys((*problem.conditions, *problem.bounds))))  # of unlike names
    wanted = {
        "limits": limits is not None and bool(limits.bounded.any()),
        "obstacles": problem.clearance is not None and problem.clearance.wanted,
        "via points": bool(problem.via),
        "conditions": bool(problem.conditions or problem.bounds),
        "goals of frames": isinstance(problem.goal, FrameGoal),
    }
    named = [what for what, is_wanted in wanted.items() if is_wanted]
    if order not in LIMITED_ORDERS and named:
        raise InputError(
            f"{' and '.join(named)} need a Lagrangian of order 2 or 3, and this one is of order "
            f"{order}: leave them out."
        )
    periodic = isinstance(problem.goal, Periodic)
    for each in problem.conditions:
        if isinstance(each.where, Along) and (order != 2 or periodic):
            what = "a periodic motion" if periodic else f"a cost of order {order} (smooth=True)"
            raise InputError(
                f"condition {each.name!r} is an equation at all times, which {what} does not "
                'support: leave it out, or give it room, such as within="2 mm", or a hovi.Between '
                "or hovi.AtTimes in place of a hovi.Equal."
            )
    if limits is not None:
        limits.require_order(order)
    if need_torques(problem.bounds) and not problem.scenes:
        raise InputError(
            "a condition on torques needs a Lagrangian of a scene, and this one is about no robot: "
            "leave it out, or name q, v, a and t alone."
        )


def require_free(asked: Sequence[Equation], problem: Any) -> None:
    """Raise InputError for equations of conditions at a node whose state is given."""
    last = problem.grid.intervals
    for each in asked:
        given = each.where.node == last and not problem.free_ends[1].any()
        if given or problem.periodic:
            what = "of a periodic motion" if problem.periodic else "where the goal gives the state"
            raise InputError(
                f"condition {each.name!r} is asked at t = {each.where.time:g} s {what}: leave it "
                "out, or leave something free there."
            )


def require_given_duration(problem: Any) -> None:
    """Raise InputError for equations at all times that other durations would change."""
    for each in problem.along:
        if each.where.level > 0 or each.timed:
            what = "time" if each.timed else ("velocities", "accelerations")[each.where.level - 1]
            raise InputError(
                f"condition {each.name!r} is an equation of {what} at all times, which needs a "
                "given duration: give it as one number."
            )


def require_dynamics(problem: ProblemSummary) -> None:
    """Raise ModelError for a robot without moving joints, or without inertia if torques matter."""
    for scene in problem.scenes:
        require_plannable(scene, needs_torques(problem))


def needs_torques(problem: ProblemSummary) -> bool:
    """Whether torques are part of the cost, are bounded, or vanish at passive joints."""
    limits = problem.limits
    bounded = limits is not None and limits.on_torques
    bounded = bounded or need_torques(problem.bounds)
    passive = any(scene.passive for scene in problem.scenes)
    return bounded or passive or problem.ld.lagrangian.needs_torques
