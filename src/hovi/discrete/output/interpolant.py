"""The interpolant of a scheme at many positions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.schemes import Scheme
from hovi.schemes.interval_curve import jet_rows

Array = npt.NDArray[np.float64]

FEW_SAMPLES = 64
"""Number of samples up to which repeated positions are not looked for."""


def interpolant_rows(scheme: Scheme, s: Array, top: int) -> Array:
    """The interpolant of a scheme at s up to the derivative `top`, (M, top + 1, 2 k - 1 + r).

    Samples of many intervals mostly have the same positions s, of which each is evaluated once.
    """
    if len(s) > FEW_SAMPLES:
        known, index = np.unique(s, return_inverse=True)
        if len(known) < len(s) / 2:
            return interpolant_rows(scheme, known, top)[index]
    if scheme.derivatives >= top:
        return scheme.rows(s)
    return jet_rows(s, scheme.derivatives, scheme.inner_modes, top)
