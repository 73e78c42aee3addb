"""Newton's method for a batch of small systems of equations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
System = Callable[[Array], tuple[Array, Array]]
"""u (B, m) -> F (B, m), dF/du (B, m, m)."""

CONVERGED_STEP = 1e-9
"""Relative step after which the error, about its square, is below rounding."""
STAGNATION_STEP = 1e-6
"""Relative step below which slow convergence is due to rounding; a double root would halve it."""
MAX_STEPS = 60
"""Maximum number of Newton steps."""


def newton(system: System, u: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Roots of B systems F(u) = 0, and which of them converged, shapes (B, m) and (B,).

    system: u (B, m) -> F (B, m), dF/du (B, m, m). u: initial values, shape (B, m).
    Steps are measured relative to the root, or to one where that is larger; where rounding keeps
    them above `CONVERGED_STEP`, the iteration ends once they stop shrinking. There is no line
    search: the steps of a motion are short, and a system that does not converge is reported.
    """
    before = np.full(len(u), np.inf)
    for _ in range(MAX_STEPS):
        F, J = system(u)
        try:
            step = -np.linalg.solve(J, F[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:
            return u, np.zeros(len(u), dtype=bool)
        u = u + step
        change = np.abs(step).max(axis=1, initial=0.0) / np.abs(u).max(axis=1, initial=1.0)
        if not np.isfinite(change).all():
            return u, np.isfinite(change) & (change <= CONVERGED_STEP)
        if (
            settled := (change <= CONVERGED_STEP)
            | ((change < STAGNATION_STEP) & (change > 0.6 * before))
        ).all():
            return u, settled
        before = change
    return u, np.asarray(change < STAGNATION_STEP)
