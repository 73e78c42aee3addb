"""Warm start of replanning: the first-order change of a solution with its boundary data."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import Ends
from hovi.optimize.banded_model import BandModel
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.schemes.scheme import regular_from_nodal

Array = npt.NDArray[np.float64]


def follow(
    solved: DiscretePath, problem: TrajectoryProblem, known: QuadraticModel | None = None
) -> DiscretePath:
    """The path between new ends, predicted to first order from a stationary path.

    dx = e - H^-1 (H e + g), with e the change of the end nodes alone, and g the gradient and H the
    Hessian of the action at the old path: one Newton step of the equations linearised there. Where
    H is not positive definite, or not only the ends are fixed, a cubic takes the old ends to the
    new ones.

    solved: a path on the problem's grid between other ends, stationary if a model is known.
    known: the banded model near it with which it was found; computed at it if None, or if its
        unknowns are not those of the problem.
    """
    if not problem.plain:
        return problem.moved(solved)
    objective = ActionObjective(problem)
    if not (isinstance(known, BandModel) and known.layout is problem.structure.layout):
        known = None
    model = objective.model(solved, None, None) if known is None else known
    factor = model.factor(0.0)
    if factor is None:
        return problem.moved(solved)
    ends = problem.ends
    change = _columns(objective, solved, ends)
    residual, ends_of = np.zeros_like(change), [0, -1]  # the only intervals with fixed columns
    hessian = model.intervals.hessian[ends_of]
    residual[ends_of] = np.einsum("kijab,kjb->kia", hessian, change[ends_of])
    slope = model.scatter(residual)
    if known is None:
        slope = slope + model.gradient
    change -= model.gather(factor.solve(slope))
    return _with_ends(objective.moved(solved, change), ends)


def _columns(objective: ActionObjective, old: DiscretePath, ends: Ends) -> Array:
    """Change of the intervals' columns where the end nodes alone are moved, shape (N, m, n)."""
    problem = objective.problem
    h, k = problem.grid.steps[[0, -1]], problem.ld.k
    dq = problem.coordinates.difference(old.q[[0, -1]], ends[0])
    rates = [new - old.rates[[0, -1], j] for j, new in enumerate(ends[1:])]
    nodes = np.stack([dq, *rates], axis=1) * (h[:, None] ** np.arange(k))[:, :, None]
    change = np.zeros((problem.grid.intervals, problem.ld.columns, nodes.shape[2]))
    change[0, :k], change[-1, k : 2 * k] = nodes
    if objective.coordinates == "regular":
        change[[0, -1], : 2 * k] = regular_from_nodal(0, k) @ change[[0, -1], : 2 * k]
    return change


def _with_ends(path: DiscretePath, ends: Ends) -> DiscretePath:
    """A path with exactly these ends, which it has but for rounding errors."""
    for mine, new in zip((path.q, path.v), ends, strict=False):
        mine[[0, -1]] = new
    for j, new in enumerate(ends[2:]):
        path.higher[[0, -1], j] = new
    return path
