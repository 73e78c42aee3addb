"""What a motion violates of its ends, its equations, its limits and its distances, if anything."""

from __future__ import annotations

import numpy as np

from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance_violation import (
    approach_along,
    approach_sentence,
    near_pairs,
)
from hovi.planning.problem.limit_violation import excess_of, worst_sentence
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.notation.goal_turns import turns_missed
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.augmented_lagrangian_rounds import (
    FEASIBLE_RESIDUAL,
    missed_clause,
    within,
)
from hovi.planning.solver.limits.limited_coordinates import LimitedCoordinates
from hovi.planning.solver.outcome.control_polygons import exceeds
from hovi.planning.solver.receding.last_motion import MET, misses


def violation_of(problem: TrajectoryProblem, motion: Trajectory) -> str:
    """The first of what a motion violates, as a clause; "" if ends, equations and limits hold.

    They hold to 1e-6: ends in [rad] and [m], limits relative to their ranges or to their own
    tolerance, passive torques to the largest torque, distances in [m]. Between the nodes, too.
    Raises OutOfTimeError when the deadline in force passes before that is known.
    """
    path = motion.path
    missed = misses(problem, path) or _turns_missed(problem, motion)
    if missed:
        return f"the motion {missed}"
    if problem.unreachable:
        return problem.unreachable
    if problem.constrained:
        residuals = ActionObjective(problem).residuals(path)
        if not within(residuals, FEASIBLE_RESIDUAL, FEASIBLE_RESIDUAL):
            return missed_clause(problem, path, residuals)
    limits = problem.limits
    if limits is not None and _exceeded(motion, limits):
        return worst_sentence(motion, limits, problem.coordinates)
    if problem.distances is None or problem.clearance is None:
        return ""
    margin = float(problem.clearance.margin)
    pairs = near_pairs(motion, problem.distances, margin - MET)
    if len(pairs) == 0:
        return ""
    near = problem.distances.restricted(pairs.tolist())
    return approach_sentence(motion, near, approach_along(motion, near, margin), margin)


def _turns_missed(problem: TrajectoryProblem, motion: Trajectory) -> str:
    """By how many full turns the motion ends away from its goal, as a clause; "" if by none."""
    goal, on = problem.goal, problem.coordinates
    if not isinstance(goal, State) or not on.space.angles:
        return ""
    free = np.asarray(problem.free_ends[:, 0].any(axis=0))
    return turns_missed(goal, on, motion.positions(motion.duration)[0], free)


def _exceeded(motion: Trajectory, limits: Limits) -> bool:
    """Whether a limit is exceeded anywhere: polynomials are compared exactly, torques sampled."""
    if not limits.bounded.any():
        return False
    most = max(MET, limits.tolerance)
    limited = LimitedCoordinates.of(limits, motion.grid, motion.space)
    if exceeds(motion, limits, limited, most):
        return True
    sampled = excess_of(motion, limits, limited.others(limits))
    return not bool(np.max(sampled) <= most)
