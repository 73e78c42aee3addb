"""Restoration: steps that make the residual |c| of equations smaller, whatever the objective does.

Damped Gauss-Newton steps -(A^T A + damping D)^-1 A^T c, until |c| has become a tenth or has a
stationary point that is not zero. Once such a step has failed, the curvature
sum c_i d2 c_i is added to A^T A. [NocedalWright2006, section 10.3]
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Ended, Iteration, Reason
from hovi.optimize.kkt_model import EqualityObjective, KktModel, size_of
from hovi.optimize.observed import between_steps
from hovi.optimize.start import Start

Array = npt.NDArray[np.float64]
X = TypeVar("X")

MAX_STEPS = 30
"""Maximum number of steps of a restoration."""
RESTORED = 0.1
"""Ratio of the residuals after and before a restoration, at which it ends."""
ACCEPTED_RATIO = 0.1
"""Ratio of the actual and the predicted decrease of |c| above which a step is accepted."""
FIRST_DAMPING, LEAST_DAMPING, MAX_DAMPING = 1e-4, 1e-14, 1e6
"""Damping relative to A^T A: the first, and its bounds."""
DAMPING_DECREASE, DAMPING_GROWTH = 0.1, 10.0
"""Factors on the damping after a step that is accepted and after one that is not."""
STUCK_DAMPING = 1e-12
"""Damping of a step that shows a stationary point of |c|, as it changes little."""
OUTWEIGHING = 1e11
"""Weight of |c|^2 against f, where its Hessian is asked for."""
FLATNESS = 1e-6
"""Negative curvature of |c|^2, relative to A^T A, that counts as none."""
STUCK_DECREASE = 1e-13
"""Relative decrease of |c| that a step predicts at a stationary point of |c|, at most."""


def restore(
    objective: EqualityObjective[X], start: Start[X, Array], criteria: Criteria
) -> Ended[X, Array]:
    """Steps that decrease the residual; z are least-squares multipliers at the last point.

    It ends as INFEASIBLE where |c| has a minimum that is not zero.
    """
    outputs = objective.evaluate(start.x)
    none = np.zeros_like(outputs.y)
    ended = Ended(start.x, outputs, none)
    first, damping = size_of(outputs.y), FIRST_DAMPING
    model = objective.model(start.x, none)
    if not model.layout.plain.size:  # without unknowns, nothing changes c
        if not objective.feasible(start.x):
            ended.why = Reason.INFEASIBLE
        return ended
    step_of = _step
    while len(ended.steps) < min(criteria.max_iterations, MAX_STEPS):
        between_steps(objective, ended.x)
        size = size_of(ended.outputs.y)
        if size <= RESTORED * first or objective.feasible(ended.x):
            ended.why = Reason.STATIONARY
            break
        step, predicted = step_of(objective, ended, model, damping)
        if predicted < STUCK_DECREASE * size:
            step, predicted = step_of(objective, ended, model, STUCK_DAMPING)
            if predicted < STUCK_DECREASE * size:
                lowest = _is_lowest(objective, ended, model)
                ended.why = Reason.INFEASIBLE if lowest else Reason.STALLED
                break
        if damping > MAX_DAMPING:
            ended.why = Reason.DIVERGED
            break
        x = objective.retract(ended.x, step, model)
        there = objective.evaluate(x)
        gained = size - size_of(there.y)
        ratio, length = gained / predicted, model.length(step)
        ended.steps.append(Iteration(there.value, predicted, ratio, damping, length, size))
        if gained > ACCEPTED_RATIO * predicted and math.isfinite(there.value):
            ended.x, ended.outputs = x, there
            damping = max(DAMPING_DECREASE * damping, LEAST_DAMPING)
            model = objective.model(x, none)
        else:
            damping *= DAMPING_GROWTH
            step_of = _newton_step
    ended.z = model.least_squares_multipliers()
    return ended


def _is_lowest(objective: EqualityObjective[X], ended: Ended[X, Array], model: KktModel) -> bool:
    """Whether |c|^2 has a minimum at a stationary point, by its Hessian A^T A + sum c_i d2 c_i."""
    weight, there = _with_curvature(objective, ended, model)
    shift = FLATNESS * weight * model.normal_scale
    return there.factor(shift, 1.0 / weight) is not None


def _with_curvature(
    objective: EqualityObjective[X], ended: Ended[X, Array], model: KktModel
) -> tuple[float, KktModel]:
    """w and the model of w c.c / 2: the Hessian of f, which it contains as well, is outweighed."""
    weight = OUTWEIGHING * max(model.curvature_scale / model.normal_scale, 1.0)
    return weight, objective.model(ended.x, weight * ended.outputs.y)


def _step(
    objective: EqualityObjective[X], ended: Ended[X, Array], model: KktModel, damping: float
) -> tuple[Array, float]:
    """A Gauss-Newton step and the decrease of |c| that it predicts."""
    c, none = ended.outputs.y, np.zeros(model.layout.plain.size)
    factor = model.normal_factor(damping * model.normal_scale, 1.0)
    step, _ = factor.solve(none, -c)
    if not np.isfinite(step).all():
        raise ArithmeticError("the Jacobian of the equations has non-finite entries")
    return step, size_of(c) - size_of(c + model.jacobian_product(step))


def _newton_step(
    objective: EqualityObjective[X], ended: Ended[X, Array], model: KktModel, damping: float
) -> tuple[Array, float]:
    """As `_step`, with the curvature of c where A^T A with it is positive definite.

    Gauss-Newton steps are too long, or many, near a minimum of |c| that is not zero.
    """
    weight, there = _with_curvature(objective, ended, model)
    factor = there.factor(damping * weight * model.normal_scale, 1.0 / weight)
    if factor is None:
        return _step(objective, ended, model, damping)
    c = ended.outputs.y
    step, _ = factor.solve(np.zeros(model.layout.plain.size), -c)
    square = size_of(c + model.jacobian_product(step)) ** 2 + there.curvature(step) / weight
    return step, size_of(c) - math.sqrt(max(square, 0.0))
