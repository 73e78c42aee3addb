"""Multipliers of equations with which a solve begins."""

from __future__ import annotations

import math

from hovi.discrete.grid import DiscretePath
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.equations import Equations
from hovi.planning.solver.multipliers import Multipliers

CONDITION_SCALE = 10.0
"""What a condition that is missed by 1 rad or 1 m counts beside a passive torque, relative to the
torque whose effort is the cost."""


def first_multipliers(problem: TrajectoryProblem, path: DiscretePath) -> Multipliers:
    """Zero multipliers, with a scale of conditions beside torques from the cost of a path."""
    scale = 1.0
    if len(problem.passive) > 0 and (problem.equations or problem.along):
        cost = max(abs(problem.ld.action(path)), 1e-6)
        scale = CONDITION_SCALE * math.sqrt(cost / problem.mean_output_weight)
    return Multipliers.zero(Equations(problem, scale))
