"""What a motion violates of its ends, its equations, its limits and its distances, if anything."""

from __future__ import annotations

from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.requirements.requirements_of import requirements_of


def violation_of(problem: TrajectoryProblem, motion: Trajectory) -> str:
    """The first of what a motion violates, as a clause; "" if all that is required holds.

    They hold to 1e-6: ends in [rad] and [m], limits relative to their ranges or to their own
    tolerance, passive torques to the largest torque, distances in [m]. Between the nodes, too.
    Raises OutOfTimeError when the deadline in force passes before that is known.
    """
    found = (each.violation(motion) for each in requirements_of(problem))
    return next(filter(None, found), "")
