"""Where a stationary motion goes when its boundary data move: the guess of a planning loop."""

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

ENOUGH = 1e-9
"""Corrections end when they promise a smaller decrease than this, relative to the action."""


def follow(solved: DiscretePath, problem: TrajectoryProblem, corrections: int = 0) -> DiscretePath:
    """Where a stationary path goes when its boundary data move.

    To first order it is dx = cubic - H^-1 H cubic, with the cubic that carries the old ends to the
    new ones and H the action's Hessian at the old path: one Newton step of the equations linearised
    there. Just the cubic where H is not positive definite.

    solved: a stationary path on the problem's grid, between other ends.
    corrections: how many quasi-Newton steps may follow, which begin with H's factorisation and
        cost a gradient each.
    """
    ends = problem.ends(solved.q, solved.v)
    path = moved(solved, problem.grid, ends, problem.robot)
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
    ahead = objective.retract(path, step, model)
    return descend(_Action(objective, model), ahead, factor, corrections, ENOUGH)


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
    """How the intervals' columns change from one path to another, inner modes kept, (N, m, n)."""
    problem = objective.problem
    h = problem.grid.steps[:, None]
    dq, dv = problem.robot.difference(old.q, new.q), new.v - old.v
    change = np.zeros((len(h), 4 + problem.grid.inner_modes, dv.shape[1]))
    change[:, 0], change[:, 1] = dq[:-1], h * dv[:-1]
    if objective.coordinates == "nodal":
        change[:, 2], change[:, 3] = dq[1:], h * dv[1:]
    else:
        change[:, 2:4] = h[:, None] ** 2 * (new.z - old.z)
    return change
