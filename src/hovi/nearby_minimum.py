"""The minimum of the discrete action next to a path that is nearly one, by few Hessians.

Newton's method with Hessians that are kept while they serve: from nearby, a gradient and a step
with the known factors gain as much as a step of the optimiser, and cost less.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from hovi.grid import DiscretePath
from hovi.optimize.quadratic_model import Factor, QuadraticModel
from hovi.solver import Solution, minimum_at
from hovi.trajectory_objective import ActionObjective

HESSIANS = 4
"""That may be factored before the search is given up."""
CORRECTIONS = 3
"""Steps with one Hessian."""
CONTRACTION = 0.3
"""Ratio of the lengths of successive steps above which the Hessian is renewed."""
NEGLIGIBLE = 0.02
"""Length of a step, as a share of the whole way, that makes it the last of an approach."""
ROUNDING = 1e-15
"""Length of a step, relative to the data, below which nothing is left to gain."""
POLISHES = 8
"""Steps with the last Hessian until only rounding is left."""
SETTLED = 1e-8
"""Length of a step that may be left where it does not shrink any more."""
FAR = 1e-2
"""Length of a way beyond which the Hessian at its end is factored again: it is that which tells a
minimum."""


@dataclass(frozen=True, eq=False)
class NearbyMinimum:
    """Where an approach ended: near a minimum, to a small share of the way.

    objective: what is minimised. path: its end. value: the action there, to first order in what
        is left of the way.
    model, factor: the last Hessian. way: length of the steps that were taken with it, the last of
        length `last`.
    steps: how many were taken in all. began: by the performance counter, in [s].
    """

    objective: ActionObjective
    path: DiscretePath
    value: float
    model: QuadraticModel
    factor: Factor
    way: float
    last: float
    steps: int
    began: float

    def solution(self) -> Solution | None:
        """The minimum, as exact as rounding lets it be; None where that fails."""
        objective, x, length = self.objective, self.path, self.last
        model: QuadraticModel = self.model
        factor: Factor | None = self.factor
        if self.way > FAR:
            model, length = objective.model(x, None, None), np.inf
            factor = model.factor(0.0)
        if factor is None:
            return None
        steps = 0
        while steps < POLISHES:
            gradient = objective.ld.gradient(x, objective.coordinates, objective.jets(x))
            step = factor.solve(-model.scatter(gradient))
            last, length = length, objective.relative_size(x, step, model)
            if not length < last:
                break
            x, steps = objective.retract(x, step, model), steps + 1
            if length <= ROUNDING or (length * length <= ROUNDING * last and last < np.inf):
                break
        if not length <= SETTLED:
            return None
        seconds = time.perf_counter() - self.began
        return minimum_at(objective.problem, x, self.steps + steps, seconds)


def nearby_minimum(objective: ActionObjective, x: DiscretePath) -> NearbyMinimum | None:
    """Newton's method from a path; None where it does not contract at once.

    Lengths are those of changes of q and T v: in a flat valley a change of the action says little
    of them.
    """
    began, whole, steps = time.perf_counter(), 0.0, 0
    for _ in range(HESSIANS):
        model = objective.model(x, None, None)
        factor = model.factor(0.0)
        if factor is None:
            return None
        value, gradient = objective.expansion.action, model.gradient
        way, length = 0.0, np.inf
        for _ in range(CORRECTIONS):
            step = factor.solve(-gradient)
            last, length = length, objective.relative_size(x, step, model)
            if not length <= last:
                return None
            x, steps, way = objective.retract(x, step, model), steps + 1, way + length
            whole = max(whole, length)
            if length <= max(NEGLIGIBLE * whole, ROUNDING) and last < np.inf:
                value += 0.5 * float(np.vdot(gradient, step))
                return NearbyMinimum(objective, x, value, model, factor, way, length, steps, began)
            if length > CONTRACTION * last and last < np.inf:
                break
            after = objective.ld.gradient(x, objective.coordinates, objective.jets(x))
            after = model.scatter(after)
            # the trapezium rule along the step, which is right to the third order
            value += 0.5 * float(np.vdot(gradient + after, step))
            gradient = after
    return None
