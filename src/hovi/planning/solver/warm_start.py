"""Warm start of replanning: the first-order change of a solution with its boundary data."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import moved
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.quasi_newton import Smooth, descend
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective

Array = npt.NDArray[np.float64]

CORRECTION_DECREASE = 1e-9
"""Predicted decrease, relative to the action, below which corrections stop."""


def follow(solved: DiscretePath, problem: TrajectoryProblem, corrections: int = 0) -> DiscretePath:
    """The path between new ends, predicted to first order from a stationary path.

    dx = cubic - H^-1 H cubic, with the cubic that takes the old ends to the new ones and H the
    action's Hessian at the old path: one Newton step of the equations linearised there. The cubic
    alone if H is not positive definite.

    solved: a stationary path on the problem's grid, between other ends.
    corrections: maximum number of quasi-Newton steps that follow; they reuse the factorisation of
        H and need one gradient each.
    """
    ends = problem.ends(solved.q, solved.v)
    path = moved(solved, problem.grid, ends, problem.coordinates)
    if not problem.plain:
        return path
    objective = ActionObjective(problem)
    model = objective.model(solved, None, None)
    factor = model.factor(0.0)
    if factor is None:
        return path
    change = _columns(objective, solved, path)
    residual = np.einsum("kijab,kjb->kia", model.intervals.hessian, change)
    step = factor.solve(-model.scatter(residual) - model.gradient)
    predicted = objective.retract(path, step, model)
    return descend(_Action(objective, model), predicted, factor, corrections, CORRECTION_DECREASE)


class _Action(Smooth[DiscretePath]):
    """The discrete action in the coordinates of a model."""

    def __init__(self, objective: ActionObjective, model: QuadraticModel) -> None:
        self.objective = objective
        self.model = model

    def value(self, x: DiscretePath) -> float:
        return self.objective.value(x)

    def gradient(self, x: DiscretePath) -> Array:
        objective = self.objective
        jets = objective.jets(x)
        return self.model.scatter(objective.ld.gradient(x, objective.coordinates, jets))

    def retract(self, x: DiscretePath, step: Array) -> DiscretePath:
        return self.objective.retract(x, step, self.model)


def _columns(objective: ActionObjective, old: DiscretePath, new: DiscretePath) -> Array:
    """Change of the intervals' columns between two paths, 0 for inner modes, shape (N, m, n)."""
    problem = objective.problem
    h = problem.grid.steps[:, None]
    dq, dv = problem.coordinates.difference(old.q, new.q), new.v - old.v
    change = np.zeros((len(h), 4 + problem.grid.inner_modes, dv.shape[1]))
    change[:, 0], change[:, 1] = dq[:-1], h * dv[:-1]
    if objective.coordinates == "nodal":
        change[:, 2], change[:, 3] = dq[1:], h * dv[1:]
    else:
        change[:, 2:4] = h[:, None] ** 2 * (new.z - old.z)
    return change
