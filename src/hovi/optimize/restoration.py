"""Restoration: steps that make the residual |c| of equations smaller, whatever the objective does.

Damped Gauss-Newton steps -(A^T A + damping D)^-1 A^T c, until |c| has become a tenth or has a
stationary point that is not zero. [NocedalWright2006, section 10.3]
"""

from __future__ import annotations

import math
from dataclasses import field
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.constrained_model import ConstrainedModel, EqualityObjective, size_of
from hovi.system.dataclass import dataclass
from hovi.system.deadline import raise_if_late
from hovi.system.interruption import raise_if_interrupted

Array = npt.NDArray[np.float64]
X = TypeVar("X")

MAX_STEPS = 30
"""Maximum number of steps."""
RESTORED = 0.1
"""Ratio of the residuals after and before."""
FIRST_DAMPING, LEAST_DAMPING, MAX_DAMPING = 1e-4, 1e-14, 1e6
"""Damping relative to A^T A: the first, and its bounds."""
STUCK_DAMPING = 1e-12
"""Damping of a step that shows a stationary point of |c|, as it changes little."""
OUTWEIGHING = 1e11
"""Weight of |c|^2 against f, where its Hessian is asked for."""
FLATNESS = 1e-6
"""Negative curvature of |c|^2, relative to A^T A, that counts as none."""
STUCK_DECREASE = 1e-13
"""Relative decrease of |c| that a step predicts at such a point."""


@dataclass(eq=False)
class Restored(Generic[X]):
    """The point that was reached.

    multipliers: least-squares multipliers there. stuck: whether |c| has a minimum there, not zero.
    residuals, lengths: |c| before every step, and its length.
    """

    x: X
    value: float
    residual: Array
    multipliers: Array
    stuck: bool = False
    residuals: list[float] = field(default_factory=list)
    lengths: list[float] = field(default_factory=list)


def restore(objective: EqualityObjective[X], x: X, max_steps: int) -> Restored[X]:
    """Steps from x that decrease the residual."""
    value, c = objective.evaluate(x)
    none = np.zeros_like(c)
    found = Restored(x, value, c, none)
    first, damping = size_of(c), FIRST_DAMPING
    model = objective.model(x, none)
    if not model.normal_band.size:  # without unknowns, nothing changes c
        found.stuck = not objective.feasible(x)
        return found
    while len(found.residuals) < min(max_steps, MAX_STEPS):
        raise_if_interrupted()
        raise_if_late()
        size = size_of(found.residual)
        if size <= RESTORED * first or objective.feasible(found.x):
            break
        step, predicted = _step(model, found.residual, damping)
        if predicted < STUCK_DECREASE * size:
            step, predicted = _step(model, found.residual, STUCK_DAMPING)
            if predicted < STUCK_DECREASE * size:
                found.stuck = _is_lowest(objective, found, model)
                break
        if damping > MAX_DAMPING:
            break
        x = objective.retract(found.x, step, model)
        value, c = objective.evaluate(x)
        found.residuals.append(size)
        found.lengths.append(model.length(step))
        if size - size_of(c) > 0.1 * predicted and math.isfinite(value):
            found.x, found.value, found.residual = x, value, c
            damping = max(0.1 * damping, LEAST_DAMPING)
            model = objective.model(x, none)
        else:
            damping *= 10.0
    found.multipliers = model.least_squares_multipliers()
    return found


def _is_lowest(
    objective: EqualityObjective[X], found: Restored[X], model: ConstrainedModel
) -> bool:
    """Whether |c|^2 has a minimum at a stationary point, by its Hessian A^T A + sum c_i d2 c_i.

    The Hessian of f, which the model contains as well, is outweighed.
    """
    weight = OUTWEIGHING * max(model.curvature_scale / model.normal_scale, 1.0)
    there = objective.model(found.x, weight * found.residual)
    return there.factor(weight, FLATNESS * weight * model.normal_scale) is not None


def _step(model: ConstrainedModel, residual: Array, damping: float) -> tuple[Array, float]:
    """A step and the decrease of |c| that it predicts."""
    factor = model.normal_factor(damping * model.normal_scale)
    if factor is None:
        raise ArithmeticError("the Jacobian of the equations has non-finite entries")
    step = factor.solve(-model.transposed_product(residual))
    return step, size_of(residual) - size_of(residual + model.jacobian_product(step))
