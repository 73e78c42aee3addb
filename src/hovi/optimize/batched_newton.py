"""Newton's method for a batch of small systems of equations at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
System = Callable[[Array], tuple[Array, Array]]

SMALL = 1e-9
"""A relative step after which one more would only add rounding: Newton squares it."""
STALLED = 1e-6
"""Below this a step that hardly shrinks is rounding; a double root would halve it."""
MOST_STEPS = 60


def newton(system: System, u: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Roots of B systems F(u) = 0, and which of them were found.

    system: u (B, m) -> F (B, m), dF/du (B, m, m). u: where to start.
    A step is judged against the size of the root, at least one; where rounding keeps steps above
    `SMALL`, the first that does not shrink any more is the last. No line search: the steps of a
    motion are short, and a root that is lost is reported.
    """
    before = np.full(len(u), np.inf)
    for _ in range(MOST_STEPS):
        F, J = system(u)
        try:
            step = -np.linalg.solve(J, F[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:
            return u, np.zeros(len(u), dtype=bool)
        u = u + step
        change = np.abs(step).max(axis=1, initial=0.0) / np.abs(u).max(axis=1, initial=1.0)
        if not np.isfinite(change).all():
            return u, np.isfinite(change) & (change <= SMALL)
        if (settled := (change <= SMALL) | ((change < STALLED) & (change > 0.6 * before))).all():
            return u, settled
        before = change
    return u, np.asarray(change < STALLED)
