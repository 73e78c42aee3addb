"""What a motion violates of its ends and of the conditions of its problem, if anything."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from hovi.conditions.condition import Condition, missed, whose
from hovi.conditions.excess import excess_of, worst
from hovi.conditions.missed_along import worst_along
from hovi.conditions.places import Along, AtNode, AtPoints, ControlPoints, Exchange
from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance_violation import (
    approach_along,
    approach_sentence,
    near_pairs,
)
from hovi.planning.problem.conditions_of import conditions_of
from hovi.planning.problem.pair_distances import PairDistances
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.outcome.control_polygons import exceeds
from hovi.planning.solver.outcome.ends import turns_missed_by

Violation = Callable[[Condition[Any, Any], Trajectory, TrajectoryProblem], str]
"""What a motion violates of a condition of a problem, as a clause; "" if it is satisfied."""


def violation_of(problem: TrajectoryProblem, motion: Trajectory) -> str:
    """The first of what a motion violates, as a clause; "" if all that is asked holds.

    It holds to 1e-6: ends and equations in [rad] and [m], limits and other bounds relative to their
    scales or to their own tolerance, passive torques to the largest torque, distances in [m].
    Between the nodes, too.
    Raises OutOfTimeError when the deadline in force passes before that is known.
    """
    violated = problem.unreachable or first_violated(conditions_of(problem), problem, motion)
    return violated or turns_missed_by(problem, motion)


def first_violated(
    asked: Iterable[Condition[Any, Any]], problem: TrajectoryProblem, motion: Trajectory
) -> str:
    """As `violation_of`, of some conditions of a problem."""
    found = (VIOLATIONS[type(each.where)](each, motion, problem) for each in asked)
    return next(filter(None, found), "")


def _at_node(given: Condition[Any, Any], motion: Trajectory, problem: TrajectoryProblem) -> str:
    clause, where = missed(given, motion.path), given.where
    if where.given:
        return clause and f"the motion {clause}"
    return clause and f"{whose(given)} at t = {where.time:.4g} s is missed: {clause}"


def _at_all_times(
    given: Condition[Any, Any], motion: Trajectory, problem: TrajectoryProblem
) -> str:
    """By samples."""
    return worst(motion, given)[1] if not excess_of(motion, given).max() <= given.tolerance else ""


def _by_control_points(
    given: Condition[Any, Any], motion: Trajectory, problem: TrajectoryProblem
) -> str:
    """Exactly, by control polygons that are halved."""
    return worst(motion, given)[1] if exceeds(motion, given) else ""


def _by_approaches(
    given: Condition[Any, Any], motion: Trajectory, problem: TrajectoryProblem
) -> str:
    """By the instants at which pairs come closest."""
    distances, margin = given.y, float(given.on.lower[0])
    assert isinstance(distances, PairDistances)
    pairs = near_pairs(motion, distances.distances, margin - given.tolerance)
    if len(pairs) == 0:
        return ""
    near = distances.distances.restricted(pairs.tolist())
    return approach_sentence(motion, near, approach_along(motion, near, margin), margin)


def _along(given: Condition[Any, Any], motion: Trajectory, problem: TrajectoryProblem) -> str:
    """Of values by samples; of passive torques by moments, relative to the largest torque."""
    if "tau" not in given.y.needs:
        found = worst_along([given], motion)
        return found.clause and f"{found.subject} is violated: {found.clause}"
    fraction = ActionObjective(problem).residuals(motion.path).torque_fraction
    if fraction <= given.tolerance:
        return ""
    return f"the torque at passive joint {given.name} is {fraction:.3g} of the largest"


VIOLATIONS: dict[type, Violation] = {
    AtNode: _at_node,
    AtPoints: _at_all_times,
    ControlPoints: _by_control_points,
    Exchange: _by_approaches,
    Along: _along,
}
"""How a violation is found, by where a condition holds."""
