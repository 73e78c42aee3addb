"""Ranges of angles that were probably meant in degrees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

MIN_SUSPICIOUS, MAX_SUSPICIOUS = 8 * np.pi, 720.0
"""Bounds of angles in this range, in [rad], look like degrees: few joints make four turns, and a
number beyond two turns in degrees, such as 1000, usually stands for no bound."""


def ranges_in_degrees(
    names: Sequence[str], angles: npt.NDArray[np.bool_], lower: Array, upper: Array
) -> str:
    """The ranges that look like degrees, as a clause; "" if none does.

    names: of the coordinates, (nv,). angles: which are angles, (nv,). lower, upper: in [rad].
    """
    sizes = np.abs(np.stack([lower, upper]))
    suspicious = (sizes > MIN_SUSPICIOUS) & (sizes <= MAX_SUSPICIOUS)
    found = np.flatnonzero(angles & suspicious.any(axis=0))
    if not len(found):
        return ""
    i = int(found[0])
    more = f" and of {len(found) - 1} more" if len(found) > 1 else ""
    return (
        f"the position range of {names[i]}{more}, {lower[i]:g} to {upper[i]:g} rad, looks like "
        f"degrees: {lower[i]:g} to {upper[i]:g} degrees are {np.radians(lower[i]):.4g} to "
        f"{np.radians(upper[i]):.4g} rad"
    )
