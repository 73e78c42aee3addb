"""Multipliers of equations with which a solve begins."""

from __future__ import annotations

import math

from hovi.discrete.grid import DiscretePath
from hovi.optimize.banded_model import BandModel
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.equations import Equations
from hovi.planning.solver.multipliers import Multipliers

TORQUE_PENALTY = 10.0
"""Penalty of passive torques, relative to the mean weight of the other joints."""
CONDITION_PENALTY = 1e3
"""Penalty of conditions, relative to the cost, per [rad^2] or [m^2]."""
LEAST_COST = 1e-6
"""Least cost that penalties are relative to."""


def first_multipliers(problem: TrajectoryProblem, path: DiscretePath) -> Multipliers:
    """Zero multipliers; conditions are scaled such that one penalty suits them and torques."""
    scale, penalty = 1.0, first_penalty(problem, path)
    if len(problem.passive) > 0:
        scale = math.sqrt(CONDITION_PENALTY * _cost(problem, path) / penalty)
    return Multipliers.zero(Equations(problem, scale))


def least_squares_multipliers(problem: TrajectoryProblem, path: DiscretePath) -> Multipliers:
    """Those that leave the least gradient: at a near minimum its own, up to its distance."""
    action = ActionObjective(problem, "band", multipliers=first_multipliers(problem, path))
    model = action.model(path, None, None)
    assert isinstance(model, BandModel)
    action.hold(action.kkt(path, model).least_squares_multipliers())
    assert action.multipliers is not None
    return action.multipliers


def first_penalty(problem: TrajectoryProblem, path: DiscretePath) -> float:
    """The penalty of |c|^2 / 2 with which a rough motion may miss equations by a little."""
    if len(problem.passive) > 0:
        return TORQUE_PENALTY * problem.mean_output_weight
    return CONDITION_PENALTY * _cost(problem, path)


def _cost(problem: TrajectoryProblem, path: DiscretePath) -> float:
    return max(abs(problem.ld.action(path)), LEAST_COST)
