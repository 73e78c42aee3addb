"""All that a problem asks of a motion, as conditions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from hovi.planning.conditions.condition import Condition
from hovi.planning.conditions.joint_quantity import JointQuantity
from hovi.planning.conditions.pair_distances import PairDistances
from hovi.planning.conditions.places import Along, Exchange
from hovi.planning.conditions.sets import Between, Equal
from hovi.planning.problem.limit_conditions import limit_conditions
from hovi.planning.problem.problem import TrajectoryProblem


def conditions_of(problem: TrajectoryProblem) -> Iterator[Condition[Any, Any]]:
    """The conditions between the ends of a motion, in the order in which it is compared with them.

    No torque at passive joints; equations at nodes; limits; bounds of functions; distances.
    """
    if len(problem.passive) > 0:
        names = ", ".join(repr(joint) for joint in problem.scene.passive)
        yield Condition(JointQuantity("tau", problem.passive), Equal(), Along(), names)
    yield from problem.equations
    if problem.limits is not None:
        on = problem.coordinates
        yield from limit_conditions(problem.limits, problem.grid.order, on.curved_space, on)
    yield from problem.bounds
    if problem.distances is not None:
        assert problem.clearance is not None
        apart = Between(lower=float(problem.clearance.margin))
        yield Condition(PairDistances(problem.distances), apart, Exchange(), "distances", "m", 1.0)
