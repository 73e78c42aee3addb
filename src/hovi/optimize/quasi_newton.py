"""Quasi-Newton steps that begin with a factorisation from nearby, by BFGS updates of its inverse.

For where a gradient is cheap and a factorisation is at hand, but not that of the point itself.
[NocedalWright2006, algorithm 7.4]
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.quadratic_model import Factor

Array = npt.NDArray[np.float64]
X = TypeVar("X")

SHORTEST, UNKNOWN, LONGEST = 1e-3, 0.05, 0.7
"""Shares of a step that does not decrease the value as it should: bounds, and where it has none."""


class Smooth(ABC, Generic[X]):
    """What quasi-Newton steps need to know of an objective."""

    @abstractmethod
    def value(self, x: X) -> float:
        """The objective at x; not finite where it is not defined."""

    @abstractmethod
    def gradient(self, x: X) -> Array:
        """Its gradient, in the coordinates of the factorisation."""

    @abstractmethod
    def retract(self, x: X, step: Array) -> X:
        """The point that a step leads to."""


@dataclass(frozen=True, eq=False)
class _Inverse:
    """H^-1 as a factorisation and what steps have taught since.

    learned: steps s, changes y of the gradient in them, and s.y > 0.
    """

    factor: Factor
    learned: list[tuple[Array, Array, float]] = field(default_factory=list)

    def __matmul__(self, gradient: Array) -> Array:
        """H^-1 gradient."""
        rest, shares = gradient, []
        for s, y, sy in reversed(self.learned):
            shares.append(float(np.vdot(s, rest)) / sy)
            rest = rest - shares[-1] * y
        result = self.factor.solve(rest)
        for (s, y, sy), share in zip(self.learned, reversed(shares), strict=True):
            result = result + (share - float(np.vdot(y, result)) / sy) * s
        return result

    def learn(self, s: Array, y: Array) -> None:
        """Take in a step and the change of the gradient in it, where that is positive along it."""
        sy = float(np.vdot(s, y))
        if sy > 0.0:
            self.learned.append((s, y, sy))


def descend(objective: Smooth[X], x: X, factor: Factor, most: int, enough: float) -> X:
    """Where at most so many quasi-Newton steps lead, none of which increases the value.

    x: where to begin. factor: of the Hessian of a point nearby, positive definite.
    enough: stop when a step promises a smaller decrease, relative to the value.
    """
    value, gradient = objective.value(x), objective.gradient(x)
    inverse = _Inverse(factor)
    for _ in range(most):
        step = -(inverse @ gradient)
        slope = -float(np.vdot(gradient, step))
        if not slope > 2.0 * enough * abs(value):
            break
        share, there, reached = _shortened(objective, x, step, value, slope)
        if not reached < value:
            break
        after = objective.gradient(there)
        inverse.learn(share * step, after - gradient)
        x, value, gradient = there, reached, after
    return x


def _shortened(
    objective: Smooth[X], x: X, step: Array, value: float, slope: float
) -> tuple[float, X, float]:
    """A share of the step, where it leads and the value there.

    The whole step, or the minimum of a parabola along it where the value does not fall enough.
    slope: of the decrease in the step.
    """
    there = objective.retract(x, step)
    reached = objective.value(there)
    if value - reached > 0.3 * slope:
        return 1.0, there, reached
    share = UNKNOWN
    if np.isfinite(reached):
        share = min(max(0.5 * slope / (reached - value + slope), SHORTEST), LONGEST)
    there = objective.retract(x, share * step)
    return share, there, objective.value(there)
