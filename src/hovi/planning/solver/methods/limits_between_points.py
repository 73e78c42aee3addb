"""Limits between the points: halve intervals until all limits hold.

Bounds at the points are tightened while a solve runs, as far as that is enough: see
BoundedSearch.tightening.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.guess import stretched
from hovi.optimize.ended import STOPPED, Reason
from hovi.optimize.start import Start
from hovi.planning.solver.between_points import LARGEST_MARGIN
from hovi.planning.solver.methods.bounded_search import Bounded, BoundedSearch
from hovi.planning.solver.methods.feasibility import feasible_motion, solved_from

Array = npt.NDArray[np.float64]

MAX_HALVINGS = 14
"""Maximum number of rounds that halve intervals."""
NEIGHBOR_EXCESS = 0.01
"""Excess, as a fraction of the range, above which an interval is halved along with the worst."""
WARM_EXCESS = 0.2
"""Excess, as a fraction of the range, up to which the motion is the guess on halved intervals; one
that exceeds limits further between the points is an artifact of the coarse grid."""


def halved(search: BoundedSearch, ended: Bounded) -> tuple[Bounded, str, float]:
    """Solve again on halved intervals while the interpolant exceeds bounds, until they hold.

    Returns how the last solve ended, the reason for infeasibility or "", and the largest excess.
    """
    reason, tolerance = "", search.limits.tolerance
    again, halvings = False, 0
    while True:
        sides = search.excess(ended.x)
        excess = float(sides.max())
        if excess <= tolerance or halvings == MAX_HALVINGS or not usable(ended):
            break
        if again or excess > LARGEST_MARGIN:
            ended, reason = _solved_on_halves(search, ended, sides)
            again, halvings = False, halvings + 1
        else:  # margins did not follow the motion to the end, or not at all
            ended, again = search.solve(Start(ended.x, ended.z)), True
    if not reason and excess > tolerance and ended.why in (Reason.STATIONARY, Reason.DIVERGED):
        reason = (
            f"{search.worst(ended.x)}, between the quadrature points, at which limits are "
            "imposed; use more intervals"
        )
    return ended, reason, excess


def usable(ended: Bounded) -> bool:
    """Whether the motion is within bounds at the points, even if not a minimum yet."""
    return ended.feasible and ended.why in (Reason.STATIONARY, Reason.ITERATION_LIMIT)


def _solved_on_halves(search: BoundedSearch, ended: Bounded, sides: Array) -> tuple[Bounded, str]:
    """Solve again with those intervals halved in which a limit is exceeded, and their neighbours.

    From the motion, if its excess is within WARM_EXCESS and that succeeds; else from the initial
    guess.
    """
    grid = search.problem.grid
    by_interval = sides.max(axis=(0, 2))
    chosen = by_interval > min(NEIGHBOR_EXCESS, 0.5 * float(by_interval.max()))
    worst = chosen.copy()
    chosen[1:] |= worst[:-1]
    chosen[:-1] |= worst[1:]
    motion, guess = (
        stretched(search.problem.trajectory(path), grid.duration, grid.order)
        for path in (ended.x, search.guess)
    )
    search.problem = search.problem.on(grid.halved(chosen))
    search.guess = search.problem.path(guess)
    search.multipliers, search.along = None, None
    search.margins = search.no_margins()
    search.rows = search.coarse_rows()
    if search.near is not None:
        search.near = search.no_near_rows()
    if usable(ended) and by_interval.max() <= WARM_EXCESS:
        again = solved_from(search, search.problem.path(motion))
        if usable(again) or again.why in STOPPED:
            return again, ""
    return feasible_motion(search)
