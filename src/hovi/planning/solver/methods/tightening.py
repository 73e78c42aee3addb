"""Limits between the points: bounds are tightened and intervals halved until all of them hold."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.guess import stretched
from hovi.optimize.trust_region import Stop
from hovi.planning.solver.methods.bounded_search import (
    ENDED,
    WARM_MU,
    Bounded,
    BoundedSearch,
    mean_density,
)
from hovi.planning.solver.methods.feasibility import feasible_motion

Array = npt.NDArray[np.float64]

MOST_ROUNDS = 40
"""Times that limits are tightened or intervals halved before giving up."""
ROUNDS_PER_GRID = 9
"""Times that limits are tightened on one grid."""
MOST_HALVINGS = 14
"""Times that intervals are halved when limits do not hold between their points."""
HALVING_EXCESS = 0.05
"""Excess, as a share of the range, beyond which intervals are halved instead of tightened."""
NEIGHBOR_EXCESS = 0.01
"""Excess beyond which an interval is halved together with the worst."""
OVERSHOOT = 1.5
"""How much further than the excess a bound is tightened: motions lean on what is left to them."""
EXTRA_MARGIN = 5.0
"""By what a bound is tightened besides, in tolerances, so that the last rounds are few."""
UNUSED_MARGIN = 1e-3
"""Unused share of a range beyond which a bound that was tightened is relaxed again."""
LARGEST_MARGIN = 0.45
"""Share of its range by which a bound is tightened at most."""


def tightened(search: BoundedSearch, outcome: Bounded) -> tuple[Bounded, str, float]:
    """Tighten bounds where the interpolant exceeds them, and solve again, until they hold.

    Returns the last outcome, why there is no motion, or "", and the largest excess.
    """
    on_grid, halvings, reason = 0, 0, ""
    tolerance = search.limits.tolerance
    for rounds in range(MOST_ROUNDS + 1):
        sides = search.excess(outcome.x)
        excess = float(sides.max())
        if excess <= tolerance or rounds == MOST_ROUNDS:
            break
        on_grid += 1
        finer = halvings < MOST_HALVINGS
        coarse = excess > HALVING_EXCESS or (finer and on_grid > ROUNDS_PER_GRID)
        again = None if coarse else _solved_tighter(search, outcome, sides)
        lost = again is None or not (usable(again) or again.stop in ENDED)
        if lost and finer:
            halvings, on_grid = halvings + 1, 0
            again, reason = _solved_on_halves(search, sides)
        if again is None:
            break
        outcome = again
        if not usable(again):
            break
    if not reason and excess > tolerance and outcome.stop in (Stop.STATIONARY, Stop.DIVERGED):
        reason = (
            f"{search.worst(outcome.x)}, between the points where limits are imposed; use more "
            "intervals"
        )
    return outcome, reason, excess


def usable(outcome: Bounded) -> bool:
    """Whether it tells which intervals to halve: between bounds at the points, if unfinished."""
    return outcome.feasible and outcome.stop in (Stop.STATIONARY, Stop.ITERATION_LIMIT)


def _solved_tighter(search: BoundedSearch, outcome: Bounded, sides: Array) -> Bounded:
    """Solve again with the bounds tightened by what the interpolant exceeds them."""
    tighter = np.where(sides > 0, OVERSHOOT * sides + EXTRA_MARGIN * search.limits.tolerance, 0.0)
    unused = np.isfinite(sides) & (sides < -UNUSED_MARGIN)
    looser = np.where(unused, sides + 0.5 * UNUSED_MARGIN, 0.0)
    search.margins = np.clip(search.margins + tighter + looser, 0.0, LARGEST_MARGIN)
    objective = search.objective(search.multipliers)
    share = float(np.clip(1e-2 * float(sides.max()), *WARM_MU))
    mu = share * mean_density(outcome, objective)
    start = outcome.barrier.warm(objective.bounds, outcome.outputs.y, mu)
    return search.solve(outcome.x, start)


def _solved_on_halves(search: BoundedSearch, sides: Array) -> tuple[Bounded, str]:
    """Solve again with the intervals halved in which a limit is exceeded, and their neighbours.

    From the first guess: a motion that far exceeds a limit between the points lives in the gaps
    between them, and leads the interior point astray on a finer grid.
    """
    grid = search.problem.grid
    by_interval = sides.max(axis=(0, 2))
    chosen = by_interval > min(NEIGHBOR_EXCESS, 0.5 * float(by_interval.max()))
    worst = chosen.copy()
    chosen[1:] |= worst[:-1]
    chosen[:-1] |= worst[1:]
    curve = stretched(search.trajectory(search.guess), grid.duration)
    search.problem = search.problem.on(grid.halved(chosen))
    search.guess = search.problem.path(curve)
    search.multipliers = None
    search.margins = search.no_margins()
    return feasible_motion(search)
