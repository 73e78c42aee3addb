"""Limits between the points: tighten bounds and halve intervals until all limits hold."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.discrete.guess import stretched
from hovi.optimize.barrier import WARM_START_MARGIN, Barrier
from hovi.optimize.ended import STOPPED, Reason
from hovi.optimize.start import Start
from hovi.planning.solver.methods.bounded_search import (
    WARM_MU_RANGE,
    Bounded,
    BoundedSearch,
)
from hovi.planning.solver.methods.feasibility import feasible_motion, solved_from

Array = npt.NDArray[np.float64]

MAX_ROUNDS = 40
"""Maximum number of rounds, each of which tightens bounds or halves intervals."""
MAX_ROUNDS_PER_GRID = 9
"""Maximum number of rounds on one grid."""
MAX_HALVINGS = 14
"""Maximum number of rounds that halve intervals."""
HALVING_EXCESS = 0.05
"""Excess, as a fraction of the range, above which intervals are halved at once."""
NEIGHBOR_EXCESS = 0.01
"""Excess, as a fraction of the range, above which an interval is halved along with the worst."""
WARM_EXCESS = 0.2
"""Excess, as a fraction of the range, up to which the motion is the guess on halved intervals; one
that exceeds limits further between the points is an artifact of the coarse grid."""
TIGHTENING_FACTOR = 1.5
"""Ratio of tightening and excess; above 1, since the next motion uses the range that is left."""
EXTRA_TIGHTENING = 5.0
"""Additional tightening, in tolerances, to end the rounds early."""
UNUSED_MARGIN = 1e-3
"""Unused fraction of a range above which a tightened bound is relaxed again."""
TIMED_STEPS = 25
"""Maximum number of steps with tightened bounds where the duration moves, too: from there on halved
intervals take fewer."""
WARM_MU = 1e-2
"""First barrier parameter with tightened bounds, relative to the mean density, per largest
excess."""
MAX_MARGIN = 0.45
"""Maximum fraction of its range by which a bound is tightened."""


def tightened(search: BoundedSearch, ended: Bounded) -> tuple[Bounded, str, float]:
    """Tighten bounds where the interpolant exceeds them, and solve again, until they hold.

    Returns how the last solve ended, the reason for infeasibility or "", and the largest excess.
    """
    on_grid, halvings, reason = 0, 0, ""
    tolerance = search.limits.tolerance
    for rounds in range(MAX_ROUNDS + 1):
        sides = search.excess(ended.x)
        excess = float(sides.max())
        if excess <= tolerance or rounds == MAX_ROUNDS:
            break
        on_grid += 1
        finer = halvings < MAX_HALVINGS
        lengths = search.lengths
        coarse = excess > HALVING_EXCESS or (finer and on_grid > MAX_ROUNDS_PER_GRID)
        again = None if coarse else _solved_tighter(search, ended, sides)
        failed = again is None or not (_goes_on(search, again) or again.why in STOPPED)
        if failed and finer:
            halvings, on_grid = halvings + 1, 0
            search.back_to(lengths)
            again, reason = _solved_on_halves(search, ended, sides)
        if again is None:
            break
        ended = again
        if not usable(again):
            break
    if not reason and excess > tolerance and ended.why in (Reason.STATIONARY, Reason.DIVERGED):
        reason = (
            f"{search.worst(ended.x)}, between the quadrature points, at which limits are "
            "imposed; use more intervals"
        )
    return ended, reason, excess


def usable(ended: Bounded) -> bool:
    """Whether the motion is within bounds at the points, even if not a minimum yet."""
    return ended.feasible and ended.why in (Reason.STATIONARY, Reason.ITERATION_LIMIT)


def _goes_on(search: BoundedSearch, ended: Bounded) -> bool:
    """Whether bounds may be tightened further; with a free duration, after a minimum alone."""
    return usable(ended) and not (search.free_duration and ended.why is Reason.ITERATION_LIMIT)


def _solved_tighter(search: BoundedSearch, ended: Bounded, sides: Array) -> Bounded:
    """Solve again with the bounds tightened in proportion to the excess of the interpolant."""
    extra = EXTRA_TIGHTENING * search.limits.tolerance
    tighter = np.where(sides > 0, TIGHTENING_FACTOR * sides + extra, 0.0)
    unused = np.isfinite(sides) & (sides < -UNUSED_MARGIN)
    looser = np.where(unused, sides + 0.5 * UNUSED_MARGIN, 0.0)
    search.margins = np.clip(search.margins + tighter + looser, 0.0, MAX_MARGIN)
    objective = search.objective(search.multipliers)
    fraction = float(np.clip(WARM_MU * float(sides.max()), *WARM_MU_RANGE))
    mu = fraction * ended.outputs.density(objective.bounds.measure)
    y, barrier = objective.outputs(ended.x).y, ended.z
    z = None
    if len(y) == len(barrier.s):
        z = Barrier.central(objective.bounds, y, mu, None, WARM_START_MARGIN, barrier)
    whole = search.criteria
    if search.free_duration:
        most = min(TIMED_STEPS, whole.max_iterations)
        search.criteria = dataclasses.replace(whole, max_iterations=most)
    ended = search.solve(Start(ended.x, z))
    search.criteria = whole
    return ended


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
