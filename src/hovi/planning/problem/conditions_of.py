"""All that a problem asks of a motion, as conditions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from hovi.conditions.condition import Condition, Equation
from hovi.conditions.joint_quantity import DERIVATIVES, JointQuantity
from hovi.conditions.places import Along, AtNode, Exchange
from hovi.conditions.sets import Between, Equal
from hovi.conditions.state_difference import StateDifference
from hovi.planning.problem.limit_conditions import limit_conditions
from hovi.planning.problem.pair_distances import PairDistances
from hovi.planning.problem.problem import TrajectoryProblem


def conditions_of(problem: TrajectoryProblem) -> Iterator[Condition[Any, Any]]:
    """The conditions of a motion, in the order in which it is compared with them.

    States at both ends and at seams; those `between_ends`.
    """
    yield from ends_of(problem)
    yield from between_ends(problem)


def ends_of(problem: TrajectoryProblem) -> Iterator[Equation]:
    """What is given at the start, and at the goal unless the motion is periodic."""
    sides = (0, "starts", 0), (1, "ends", problem.grid.intervals)
    for end, verb, node in sides[: 1 if problem.periodic else 2]:
        jet = [x[end] for x in problem.ends[: len(DERIVATIVES)]]
        held = ~problem.free_ends[end, : len(jet)]
        y = StateDifference(problem.coordinates, jet, held, verb)
        yield Condition(y, Equal(), AtNode(node, float(problem.grid.t[node]), True))


def between_ends(problem: TrajectoryProblem) -> Iterator[Condition[Any, Any]]:
    """What is asked of a motion that has its ends.

    What is given at seams; no torque at passive joints; equations at nodes; limits; bounds of
    functions; distances. Those at all times follow equations at nodes, among which are theirs.
    """
    for hold in problem.holds:
        verb = f"passes t = {hold.time:.4g} s"
        y = StateDifference(problem.coordinates, (hold.q, hold.v), hold.fixed, verb)
        yield Condition(y, Equal(), AtNode(hold.node, hold.time, True))
    if len(problem.passive) > 0:
        torque, names = JointQuantity("tau", problem.passive), passive_joints(problem)
        yield Condition(torque, Equal(), Along(2), names)
    yield from problem.equations
    yield from problem.along
    if problem.limits is not None:
        on = problem.coordinates
        yield from limit_conditions(problem.limits, problem.grid.order, on.curved_space, on)
    yield from problem.bounds
    if problem.distances is not None:
        assert problem.clearance is not None
        apart = Between(lower=float(problem.clearance.margin))
        yield Condition(PairDistances(problem.distances), apart, Exchange(), "distances", "m", 1.0)


def passive_joints(problem: TrajectoryProblem) -> str:
    """The names of the passive joints."""
    return ", ".join(repr(joint) for joint in problem.scene.passive)
