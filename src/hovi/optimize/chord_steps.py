"""Chord steps: Newton steps with the factorisation of a Hessian at a nearby point.

After a Newton step of length e the distance e^2 that remains decreases by a factor of the order of
e in every chord step, which costs a gradient instead of a Hessian and its factorisation.
[Kelley1995, section 5.4]
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np

from hovi.optimize.quadratic_model import QuadraticModel

if TYPE_CHECKING:
    from hovi.optimize.trust_region import Objective, Outcome, Trial

X = TypeVar("X")

MAX_STEPS = 3
"""Maximum number of chord steps; where they do not suffice, a Hessian is better."""
LARGEST_RATIO = 0.1
"""Largest ratio of the decreases that two successive steps predict for which they are taken."""
REMAINING_DECREASE = 1e-26
"""Estimated relative decrease that may remain after the last step; its square root is the relative
error of the point."""
FIRST_RATIO = 1e4
"""Largest ratio of the decreases before and after the first chord step, relative to that of the
Newton step's and the chord step's: a Newton step along a stiff direction leaves an error along a
soft one, which chord steps reduce less."""
NOISE = 1e-12
"""Relative increase of the value that counts as rounding."""


def polish(
    objective: Objective[X], outcome: Outcome[X], model: QuadraticModel, trial: Trial
) -> bool:
    """Improve a point until only rounding remains; whether that was reached, else it is unchanged.

    The decrease that remains after a chord step is estimated from the ratio of those that it and
    the step before it predict.
    outcome: whose point the Newton step of the trial led to. model: that of the trial, exact.
    """
    size, before, x = abs(outcome.value), trial.decrease, outcome.x
    factor, margin = trial.factor, FIRST_RATIO
    if factor is None:
        return False
    for _ in range(MAX_STEPS):
        gradient = objective.gradient(x, model)
        if gradient is None:
            return False
        step = -factor.solve(gradient)
        decrease = -0.5 * float(np.vdot(gradient, step))
        if not decrease <= LARGEST_RATIO * before:
            return False
        x = objective.retract(x, step, model)
        if margin * decrease * (decrease / before) <= REMAINING_DECREASE * size:
            value = objective.value(x)
            if not value <= outcome.value + NOISE * size:
                return False
            outcome.x, outcome.value = x, value
            return True
        before, margin = decrease, 1.0
    return False
