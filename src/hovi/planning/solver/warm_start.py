"""Warm start of replanning: the first-order change of a solution with its boundary data."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
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
    path = problem.moved(solved)
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
        return self.objective.gradient(x, self.model)

    def retract(self, x: DiscretePath, step: Array) -> DiscretePath:
        return self.objective.retract(x, step, self.model)


def _columns(objective: ActionObjective, old: DiscretePath, new: DiscretePath) -> Array:
    """Change of the intervals' columns between two paths, 0 for inner modes, shape (N, m, n)."""
    problem = objective.problem
    h, k = problem.grid.steps[:, None], problem.ld.k
    dq = problem.coordinates.difference(old.q, new.q)
    nodes = np.concatenate([dq[:, None], new.rates - old.rates], axis=1)  # (N + 1, k, n)
    change = np.zeros((len(h), problem.ld.columns, dq.shape[1]))
    powers = (h ** np.arange(k))[:, :, None]
    change[:, :k] = powers * nodes[:-1]
    if objective.coordinates == "nodal":
        change[:, k : 2 * k] = powers * nodes[1:]
    else:
        change[:, k : 2 * k] = h[:, None] ** k * (new.z - old.z)
    return change
