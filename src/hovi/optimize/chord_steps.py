"""Chord steps: Newton steps with the factorisation of a Hessian at a nearby point.

After a Newton step of length e the distance e^2 that remains decreases by a factor of the order of
e in every chord step, which costs a gradient instead of a Hessian and its factorisation.
[Kelley1995, section 5.4]
"""

from __future__ import annotations

from typing import Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.quadratic_model import Factor, QuadraticModel

Array = npt.NDArray[np.float64]
X = TypeVar("X")

MAX_CHORD_STEPS = 3
"""Maximum number of chord steps; where they do not suffice, a Hessian is better."""
LARGEST_RATIO = 0.1
"""Largest ratio of the decreases predicted by successive steps; above, chord steps are given up."""
REMAINING_DECREASE = 1e-26
"""Estimated relative decrease that may remain after the last step; its square root is the relative
error of the point."""
FIRST_SAFETY_FACTOR = 1e4
"""Safety factor on the decrease that is estimated to remain after the first chord step: a Newton
step along a stiff direction leaves an error along a soft one, which chord steps reduce less."""
NOISE = 1e-12
"""Relative increase of the value that counts as rounding."""


class Smooth(Protocol[X]):
    """A smooth objective: see hovi.optimize.trust_region.Objective."""

    def value(self, x: X) -> float:
        """The objective at x."""

    def gradient(self, x: X, model: QuadraticModel) -> Array | None:
        """The gradient at x in the unknowns of a model elsewhere; None without gradients."""

    def retract(self, x: X, step: Array, model: QuadraticModel) -> X:
        """The point that a step of a model leads to."""


def polish(
    objective: Smooth[X], x: X, value: float, model: QuadraticModel, factor: Factor, decrease: float
) -> tuple[X, float] | None:
    """A point with its value after chord steps until only rounding remains; None if it does not.

    A step that predicts the decrease d, after one that predicted d', leaves d^2 / d' to be gained.

    x, value: after a Newton step of the model, exact, which predicted the decrease. factor: of the
        model.
    """
    start, size, before, safety = value, abs(value), decrease, FIRST_SAFETY_FACTOR
    for _ in range(MAX_CHORD_STEPS):
        gradient = objective.gradient(x, model)
        if gradient is None:
            return None
        step = -factor.solve(gradient)
        predicted = -0.5 * float(np.vdot(gradient, step))
        if not predicted <= LARGEST_RATIO * before:
            return None
        x = objective.retract(x, step, model)
        if safety * predicted * (predicted / before) <= REMAINING_DECREASE * size:
            value = objective.value(x)
            return (x, value) if value <= start + NOISE * size else None
        before, safety = predicted, 1.0
    return None
