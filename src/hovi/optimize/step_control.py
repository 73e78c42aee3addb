"""How well a model predicted the decrease of a step, and the radius and shift that follow."""

from __future__ import annotations

import math


def decrease_ratio(actual: float, predicted: float, noise: float) -> float:
    """Actual over predicted decrease; 1 where both are rounding noise, -1 where not finite."""
    if not math.isfinite(actual):
        return -1.0
    if abs(actual) <= noise and abs(predicted) <= 10 * noise:
        return 1.0
    return actual / predicted if predicted > 0 else -1.0


def next_shift(shift: float, norm: float, radius: float) -> float:
    """Initial shift for a new radius: it decreases slightly faster than the radius grows."""
    return float(shift * (norm / radius) ** 1.2)


def next_radius(radius: float, norm: float, ratio: float) -> float:
    """The radius after a step: larger where the model was good and the radius limited the step.

    Where the model failed: the minimum of a parabola along the step, within bounds.
    norm: length of the step. ratio: actual over predicted decrease.
    """
    if ratio < 0.25:
        share = min(0.5, 0.5 / (1.0 - min(ratio, 0.0)))
        return max(0.25, share) * min(radius, norm)
    if ratio > 0.75 and norm > 0.7 * radius:
        return (2.0 if ratio > 0.9 else 1.4) * radius
    return radius
