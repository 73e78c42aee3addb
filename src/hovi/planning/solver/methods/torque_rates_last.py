"""Limits on the torque rate are imposed only on motions that would exceed them.

Their rows cost as much as all others together, and few motions come near them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath
from hovi.optimize.criteria import Criteria
from hovi.planning.problem.limit_conditions import closeness
from hovi.planning.problem.limits import KINDS, Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.methods.method import Guess
from hovi.planning.solver.status import Status
from hovi.scene.jerk_lagrangian import JerkLagrangian
from hovi.scene.lagrangian import PointTerms
from hovi.system.deadline import Deadline

Solve = Callable[[TrajectoryProblem, Guess, Criteria], Answer]
TORQUE_RATE = "torque_rate"
NEAR_A_RATE = 0.02
"""Distance of a guess from the limits on the torque rate, as a fraction of their range, below which
they are imposed at once where the guess is the motion of a similar problem."""


def with_torque_rates_last(
    solve: Solve, problem: TrajectoryProblem, start: Guess, criteria: Criteria
) -> Answer:
    """The result of a solve without limits on the torque rate; with them if the motion needs them.

    solve: of a problem from a guess with criteria. The second solve begins at the first one's
    motion and on its grid. There is only one if the guess is the motion of a similar problem and
    near such a limit.
    """
    limits, lagrangian = problem.limits, problem.ld.lagrangian
    if limits is None or not isinstance(lagrangian, JerkLagrangian) or not lagrangian.torque_rates:
        return solve(problem, start, criteria)
    if start.near and _margin(problem, limits, start.x) < NEAR_A_RATE:
        return solve(problem, start, criteria)
    deadline = Deadline(criteria.time_limit)
    without = dataclasses.replace(lagrangian, torque_rates=False)
    ld = DiscreteLagrangian(without, problem.grid)
    loose = dataclasses.replace(problem, ld=ld, limits=limits.without(TORQUE_RATE))
    if not loose.limited:
        return solve(problem, start, criteria)
    first = solve(loose, start, criteria)
    full = problem.on(first.problem.grid)
    if first.status is Status.MINIMUM and _margin(full, limits, first.path) < -limits.tolerance:
        left = dataclasses.replace(criteria, time_limit=deadline.seconds_left)
        return solve(full, dataclasses.replace(start, x=first.path, near=True), left).after(first)
    forces = None if first.forces is None else [_with_rates(terms) for terms in first.forces]
    return dataclasses.replace(first, problem=full, forces=forces)


def _margin(problem: TrajectoryProblem, limits: Limits, path: DiscretePath) -> float:
    """Least distance of a path's torque rates from their limits, as a fraction of the range."""
    alone = limits.without(*(kind for kind in KINDS if kind != TORQUE_RATE))
    return float(closeness(problem.trajectory(path), alone).min())


def _with_rates(terms: PointTerms) -> PointTerms:
    """Terms in the torques as terms in the torques and their rates."""
    gradient, weight = terms.output_gradient, terms.output_weight
    return dataclasses.replace(
        terms,
        output_gradient=np.concatenate([gradient, np.zeros_like(gradient)], axis=1),
        output_weight=np.concatenate([weight, np.zeros_like(weight)], axis=1),
    )
