"""A free duration with a tolerance.

Two searches alternate: for the best duration on a grid, and for a grid that is fine enough at that
duration. Each hardly changes the result of the other.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from hovi.discrete.grid import Grid
from hovi.planning.problem.tolerance import Round
from hovi.planning.search.free_duration import (
    DURATION_PRECISION,
    BestDuration,
    FreeDuration,
    SolveFor,
)
from hovi.planning.search.joint_duration import JointSolve, best_duration_by
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status

OnGrid = Callable[[Grid], SolveFor]
"""Returns a solver on a grid, scaled to each duration."""
Refine = Callable[[Solution], Solution]
"""Refines a motion of fixed duration to the tolerance; keeps its grid if that is fine enough."""

MAX_GRIDS = 4
"""Maximum number of grids on which the best duration is computed."""
FINER_GRID_STRIDE = 1.001
"""Ratio of the first two durations on a finer grid."""

LARGEST_SLOPE = 0.1
"""Slope J' + w, relative to J' or w, of a duration that is nearly the best."""


def free_to_tolerance(
    free: FreeDuration,
    on_grid: OnGrid,
    refine: Refine,
    first: Solution,
    jointly: JointSolve | None = None,
) -> Solution:
    """A motion within a tolerance, whose duration is the best one on its grid.

    first: a solution for some duration between the bounds, on a coarse grid.
    jointly: solves for the duration, too; none if None.
    The accuracy is that of the motion for its fixed duration, relative to the cost without w T.
    Where J' + w vanishes, an error of the duration changes the cost to second order only.
    If a later round fails, the motion within the tolerance of the round before is returned; after
    an interrupt it counts as no success.
    """
    found = best_duration_by(free, on_grid(first.trajectory.grid), first, jointly=jointly)
    steps, rounds = found.steps, tuple[Round, ...]()
    kept: BestDuration | None = None
    for number in range(MAX_GRIDS):
        if not found.solution.success:
            break
        refined = refine(found.solution)
        assert refined.accuracy is not None
        rounds += refined.accuracy.rounds
        steps += sum(done.nit for done in refined.accuracy.rounds[1:])
        settled = refined.trajectory.grid is found.solution.trajectory.grid
        ending = found.ending if refined.success else "The duration is"
        found = dataclasses.replace(found, solution=refined, ending=ending)
        if not refined.accuracy.reached:
            break
        kept = found
        if settled or number == MAX_GRIDS - 1:
            break
        solve = on_grid(refined.trajectory.grid)
        found = best_duration_by(free, solve, refined, FINER_GRID_STRIDE, jointly)
        steps += found.steps - refined.nit
    best = found if kept is None or kept is found else _with_failure(kept, found.solution)
    if best.solution.success and not _is_best(best):
        reason = "on the last grid another duration is far better than that of the grid before"
        best = best.unfinished(Status.UNRESOLVED, reason)
    return _with_rounds(dataclasses.replace(best, steps=steps), rounds)


def _is_best(found: BestDuration) -> bool:
    """Whether J' + w nearly vanishes, or pushes against the bound at which the duration is."""
    free, solution = found.free, found.solution
    T, rate = solution.trajectory.duration, solution.duration_derivative
    slope = rate + free.weight
    bound = free.lower if slope > 0 else free.upper
    small = abs(slope) <= LARGEST_SLOPE * max(abs(rate), free.weight)
    return bool(small or abs(T / bound - 1) <= DURATION_PRECISION)


def _with_failure(kept: BestDuration, failed: Solution) -> BestDuration:
    """The last motion within the tolerance, with the reason why the next round failed."""
    reason = str(failed.status) if not failed.success else "the tolerance was not reached again"
    if failed.status is Status.INTERRUPTED:  # so that the search ends
        kept = kept.unfinished(failed.status, "the search for the best duration was interrupted")
    ending = f"The best duration, found on a coarser grid ({reason} on the finer one), is"
    return dataclasses.replace(kept, ending=ending)


def _with_rounds(found: BestDuration, rounds: tuple[Round, ...]) -> Solution:
    """The solution with all rounds, and with its accuracy in the message if it was estimated."""
    solution = found.with_time()
    if solution.accuracy is None:
        return solution
    accuracy = dataclasses.replace(solution.accuracy, rounds=rounds)
    message = f"{solution.message.removesuffix('.')}; {accuracy}"
    return dataclasses.replace(solution, message=message, accuracy=accuracy)
