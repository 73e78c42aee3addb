"""Newton's method for a batch of small systems of equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
System = Callable[[Array], tuple[Array, Array]]
"""u (B, m) -> F (B, m), dF/du (B, m, m)."""

CONVERGED_STEP = 1e-9
"""Relative step after which the error, about its square, is below rounding."""
SLOW_RATIO = 0.6
"""Ratio of successive steps above which convergence is slow."""
STAGNATION_STEP = 1e-6
"""Relative step below which slow convergence is due to rounding; a double root would halve it."""
SEARCHED_STEP = 1e-3
"""Relative step above which the residual must fall; shorter ones converge on their own."""
SHORTEST = 2.0**-12
"""Part of a Newton step at which the search along it gives up."""
LEAST_FALL = 0.25
"""Least decrease of the residual, relative to the part of a Newton step that is taken."""
MAX_STEPS = 60
"""Maximum number of Newton steps."""


class Roots(NamedTuple):
    """What Newton's method found of B systems.

    u: shape (B, m). found: which converged, shape (B,). residual: the last Newton step relative to
        u, or to one where that is larger, shape (B,): the residual in the units of u; infinite
        where the matrix is singular.
    """

    u: Array
    found: Flags
    residual: Array


def newton(system: System, u: Array) -> tuple[Array, Flags]:
    """Roots of B systems F(u) = 0, and which of them converged: see `roots`."""
    found = roots(system, u)
    return found.u, found.found


@np.errstate(over="ignore", invalid="ignore")
def roots(system: System, u: Array) -> Roots:
    """Roots of B systems F(u) = 0 by Newton's method with a line search.

    system: u (B, m) -> F (B, m), dF/du (B, m, m). u: initial values, shape (B, m).
    Steps are measured relative to the root, or to one where that is larger; where rounding keeps
    them above `CONVERGED_STEP`, the iteration ends once they stop shrinking. A long step is halved
    until the residual falls in the measure |J^-1 F| of the matrix J where the step began, which
    does not depend on the units of the equations. [Deuflhard2011, natural monotonicity]
    """
    B = len(u)
    residual, lost = np.full(B, np.inf), np.zeros(B, dtype=bool)
    step, before = np.zeros_like(u), (u, np.zeros((B, u.shape[1], u.shape[1])))
    for _ in range(MAX_STEPS):
        raise_if_late()
        F, J = system(u)
        searched = (residual > SEARCHED_STEP) & np.isfinite(residual) & ~lost
        if searched.any():
            u, F, J, stuck = _search(system, before, step, (u, F, J), searched)
            lost |= stuck
        before, last = (u, J), residual
        step = _solve(J, F)
        size = np.abs(step).max(axis=1, initial=0.0)
        lost |= ~np.isfinite(size)
        step[lost] = 0.0
        u = u + step
        change = size / np.abs(u).max(axis=1, initial=1.0)
        residual = np.where(lost, np.where(np.isfinite(last), last, np.inf), change)
        settled = ~lost & (
            (change <= CONVERGED_STEP) | ((change < STAGNATION_STEP) & (change > SLOW_RATIO * last))
        )
        if (settled | lost).all():
            return Roots(u, settled, residual)
    return Roots(u, ~lost & (residual < STAGNATION_STEP), residual)


def _search(
    system: System,
    before: tuple[Array, Array],
    step: Array,
    now: tuple[Array, Array, Array],
    searched: Flags,
) -> tuple[Array, Array, Array, Flags]:
    """u, F and J after the steps shortened where the residual did not fall, and which got stuck.

    before: u and J where the steps began. step: shape (B, m). now: u, F and J after it.
    searched: which systems are looked at, shape (B,).
    """
    start, matrix = before
    u, F, J = (x.copy() for x in now)
    size, part = np.linalg.norm(step, axis=1), 1.0
    rising = searched & ~_fallen(matrix, F, size, part)
    while rising.any() and part > SHORTEST:
        part /= 2
        u[rising] = start[rising] + part * step[rising]
        F_new, J_new = system(u)
        F[rising], J[rising] = F_new[rising], J_new[rising]
        rising &= ~_fallen(matrix, F, size, part)
    u[rising], F[rising] = start[rising], 0.0
    return u, F, J, rising


def _fallen(matrix: Array, F: Array, size: Array, part: float) -> Flags:
    """Whether the simplified Newton step is shorter than the step that led here."""
    return np.asarray(np.linalg.norm(_solve(matrix, F), axis=1) <= (1 - LEAST_FALL * part) * size)


def _solve(J: Array, F: Array) -> Array:
    """-J^-1 F, shape (B, m), not a number where J is singular or not finite."""
    try:
        return np.asarray(-np.linalg.solve(J, F[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        if len(J) == 1:
            return np.full_like(F, np.nan)
        return np.concatenate([_solve(J[i : i + 1], F[i : i + 1]) for i in range(len(J))])
