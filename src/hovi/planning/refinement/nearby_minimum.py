"""The minimum of the discrete action next to a path that is nearly one, by few Hessians.

Newton's method with Hessians that are kept while they serve: from nearby, a gradient and a step
with the known factors gain as much as a step of the optimiser, and cost less.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.optimize.quadratic_model import Factor, QuadraticModel
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.solver import Solution, minimum_at

HESSIANS = 5
"""That may be factored before the search is given up."""
CORRECTIONS = 2
"""Further steps with one Hessian."""
CONTRACTION = 0.3
"""Ratio of the lengths of successive steps above which the Hessian is renewed instead."""
NEGLIGIBLE = 0.02
"""Length of a step, as a share of the whole way, that makes it the last of an approach."""
ROUNDING = 1e-15
"""Length of a step, relative to the data, below which nothing is left to gain."""
POLISHES = 8
"""Steps with the last Hessian until only rounding is left."""
SETTLED = 1e-9
"""Length of a step that may be left where it hardly shrinks any more."""
LONG = 3e-3
"""Length of a step after which the Hessian is renewed in any case."""
FAR = 1e-2
"""Length of a way beyond which the Hessian at its end serves better than the one before it."""


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
        objective, x, last = self.objective, self.path, self.last
        model: QuadraticModel | None = self.model if self.way <= FAR else None
        factor, steps, length = self.factor, self.steps, np.inf
        for _ in range(POLISHES):
            if model is None:
                model, last = objective.model(x, None, None), np.inf
                renewed = model.factor(0.0)
                if renewed is None:
                    return None
                factor = renewed
            gradient = objective.ld.gradient(x, objective.coordinates, objective.jets(x))
            step = factor.solve(-model.scatter(gradient))
            length = objective.relative_size(x, step, model)
            if not length <= CONTRACTION * last:
                if length <= SETTLED:
                    break
                model = None
                continue
            x, steps = objective.retract(x, step, model), steps + 1
            if length <= ROUNDING or (length * length <= ROUNDING * last and last < np.inf):
                break
            last = length
        if not length <= SETTLED or objective.model(x, None, None).factor(0.0) is None:
            return None  # the exact Hessian tells a minimum, and all that served were near it
        seconds = time.perf_counter() - self.began
        return minimum_at(objective.problem, x, steps, seconds)


def nearby_minimum(
    objective: ActionObjective,
    x: DiscretePath,
    model: QuadraticModel,
    known: float | None = None,
) -> NearbyMinimum | None:
    """Newton's method from a path; None where it does not contract at once.

    model: the last of the objective, at the path: its curvature is best weighted with
        interpolated_slopes. Later Hessians are weighted with what the steps foresee.
    known: a cost whose difference from the minimum's has to come out well.
    Lengths are those of changes of q and T v: in a flat valley a change of the action says little
    of them.
    """
    began, whole, steps, before = time.perf_counter(), 0.0, 0, np.inf
    for _ in range(HESSIANS):
        factor = model.factor(0.0)
        if factor is None:
            return None
        value, gradient = objective.expansion.action, model.gradient
        way, last, gone = 0.0, before, np.zeros_like(gradient)
        for correction in range(CORRECTIONS + 1):
            step = factor.solve(-gradient)
            length = objective.relative_size(x, step, model)
            if not length <= (CONTRACTION if correction else 1.0) * last:
                break
            x, steps, way = objective.retract(x, step, model), steps + 1, way + length
            whole, gone = max(whole, length), gone + step
            fall = -0.5 * float(np.vdot(gradient, step))
            near = length <= max(NEGLIGIBLE * whole, ROUNDING)
            if near and (known is None or fall <= NEGLIGIBLE * abs(value - known)):
                return NearbyMinimum(
                    objective, x, value - fall, model, factor, way, length, steps, began
                )
            before, last = length if correction == 0 else before, length
            if length > LONG or correction == CORRECTIONS:
                break
            after = objective.ld.gradient(x, objective.coordinates, objective.jets(x))
            after = model.scatter(after)
            # the trapezium rule along the step, which is right to the third order
            value += 0.5 * float(np.vdot(gradient + after, step))
            gradient = after
        if way == 0.0:
            return None
        model = objective.model(x, model, gone)
    return None
