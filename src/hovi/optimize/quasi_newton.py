"""Quasi-Newton steps: BFGS updates of the inverse of a Hessian that was factored at a nearby point.

Useful where gradients are cheap and a new factorisation is not.
[NocedalWright2006, algorithm 7.4]
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import field
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.quadratic_model import Factor
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
X = TypeVar("X")

MIN_SHARE, MAX_SHARE = 1e-3, 0.7
"""Bounds of the share by which a step is shortened that does not decrease the value enough."""
NON_FINITE_SHARE = 0.05
"""That share where the value after the whole step is not finite."""


class Smooth(ABC, Generic[X]):
    """A smooth objective."""

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
    """H^-1 as a factorisation with BFGS updates.

    updates: steps s, changes y of the gradient in them, and s.y > 0.
    """

    factor: Factor
    updates: list[tuple[Array, Array, float]] = field(default_factory=list)

    def __matmul__(self, gradient: Array) -> Array:
        """H^-1 gradient."""
        rest, shares = gradient, []
        for s, y, sy in reversed(self.updates):
            shares.append(float(np.vdot(s, rest)) / sy)
            rest = rest - shares[-1] * y
        result = self.factor.solve(rest)
        for (s, y, sy), share in zip(self.updates, reversed(shares), strict=True):
            result = result + (share - float(np.vdot(y, result)) / sy) * s
        return result

    def update(self, s: Array, y: Array) -> None:
        """Add the update of a step s with gradient change y, if s.y > 0."""
        sy = float(np.vdot(s, y))
        if sy > 0.0:
            self.updates.append((s, y, sy))


def descend(objective: Smooth[X], x: X, factor: Factor, max_steps: int, tolerance: float) -> X:
    """The point after at most `max_steps` quasi-Newton steps, none of which increases the value.

    x: initial point. factor: of the Hessian at a nearby point, positive definite.
    tolerance: stop when a step predicts a smaller decrease, relative to the value.
    """
    value, gradient = objective.value(x), objective.gradient(x)
    inverse = _Inverse(factor)
    for _ in range(max_steps):
        step = -(inverse @ gradient)
        slope = -float(np.vdot(gradient, step))
        if not slope > 2.0 * tolerance * abs(value):
            break
        share, there, reached = _shortened(objective, x, step, value, slope)
        if not reached < value:
            break
        after = objective.gradient(there)
        inverse.update(share * step, after - gradient)
        x, value, gradient = there, reached, after
    return x


def _shortened(
    objective: Smooth[X], x: X, step: Array, value: float, slope: float
) -> tuple[float, X, float]:
    """The accepted share of a step, the point that it leads to, and the value there.

    The whole step, or the minimum of a parabola along it where the value does not decrease enough.
    slope: rate of decrease along the step.
    """
    there = objective.retract(x, step)
    reached = objective.value(there)
    if value - reached > 0.3 * slope:
        return 1.0, there, reached
    share = NON_FINITE_SHARE
    if np.isfinite(reached):
        share = min(max(0.5 * slope / (reached - value + slope), MIN_SHARE), MAX_SHARE)
    there = objective.retract(x, share * step)
    return share, there, objective.value(there)
