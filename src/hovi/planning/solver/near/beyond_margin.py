"""Outputs that bound distances: near pairs' distances, and constants where pairs are far."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

EXTRA_CLEARANCE = 5e-4
"""Clearance in rows beyond the margin, in DISTANCE_SCALE: 0.05 mm for the motion between."""
CUTOFF = 1.0, 3.0
"""Excess over the margin, in DISTANCE_SCALE, from which outputs level off, and are constant."""


def saturated(y: Array) -> tuple[Array, Array, Array]:
    """phi(y) and its two derivatives, in DISTANCE_SCALE.

    y up to the first CUTOFF, then width (x - x^3 + x^4/2) more with x in [0, 1], then constant.
    """
    near, far = CUTOFF
    if not np.any(y > near):  # as where rows are of near pairs alone
        return y.copy(), np.ones_like(y), np.zeros_like(y)
    width = far - near
    x = np.clip((y - near) / width, 0.0, 1.0)
    level = near + width * (x - x**3 + 0.5 * x**4)
    slope, bend = (1.0 - x) ** 2 * (1.0 + 2.0 * x), -6.0 * x * (1.0 - x) / width
    return np.where(y > near, level, y), slope, bend
